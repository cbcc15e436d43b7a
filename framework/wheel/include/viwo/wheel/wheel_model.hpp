// A kinematic model as the framework uses it: the plugin's object with its checked description.
// Its rows (W-1) give the twist by least squares (W-2), as far as their rank goes (W-3).
// Equations: docs/math/wheel_odometry.md.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "viwo/api/kinematic_model.hpp"

namespace viwo {

/// A kinematic model, its description with all row ranges filled in, and the intrinsics in use.
/// Immutable and shared: solvers and preintegrators of any thread read it.
class WheelModel {
 public:
  /// Reads and checks the description; throws InputError when it contradicts itself (a plugin bug,
  /// told by field name).
  explicit WheelModel(std::shared_ptr<const KinematicModel> model);

  const KinematicModel& model() const { return *model_; }
  const ModelDescription& description() const { return description_; }
  int n_intrinsics() const { return static_cast<int>(description_.intrinsics.size()); }
  int n_rows() const { return description_.n_rows; }
  int n_noises() const { return static_cast<int>(description_.noises.size()); }

  Intrinsics nominal() const;
  Intrinsics prior_sigma() const;                ///< 0 where the gauge holds an entry
  Intrinsics drawn_sigma() const;                ///< of a drawing, in whose frame nothing is held
  int find(const std::string& intrinsic) const;  ///< index, or -1

  /// Throws InputError naming both counts when a sample has other channels than the model needs.
  void require_channels(const EncoderSample& sample, const std::string& sensor) const;

 private:
  std::shared_ptr<const KinematicModel> model_;
  ModelDescription description_;
};

}  // namespace viwo

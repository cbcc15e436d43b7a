// A kinematic model on the bench: its description, readings to try it at, and all that it answers.
#pragma once

#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/kinematic_model.hpp"

namespace viwo::robot {

/// Where a model is tried.
struct Probe {
  std::string name;  ///< "arc, unequal parameters"
  EncoderSample y;
  Intrinsics x_WI;
  Twist xi = Twist::Zero();
  RowVector e;           ///< any residual
  bool follows = false;  ///< the rows hold: y is what a base without slip reads
};

/// All that a model answers at a probe.
struct Answer {
  Status status = Status::kRejected;
  RowSystem rows;
  IntrinsicDerivatives by_x;
  NoiseDerivatives by_n;
};

/// Where the derivatives are taken.
enum class Signal { kMeasured, kFitted };

class Bench {
 public:
  /// Throws InputError when the description has sizes that nothing can be done with.
  explicit Bench(std::shared_ptr<const KinematicModel> model);

  const KinematicModel& model() const { return *model_; }
  const ModelDescription& description() const { return description_; }  ///< row ranges filled in
  int n_x() const { return static_cast<int>(description_.intrinsics.size()); }
  int n_noises() const { return static_cast<int>(description_.noises.size()); }

  Intrinsics nominal() const;
  /// Nominal values with several prior sigmas, or some percent, of difference.
  Intrinsics unequal(std::mt19937_64& rng) const;

  /// A and b; nothing if the model rejects the sample.
  std::optional<RowSystem> rows(const EncoderSample& y, const Intrinsics& x_WI) const;
  /// b - A xi, likewise.
  std::optional<RowVector> residual(const EncoderSample& y, const Intrinsics& x_WI,
                                    const Twist& xi) const;
  Answer answer(const Probe& probe, Signal signal = Signal::kMeasured) const;
  /// The same into buffers that have been used before.
  void answer(const Probe& probe, Signal signal, Answer& out) const;
  /// Zeros of the right sizes.
  Answer empty_answer() const;

  /// A reading at which the rows hold for xi, from inverse() or by solving the rows; v_y of xi is
  /// changed when the base cannot move sideways as it says. `y` holds the previous reading.
  bool follow(const Intrinsics& x_WI, Twist& xi, EncoderSample& y) const;
  EncoderSample zero_reading() const;

  /// Motions that the rows can follow: rest, straight, arc, ...
  std::vector<Probe> motions() const;
  /// And readings of any kind: steering near its limits, wheels that contradict each other.
  std::vector<Probe> probes() const;
  std::vector<Probe> random_motions(int count, const Intrinsics& x_WI) const;

 private:
  bool solve_rows(const Intrinsics& x_WI, bool v_y_is_free, Twist& xi, EncoderSample& y) const;

  std::shared_ptr<const KinematicModel> model_;
  ModelDescription description_;
};

std::string noise_name(const NoiseSpec& noise, int index);

/// Same numbers to the bit.
bool same_bits(const Answer& a, const Answer& b);

}  // namespace viwo::robot

// What is still to be driven, while it is driven: the piece that would tell a filter most of what
// it does not know well enough. Equations: docs/math/plan.md.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "viwo/plan/plan.hpp"

namespace viwo::plan {

/// Of the intrinsic that is furthest from its goal.
struct Forecast {
  std::string parameter, unit;
  double sigma = 0., goal = 0.;
  /// The piece that lowers what is above its goal most per metre; "" for none that does.
  std::string piece;
  double cost_m = 0.;       ///< path of the fastest point of the base
  double sigma_after = 0.;  ///< of the same intrinsic, behind that piece

  bool is_enough() const { return sigma <= goal; }
};

/// "delta_o3: 4.1 mrad (goal 1 mrad), 2 mrad after another figure_eight of 2.3 m".
std::string text_of(const Forecast& forecast);

class Forecaster {
 public:
  /// Drives all pieces of the plan once: a second or so.
  explicit Forecaster(PlanSetup setup);

  /// With the intrinsics `names` known as `P` (their covariance, in their units) says; those that
  /// are not among them are not estimated. InputError when they are not of this base, or when none
  /// of the goals is.
  Forecast of(std::span<const std::string> names, const Eigen::MatrixXd& P);

  /// InputError when the base of the plan has no such intrinsic; its index.
  Eigen::Index require(const std::string& intrinsic) const;
  WheelInformation& wheels() { return wheels_; }

 private:
  PlanSetup setup_;
  WheelInformation wheels_;
  std::vector<Piece> pieces_;
};

}  // namespace viwo::plan

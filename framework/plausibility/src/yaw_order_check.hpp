// Signs and order of the channels of wheels that cannot contradict each other, as they turn.
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "sensor_name.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/plausibility/finding.hpp"
#include "viwo/plausibility/yaw_order.hpp"
#include "viwo/wheel/twist_solver.hpp"

namespace viwo {

class YawOrderCheck {
 public:
  static constexpr int kMost = 16;  ///< changes
  using Rates = Eigen::Matrix<double, kMost, 1>;

  YawOrderCheck(SensorName wheels, const std::shared_ptr<const WheelModel>& model,
                const Intrinsics& x_WI);

  /// Yaw rate of a sample with each of the changes undone, rad/s, of which `as_it_is` is known;
  /// NaN: the wheels tell none.
  Rates rates(const EncoderSample& sample, double as_it_is);
  /// Means over the same time.
  void add(double gyro_rad_per_s, const Rates& wheels_rad_per_s);
  /// Whether one of the changes explains what the gyro says.
  bool findings(Findings& out) const;

 private:
  SensorName wheels_;
  TwistSolver solver_;
  TwistSolution solution_;
  std::vector<ChannelChange> changes_;  ///< the first is none
  std::vector<YawDifference> undone_;
  YawDifference opposite_;
};

}  // namespace viwo

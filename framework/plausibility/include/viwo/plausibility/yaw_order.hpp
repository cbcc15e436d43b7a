// Signs and order of the channels of wheels, by a yaw rate that is not theirs.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "viwo/api/kinematic_model.hpp"
#include "viwo/plausibility/channel_change.hpp"
#include "viwo/wheel/wheel_model.hpp"

namespace viwo {

/// A gyro's rate and that of wheels over the same times.
class YawDifference {
 public:
  void add(double gyro_rad_per_s, double wheels_rad_per_s);
  int count() const { return n_; }
  /// Of the gyro's rate, (rad/s)^2.
  double variance() const;
  /// What the wheels leave of it, times a factor within 1.5 of 1: sizes of a base that are wrong by
  /// that turn no wheel the other way. 1 where nothing is to be compared.
  double part() const;

 private:
  int n_ = 0;
  double gyro_ = 0., gyro_squares_ = 0., wheels_ = 0., wheels_squares_ = 0., products_ = 0.;
};

/// What wheels cannot say among themselves: with more than three rows, whole sides alone. The first
/// is none.
std::vector<ChannelChange> changes_by_gyro(const std::shared_ptr<const WheelModel>& model,
                                           const Intrinsics& x_WI);

/// Which change, undone, explains the gyro's rate: to a tenth of it, and of what the wheels leave
/// as they are, and to a third of what any other leaves. 0: none. `opposite` is of the wheels as
/// they are, but for the sign of their rate: that may be the gyro's as well.
std::size_t clear_change(std::span<const YawDifference> undone, const YawDifference& opposite);

/// "drive_2 turns opposite ...: its sign (of the variance of the gyro's rate they leave 290 %,
/// ...)"
std::string text_of(const ChannelChange& change, const YawDifference& as_it_is,
                    const YawDifference& undone);

}  // namespace viwo

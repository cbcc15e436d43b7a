#include "viwo/plausibility/yaw_order.hpp"

#include <algorithm>

#include "viwo/math/significant.hpp"

namespace viwo {

void YawDifference::add(double gyro_rad_per_s, double wheels_rad_per_s) {
  ++n_;
  gyro_ += gyro_rad_per_s;
  gyro_squares_ += gyro_rad_per_s * gyro_rad_per_s;
  wheels_ += wheels_rad_per_s;
  wheels_squares_ += wheels_rad_per_s * wheels_rad_per_s;
  products_ += gyro_rad_per_s * wheels_rad_per_s;
}

double YawDifference::variance() const {
  const double n = n_;
  return n_ < 2 ? 0. : gyro_squares_ / n - gyro_ * gyro_ / (n * n);
}

double YawDifference::part() const {
  constexpr double kMostFactor = 1.5;
  const double n = n_, all = variance();
  if (!(all > 0.)) return 1.;
  const double of_wheels = wheels_squares_ / n - wheels_ * wheels_ / (n * n);
  const double common = products_ / n - gyro_ * wheels_ / (n * n);
  const double factor =
      of_wheels > 0. ? std::clamp(common / of_wheels, 1. / kMostFactor, kMostFactor) : 1.;
  return (all - 2. * factor * common + factor * factor * of_wheels) / all;
}

std::vector<ChannelChange> changes_by_gyro(const std::shared_ptr<const WheelModel>& model,
                                           const Intrinsics& x_WI) {
  std::vector<ChannelChange> changes = {{}};
  if (model->n_rows() <= 3) changes = channel_changes(model->description());
  const auto sides = side_changes(model, x_WI);
  changes.insert(changes.end(), sides.begin(), sides.end());
  return changes;
}

std::size_t clear_change(std::span<const YawDifference> undone, const YawDifference& opposite) {
  constexpr double kLeast_rad_per_s = 0.05;
  const auto best = std::ranges::min_element(undone, {}, &YawDifference::part);
  if (best == undone.begin() || best->variance() < kLeast_rad_per_s * kLeast_rad_per_s) return 0;
  const double least = best->part();
  if (least > 0.1 || least > 0.1 * undone.front().part() || opposite.part() < 3. * least) return 0;
  for (auto other = undone.begin(); other != undone.end(); ++other) {
    if (other != best && other->part() <= 3. * least) return 0;
  }
  return static_cast<std::size_t>(best - undone.begin());
}

std::string text_of(const ChannelChange& change, const YawDifference& as_it_is,
                    const YawDifference& undone) {
  return change.text() + " (of the variance of the gyro's rate they leave " +
         significant(100. * as_it_is.part(), 3) + " %, and " +
         significant(100. * undone.part(), 2) + " % without that)";
}

}  // namespace viwo

#include "imu_check.hpp"

#include <algorithm>
#include <cmath>

#include "viwo/math/arrays.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/time_text.hpp"
#include "viwo/plausibility/imu_axes.hpp"

namespace viwo {
namespace {

constexpr double kLeast = 1e-3, kStep = 0.01;  // of LogMedian; its step is of the logarithm
constexpr double kStandardGravity = 9.80665;
constexpr std::int64_t kFewest = 500;  ///< readings before a verdict
constexpr double kShortest_s = 3.;     ///< likewise
constexpr int kManyEqual = 100;
constexpr double kFewestSteps = 127.;  ///< from zero to where the range ends
constexpr double kLongPull_s = 10.;    ///< of no braking, and no curve

const char* unit_of(std::size_t axis) { return axis < 3 ? " rad/s" : " m/s^2"; }

std::string percent(double share) { return significant(100. * share, 2) + " %"; }

}  // namespace

void LogMedian::add(double value) {
  const double place = std::log(std::max(value, kLeast) / kLeast) / kStep;
  const double last = static_cast<double>(counts_.size() - 1);
  ++counts_[static_cast<std::size_t>(std::min(place, last))];
  ++total_;
}

double LogMedian::value() const {
  std::uint64_t below = 0;
  std::size_t i = 0;
  while (i + 1 < counts_.size() && 2 * (below + counts_[i]) < total_) below += counts_[i++];
  return kLeast * std::exp(kStep * (static_cast<double>(i) + 0.5));
}

void ImuCheck::Axis::add(double value, double spike) {
  const double now = value - last;
  if (now != 0.) finest = finest == 0. ? std::abs(now) : std::min(finest, std::abs(now));
  if (spike > 0.) {
    ++spikes;
    spike_sum += spike;
  }
  last = value;
  least = std::min(least, value);
  most = std::max(most, value);
  if (std::abs(value) > largest) at_largest = 0;
  largest = std::max(largest, std::abs(value));
  if (std::abs(value) == largest) ++at_largest;
}

void ImuCheck::add(const ImuSample& sample, bool moves) {
  if (sample.fault() != nullptr || (count_ > 0 && sample.t_ns <= last_.t_ns)) return;
  const Eigen::Vector3d f = to_vector(sample.accel_m_per_s2);
  const ImuWatch::Values values = ImuWatch::values_of(sample);
  watch_.add(sample);
  if (count_ == 0) begin_ns_ = equal_from_ns_ = sample.t_ns;
  const ImuWatch::Values before = ImuWatch::values_of(last_);
  for (std::size_t i = 0; i < values.size(); ++i) {
    // Coarse numbers of a sensor at rest repeat themselves on all three axes.
    const std::size_t triad = i < 3 ? 0 : 3;
    const std::size_t j = triad + (i + 1) % 3, k = triad + (i + 2) % 3;
    channels_[i].add(values[i], sample.t_ns, values[j] != before[j] && values[k] != before[k]);
    if (count_ == 0) axes_[i].last = axes_[i].least = axes_[i].most = values[i];
    axes_[i].add(values[i], watch_.spike()[i]);
  }
  force_.add(f.norm());
  if (f.norm() > 0.) direction_sum_ += f.normalized();
  watch_stuck(sample, moves);
  last_ = sample;
  ++count_;
}

Eigen::Vector3d ImuCheck::up() const {
  if (count_ < kFewest || seconds_between(begin_ns_, last_.t_ns) < kShortest_s) {
    return Eigen::Vector3d::Zero();
  }
  return direction_sum_ / static_cast<double>(count_);
}

void ImuCheck::watch_stuck(const ImuSample& sample, bool moves) {
  const int equal = watch_.n_repeated() + 1;
  if (equal == 1) {
    moves_ = false;
    equal_from_ns_ = sample.t_ns;
    return;
  }
  moves_ = moves_ || moves;
  if (equal <= kManyEqual) ++n_equal_;
  // Coarse numbers of an IMU at rest repeat themselves.
  const bool rests = to_vector(sample.gyro_rad_per_s).norm() < 0.05 && !moves_;
  // Noise that is filtered hardly turns back, but no reading is the one before.
  const double equal_s = seconds_between(equal_from_ns_, sample.t_ns);
  const bool never_repeats = equal > kManyEqual && equal_s > 1. &&
                             count_ - equal > 10 * kManyEqual &&
                             10 * (n_equal_ - kManyEqual) < count_ - equal;
  if (rests || !(watch_.is_stuck() || never_repeats) || equal <= std::max(stuck_, 20)) return;
  if (equal_s <= 0.1) return;
  stuck_ = equal;
  stuck_from_ns_ = equal_from_ns_;
  stuck_to_ns_ = sample.t_ns;
}

void ImuCheck::findings(std::int64_t zero_ns, Findings& out) const {
  find_stuck(zero_ns, out);
  find_stuck_channels(zero_ns, out);
  if (count_ < kFewest || seconds_between(begin_ns_, last_.t_ns) < kShortest_s) return;
  find_constant(out);
  find_gravity(out);
  find_saturated(out);
  find_spikes(out);
}

void ImuCheck::find_gravity(Findings& out) const {
  const double force = force_.value();
  if (gravity_ < 1. || std::abs(force / gravity_ - 1.) <= 0.1) return;
  std::string text = name_ + ": the accelerometer reads " + significant(force, 3) +
                     " m/s^2 (median) where gravity is " + significant(gravity_, 3) + ": ";
  // What is left without gravity changes its direction.
  const bool has_gravity = up().norm() > 0.8;
  std::vector<Remedy> remedies;
  if (has_gravity && std::abs(force - 1.) < 0.1) {
    text += "it is in g (multiply by 9.80665)";
    remedies = {{unit_key_, "g"}};
  } else if (has_gravity && std::abs(force / (kStandardGravity * kStandardGravity) - 1.) < 0.1) {
    text += "it is in m/s^2, not in g";
    remedies = {{unit_key_, "m_per_s2"}};
  } else if (has_gravity && std::abs(force / 1000. - 1.) < 0.1) {
    text += "it is in mg (multiply by 0.00980665)";
  } else if (!has_gravity && force < 0.5 * kStandardGravity) {
    text += "its driver has taken gravity out (choose the raw readings)";
  } else if (seconds_between(begin_ns_, last_.t_ns) < kLongPull_s) {
    return;
  } else {
    text += "check its unit and scale, and estimator.gravity_m_per_s2";
  }
  out.push_back({name_ + " gravity", text, false, std::move(remedies)});
}

void ImuCheck::find_stuck(std::int64_t zero_ns, Findings& out) const {
  if (stuck_ == 0) return;
  out.push_back({name_ + " stuck",
                 name_ + ": the same six numbers " + std::to_string(stuck_) + " times from " +
                     time_text(stuck_from_ns_ - zero_ns) + " on: it was stuck for " +
                     significant(seconds_between(stuck_from_ns_, stuck_to_ns_), 3) + " s",
                 false,
                 {},
                 stuck_ > kManyEqual});
}

void ImuCheck::find_stuck_channels(std::int64_t zero_ns, Findings& out) const {
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const StuckChannel& channel = channels_[i];
    if (!channel.was_stuck()) continue;
    out.push_back({name_ + " stuck " + kImuAxes[i],
                   name_ + ": the " + kImuAxes[i] + " reads " + significant(channel.value(), 3) +
                       unit_of(i) + " all the time from " + time_text(channel.from_ns() - zero_ns) +
                       " on, for " +
                       significant(seconds_between(channel.from_ns(), channel.to_ns()), 3) +
                       " s, while the other axes change: it was stuck",
                   false,
                   {},
                   true});
  }
}

/// One axis that never changes while both others of its kind move. Two, of a gyro about z alone,
/// may not be there; and the vertical one feels nothing else on the flat ground of a simulator.
void ImuCheck::find_constant(Findings& out) const {
  constexpr double kTurns_rad_per_s = 0.02, kShakes_m_per_s2 = 0.1, kUpright_m_per_s2 = 5.;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const std::size_t triad = i < 3 ? 0 : 3;
    const auto is_constant = [&](std::size_t one) {
      const Axis& axis = axes_[triad + one % 3];
      return axis.least == axis.most;
    };
    const auto moves = [&](std::size_t one, std::size_t of) {
      const Axis& axis = axes_[of + one % 3];
      return axis.most - axis.least > (of == 0 ? kTurns_rad_per_s : kShakes_m_per_s2);
    };
    const bool stays_level = triad > 0 && std::abs(axes_[i].last) > kUpright_m_per_s2 &&
                             !moves(i + 1, 0) && !moves(i + 2, 0);
    if (!is_constant(i) || !moves(i + 1, triad) || !moves(i + 2, triad) || stays_level) continue;
    out.push_back({name_ + " stuck " + kImuAxes[i],
                   name_ + ": the " + kImuAxes[i] + " reads " + significant(axes_[i].last, 3) +
                       unit_of(i) +
                       " all the time, while the other axes change: it is not read (a column, a "
                       "field of the message), or broken",
                   false,
                   {},
                   true});
  }
}

/// A value that is cut off where its range ends comes again and again, to the last bit; noise
/// reaches its largest value once, unless it has next to no steps. A converter has eight bits at
/// least: what reaches fewer of its steps is coarse, and not cut off.
void ImuCheck::find_saturated(Findings& out) const {
  if (!watch_.is_noise()) return;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const Axis& axis = axes_[i];
    const double share = static_cast<double>(axis.at_largest) / static_cast<double>(count_);
    const bool is_coarse =
        axis.most - axis.least <= 20. * axis.finest || axis.largest < kFewestSteps * axis.finest;
    if (share < 0.02 || is_coarse) continue;
    out.push_back({name_ + " saturated " + kImuAxes[i],
                   name_ + ": the " + kImuAxes[i] + " is at +-" + significant(axis.largest, 3) +
                       unit_of(i) + " in " + percent(share) +
                       " of the readings: saturated - choose a larger full scale range"});
  }
}

void ImuCheck::find_spikes(Findings& out) const {
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const Axis& axis = axes_[i];
    const double share = static_cast<double>(axis.spikes) / static_cast<double>(count_);
    if (axis.spikes < 20 || share < 0.005) continue;
    const double mean = axis.spike_sum / static_cast<double>(axis.spikes);
    out.push_back({name_ + " spikes", name_ + ": the " + kImuAxes[i] + " jumps by " +
                                          significant(mean, 2) + unit_of(i) + " and back in " +
                                          percent(share) +
                                          " of the readings: a disturbed bus, or a loose cable"});
    return;
  }
}

}  // namespace viwo

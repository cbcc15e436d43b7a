#include "viwo/estimator/imu_watch.hpp"

#include <algorithm>
#include <cmath>

namespace viwo {
namespace {

/// What stands out: rad/s and m/s^2, also where there is next to no noise ...
constexpr double kLeastGyro = 1.;
constexpr double kLeastAccel = 5.;
/// ... and times the usual change. Of the real recordings at hand the largest that comes and goes
/// with one reading is 12 times it: joints of a road. Noise alone: 10 sigma and more.
constexpr double kTimesUsual = 15.;
/// Of what stands out: the steps of a coarse sensor at rest are usual.
constexpr double kLeastUsual = 0.001;
/// It stands out by this many times what its neighbours differ.
constexpr double kTimesNeighbours = 3.;
/// Readings further apart say nothing of each other.
constexpr double kLongest_s = 0.1;

double least_of(std::size_t axis) { return axis < 3 ? kLeastGyro : kLeastAccel; }

}  // namespace

ImuWatch::Values ImuWatch::values_of(const ImuSample& sample) {
  const auto& w = sample.gyro_rad_per_s;
  const auto& a = sample.accel_m_per_s2;
  return {w[0], w[1], w[2], a[0], a[1], a[2]};
}

bool ImuWatch::is_noise() const {
  return std::any_of(changes_.begin(), changes_.end(), [](const Changes& axis) {
    return axis.n >= kFewest && 3 * axis.n_turns_back > axis.n;
  });
}

bool ImuWatch::was_spike() const {
  return std::any_of(spike_.begin(), spike_.end(), [](double size) { return size > 0.; });
}

void ImuWatch::add(const ImuSample& sample) {
  const Values now = values_of(sample);
  const bool follows = count_ > 0 && seconds_between(t_ns_, sample.t_ns) <= kLongest_s;
  spike_.fill(0.);
  if (follows && is_in_doubt()) watch_spike(now);
  if (!was_spike()) {
    n_calm_ = std::min(n_calm_ + 1, kCalm);
    for (std::size_t i = 0; i < kAxes; ++i) {
      if (!is_usual(i, newest_[i] - before_[i])) n_calm_ = 0;
    }
    before_ = newest_;
  }
  departs_ = false;
  for (std::size_t i = 0; i < kAxes && follows && count_ >= kFewest; ++i) {
    const double change = now[i] - before_[i];
    departs_ = departs_ || (std::abs(change) > least_of(i) && !is_usual(i, change));
  }
  if (count_ > 0) watch_usual(now);
  n_repeated_ = count_ > 0 && now == newest_ ? std::min(n_repeated_ + 1, 1'000'000) : 0;
  newest_ = now;
  t_ns_ = sample.t_ns;
  ++count_;
}

bool ImuWatch::is_usual(std::size_t axis, double change) const {
  return std::abs(change) <= kTimesUsual * std::max(usual_[axis], kLeastUsual * least_of(axis));
}

void ImuWatch::watch_spike(const Values& now) {
  for (std::size_t i = 0; i < kAxes; ++i) {
    const double from = newest_[i] - before_[i], back = newest_[i] - now[i];
    const double neighbours = now[i] - before_[i];
    if (from * back <= 0. || !is_usual(i, neighbours)) continue;
    const double size = std::min(std::abs(from), std::abs(back));
    const double least = std::max(least_of(i), kTimesNeighbours * std::abs(neighbours));
    if (size > least && !is_usual(i, size)) spike_[i] = size;
  }
}

void ImuWatch::watch_usual(const Values& now) {
  for (std::size_t i = 0; i < kAxes; ++i) {
    const double signed_change = now[i] - newest_[i];
    const double change = std::abs(signed_change);
    // Bounded once there is something to go by, so that spikes do not become usual.
    const bool is_known = count_ >= kFewest;
    const double bound = std::max(3. * usual_[i], 0.01 * least_of(i));
    const double weight = is_known ? 0.01 : 1. / static_cast<double>(count_);
    usual_[i] += weight * ((is_known ? std::min(change, bound) : change) - usual_[i]);
    if (change == 0.) continue;
    ++changes_[i].n;
    if (signed_change * changes_[i].last < 0.) ++changes_[i].n_turns_back;
    changes_[i].last = signed_change;
  }
}

}  // namespace viwo

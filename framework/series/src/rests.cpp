#include "viwo/series/rests.hpp"

#include <algorithm>
#include <cmath>

#include "viwo/math/arrays.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo::series {
namespace {

constexpr double kShortest_s = 1.;

/// Whether all drives stand still around a time, of each wheel set: 1, 0, or -1 where none is there
/// to say it.
class StillWheels {
 public:
  explicit StillWheels(const Recording& recording) : recording_(&recording) {
    next_.resize(recording.wheels.size());
  }

  /// At times that increase.
  int at(std::int64_t t_ns) {
    int still = -1;
    for (std::size_t w = 0; w < next_.size(); ++w) {
      const Wheels& wheels = recording_->wheels[w];
      const auto clock_ns = to_ns(wheels.prior.wheels.t_OtoI_s);
      // As the start from a rest has it: what turns slower is noise of an encoder.
      constexpr double kStill_rad_per_s = 0.05;
      constexpr std::int64_t kAroundNs = 300'000'000;
      std::size_t& i = next_[w];
      while (i < wheels.samples.size() && wheels.samples[i].t_ns + clock_ns < t_ns - kAroundNs) ++i;
      for (std::size_t k = i; k < wheels.samples.size(); ++k) {
        const EncoderSample& sample = wheels.samples[k];
        if (sample.t_ns + clock_ns > t_ns + kAroundNs) break;
        still = std::abs(still);
        for (int d = 0; d < sample.n_drive; ++d) {
          const double rate = sample.drive_rad_per_s[static_cast<std::size_t>(d)];
          if (std::abs(rate) > kStill_rad_per_s) return 0;
        }
      }
    }
    return still;
  }

 private:
  const Recording* recording_;
  std::vector<std::size_t> next_;
};

/// Means over a tenth of a second, in which a vibration has no part.
struct Mean {
  std::size_t first = 0, last = 0;
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero(), accel = Eigen::Vector3d::Zero();
  bool is_whole = false;  ///< no gap in it
  int wheels_still = -1;
};

std::vector<Mean> means_of(const Recording& recording) {
  constexpr double kMean_s = 0.1, kGap_s = 0.2;
  std::vector<Mean> means;
  StillWheels wheels(recording);
  const auto& imu = recording.imu;
  for (std::size_t i = 0; i < imu.size();) {
    Mean mean;
    mean.first = i;
    mean.is_whole = true;
    for (; i < imu.size() && seconds_between(imu[mean.first].t_ns, imu[i].t_ns) < kMean_s; ++i) {
      if (i > 0 && seconds_between(imu[i - 1].t_ns, imu[i].t_ns) > kGap_s) mean.is_whole = false;
      mean.gyro += to_vector(imu[i].gyro_rad_per_s);
      mean.accel += to_vector(imu[i].accel_m_per_s2);
    }
    mean.last = i;
    const auto n = static_cast<double>(mean.last - mean.first);
    mean.gyro /= n;
    mean.accel /= n;
    mean.wheels_still = wheels.at(imu[mean.first].t_ns);
    means.push_back(mean);
  }
  return means;
}

/// What a hand or a motor does shows in means over a tenth of a second. Of gyro and accelerometer.
bool is_calm(const Mean& mean, const Mean& reference) {
  constexpr double kTurn_rad_per_s = 0.02, kForce_m_per_s2 = 0.15, kLargestBias = 0.3;
  return (mean.gyro - reference.gyro).norm() < kTurn_rad_per_s &&
         (mean.accel - reference.accel).norm() < kForce_m_per_s2 && mean.gyro.norm() < kLargestBias;
}

}  // namespace

std::vector<Rest> rests_of(const Recording& recording) {
  const std::vector<Mean> means = means_of(recording);
  std::vector<Rest> rests;
  const auto& imu = recording.imu;
  const auto keep = [&](std::size_t first, std::size_t last) {
    if (last <= first) return;
    const Rest rest{means[first].first, means[last - 1].last};
    if (seconds_between(imu[rest.first].t_ns, imu[rest.last - 1].t_ns) >= 0.95 * kShortest_s) {
      rests.push_back(rest);
    }
  };
  std::size_t first = 0;
  for (std::size_t i = 0; i <= means.size(); ++i) {
    const bool goes_on =
        i < means.size() && means[i].is_whole && means[i].wheels_still != 0 &&
        (means[i].wheels_still == 1 || first == i || is_calm(means[i], means[first]));
    if (goes_on) continue;
    keep(first, i);
    // What is no rest after this one may be the first of the next.
    first = i < means.size() && means[i].is_whole && means[i].wheels_still != 0 ? i : i + 1;
  }
  const auto length = [&](const Rest& rest) { return rest.last - rest.first; };
  std::stable_sort(rests.begin(), rests.end(),
                   [&](const Rest& a, const Rest& b) { return length(a) > length(b); });
  return rests;
}

}  // namespace viwo::series

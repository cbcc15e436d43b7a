#include "bag_sensor.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>

namespace viwo::bag {
namespace {

constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::max();

template <class Sample>
std::int64_t stamp_at(const std::vector<Sample>& samples, std::size_t next) {
  return next < samples.size() ? samples[next].t_ns : kNone;
}

template <class Sample>
bool take(std::vector<Sample>& samples, std::size_t& next, std::int64_t t_ns, Measurement& out) {
  if (stamp_at(samples, next) != t_ns) return false;
  out = std::move(samples[next++]);
  return true;
}

}  // namespace

Status BagSensor::next(Measurement& out) {
  const std::int64_t t_ns =
      std::min({stamp_at(samples_.poses, next_pose_), stamp_at(samples_.imu, next_imu_),
                stamp_at(samples_.wheels, next_wheel_), stamp_at(samples_.fixes, next_fix_),
                stamp_at(samples_.images, next_image_)});
  if (t_ns == kNone) return Status::kEnd;
  if (!take(samples_.poses, next_pose_, t_ns, out) && !take(samples_.imu, next_imu_, t_ns, out) &&
      !take(samples_.wheels, next_wheel_, t_ns, out) &&
      !take(samples_.fixes, next_fix_, t_ns, out)) {
    take(samples_.images, next_image_, t_ns, out);
  }
  return Status::kOk;
}

void BagSensor::rejections(std::vector<RejectionCount>& out) const {
  out.insert(out.end(), samples_.rejections.begin(), samples_.rejections.end());
}

}  // namespace viwo::bag

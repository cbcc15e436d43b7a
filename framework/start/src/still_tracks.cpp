#include "still_tracks.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "viwo/math/median.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo {
namespace {

constexpr std::size_t kFewestPoints = 10;
/// Noise of a point of one pixel makes 1.7 px of the median.
constexpr double kMostPx = 2.5;
/// A helicopter whose rotors start to turn sways on its legs by more than a pixel.
constexpr double kMostGrowthPx = 2.;
/// The last image may be so much older than the last reading of the IMU.
constexpr double kMaxLateS = 0.25;

/// Median distance of the points that two images share; nothing for too few of them. Points of `b`
/// are ordered by id.
std::optional<double> median_distance(const FeatureSample& a, const std::vector<FeaturePoint>& b,
                                      std::vector<double>& distances) {
  distances.clear();
  const auto before = [](const FeaturePoint& point, std::int64_t id) { return point.id < id; };
  for (const FeaturePoint& point : a.points) {
    const auto other = std::lower_bound(b.begin(), b.end(), point.id, before);
    if (other == b.end() || other->id != point.id) continue;
    const double distance = std::hypot(point.u_px - other->u_px, point.v_px - other->v_px);
    if (std::isfinite(distance)) distances.push_back(distance);
  }
  if (distances.size() < kFewestPoints) return std::nullopt;
  return upper_median(distances);
}

/// Points in the order of their ids.
std::vector<FeaturePoint> by_id(const FeatureSample& sample) {
  std::vector<FeaturePoint> points = sample.points;
  std::sort(points.begin(), points.end(),
            [](const FeaturePoint& a, const FeaturePoint& b) { return a.id < b.id; });
  return points;
}

}  // namespace

Stillness stillness_of(std::span<const FeatureSample> tracks, std::span<const double> t_CtoI_s,
                       std::int64_t begin_ns, std::int64_t end_ns) {
  const auto imu_ns = [&](const FeatureSample& sample) {
    const auto camera = static_cast<std::size_t>(sample.camera);
    return sample.t_ns + (camera < t_CtoI_s.size() ? to_ns(t_CtoI_s[camera]) : 0);
  };
  std::vector<const FeatureSample*> images;  // of the camera of the first one
  for (const FeatureSample& sample : tracks) {
    const std::int64_t t_ns = imu_ns(sample);
    if (t_ns < begin_ns || t_ns > end_ns) continue;
    if (images.empty() || sample.camera == images.front()->camera) images.push_back(&sample);
  }
  const double window_s = seconds_between(begin_ns, end_ns);
  if (images.empty() || seconds_between(imu_ns(*images.back()), end_ns) > kMaxLateS) {
    return Stillness::kUnknown;
  }
  const std::vector<FeaturePoint> last = by_id(*images.back());
  if (last.size() < kFewestPoints) return Stillness::kUnknown;
  if (seconds_between(imu_ns(*images.front()), imu_ns(*images.back())) < 0.5 * window_s) {
    return imu_ns(tracks.front()) > begin_ns ? Stillness::kTooEarly : Stillness::kUnknown;
  }
  std::vector<double> distances, neighbours;
  for (std::size_t i = 1; i < images.size(); ++i) {
    const auto moved = median_distance(*images[i - 1], by_id(*images[i]), distances);
    if (moved) neighbours.push_back(*moved);
  }
  if (neighbours.empty()) return Stillness::kUnknown;
  const double limit = std::min(kMostPx, upper_median(neighbours) + kMostGrowthPx);
  bool any_old = false;
  for (const FeatureSample* image : images) {
    const double age_s = seconds_between(imu_ns(*image), imu_ns(*images.back()));
    if (!(age_s > 0.)) continue;
    const auto moved = median_distance(*image, last, distances);
    if (!moved) continue;
    if (*moved > limit) return Stillness::kMoved;
    any_old = any_old || age_s >= 0.5 * window_s;
  }
  return any_old ? Stillness::kStill : Stillness::kUnknown;
}

}  // namespace viwo

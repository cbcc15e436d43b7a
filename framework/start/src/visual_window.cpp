#include "visual_window.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "viwo/camera/camera_model.hpp"
#include "viwo/filter/propagation.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo {
namespace {

constexpr std::size_t kMostKeys = 11;
constexpr std::size_t kFewestKeys = 6;
constexpr std::size_t kMostTracks = 100;
constexpr std::size_t kFewestTracks = 15;
constexpr std::size_t kFewestSharedKeys = 4;
constexpr double kMaxImuGapS = 0.05;
static_assert(kFewestKeys == 6);
constexpr std::string_view kTooFewImages = "fewer than 6 images within start_window_s";

std::int64_t imu_stamp(const FeatureSample& sample, std::span<const CameraPrior> cameras) {
  const auto camera = static_cast<std::size_t>(sample.camera);
  const CameraView& view = cameras[camera].camera;
  return sample.t_ns + to_ns(view.image_offset_s());
}

/// Stamps of the images of the first camera that has any, from `begin_ns` to `end_ns`, thinned out
/// to kMostKeys, the last one among them.
std::vector<std::int64_t> choose_keys(std::span<const FeatureSample> tracks, std::int64_t begin_ns,
                                      std::int64_t end_ns, std::span<const CameraPrior> cameras) {
  std::vector<std::int64_t> stamps;
  int camera = -1;
  for (const FeatureSample& sample : tracks) {
    if (static_cast<std::size_t>(sample.camera) >= cameras.size() || sample.points.empty())
      continue;
    if (camera < 0) camera = sample.camera;
    const std::int64_t t_ns = imu_stamp(sample, cameras);
    if (sample.camera == camera && t_ns >= begin_ns && t_ns <= end_ns) stamps.push_back(t_ns);
  }
  if (stamps.size() <= kMostKeys) return stamps;
  std::vector<std::int64_t> keys;
  for (std::size_t i = 0; i < kMostKeys; ++i) {
    keys.push_back(stamps[i * (stamps.size() - 1) / (kMostKeys - 1)]);
  }
  return keys;
}

/// Readings from `begin_ns` to `end_ns`, which lie within them.
std::vector<ImuSample> cut(std::span<const ImuSample> imu, std::int64_t begin_ns,
                           std::int64_t end_ns) {
  const auto at = [&](std::int64_t t_ns) {
    const auto before = [](const ImuSample& sample, std::int64_t t) { return sample.t_ns < t; };
    const auto next = std::lower_bound(imu.begin(), imu.end(), t_ns, before);
    return next->t_ns == t_ns ? *next : interpolate(*std::prev(next), *next, t_ns);
  };
  std::vector<ImuSample> samples{at(begin_ns)};
  for (const ImuSample& sample : imu) {
    if (sample.t_ns > begin_ns && sample.t_ns < end_ns) samples.push_back(sample);
  }
  samples.push_back(at(end_ns));
  return samples;
}

bool has_gap(std::span<const ImuSample> samples) {
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (seconds_between(samples[i - 1].t_ns, samples[i].t_ns) > kMaxImuGapS) return true;
  }
  return false;
}

/// The next reading of the gyro, rad/s in I, biases included.
Eigen::Vector3d rate_at(std::span<const ImuSample> imu, std::int64_t t_ns) {
  const auto next = std::lower_bound(
      imu.begin(), imu.end(), t_ns,
      [](const ImuSample& sample, std::int64_t stamp) { return sample.t_ns < stamp; });
  return to_vector(next == imu.end() ? imu.back().gyro_rad_per_s : next->gyro_rad_per_s);
}

/// Rays are turned from the rows of a rolling shutter to the middle one, by the rate `w_IinI`; how
/// it moved is not known yet.
void add_sights(const FeatureSample& sample, std::size_t key, const CameraView& camera,
                const Eigen::Vector3d& w_IinI, std::map<std::int64_t, StartTrack>& by_id) {
  const Eigen::Vector3d w_C = camera.R_ItoC * w_IinI;
  for (const FeaturePoint& point : sample.points) {
    const Eigen::Vector2d uv_px(point.u_px, point.v_px);
    if (!uv_px.allFinite()) continue;
    auto bearing = unproject(camera, uv_px);
    const double after_s = camera.after_middle_s(uv_px.y());
    if (bearing && after_s != 0.) bearing = exp_so3(after_s * w_C) * *bearing;
    if (!bearing || bearing->z() < 0.1) continue;
    StartTrack& track = by_id[point.id];
    track.id = point.id;
    track.sights.push_back(
        {key, static_cast<std::size_t>(sample.camera), uv_px, *bearing, after_s});
  }
}

std::size_t shared_keys(const StartTrack& track) {
  std::size_t n = 0;
  for (std::size_t i = 0; i < track.sights.size(); ++i) {
    if (i == 0 || track.sights[i].key != track.sights[i - 1].key) ++n;
  }
  return n;
}

}  // namespace

std::string_view find_visual_window(std::span<const ImuSample> imu,
                                    std::span<const FeatureSample> tracks, double window_s,
                                    const VisualStartOptions& options, VisualWindow& window) {
  if (imu.size() < 2 || tracks.empty()) return kTooFewImages;
  const auto& cameras = options.cameras;
  const std::int64_t end_ns = imu.back().t_ns;
  auto stamps = choose_keys(tracks, imu.front().t_ns, end_ns, cameras);
  if (stamps.empty()) return kTooFewImages;
  const std::int64_t begin_ns = stamps.back() - to_ns(window_s) - kSameInstantNs;
  // Images are a tenth of the window apart at most, or it has too few of them anyway.
  if (seconds_between(stamps.front(), stamps.back()) < 0.9 * window_s) return kTooFewImages;
  stamps = choose_keys(tracks, std::max(begin_ns, imu.front().t_ns), end_ns, cameras);
  if (stamps.size() < kFewestKeys) return kTooFewImages;

  window = {};
  for (const std::int64_t t_ns : stamps) {
    StartKey& key = window.keys.emplace_back();
    key.t_ns = t_ns;
    if (window.keys.size() == 1) continue;
    key.imu = cut(imu, window.keys[window.keys.size() - 2].t_ns, t_ns);
    if (has_gap(key.imu)) return "a hole in the IMU of more than 0.05 s";
  }
  std::map<std::int64_t, StartTrack> by_id;
  for (const FeatureSample& sample : tracks) {
    if (static_cast<std::size_t>(sample.camera) >= cameras.size()) continue;
    const std::int64_t t_ns = imu_stamp(sample, cameras);
    const auto near = [&](std::int64_t key) { return std::abs(key - t_ns) <= kSameInstantNs; };
    const auto key = std::find_if(stamps.begin(), stamps.end(), near);
    if (key == stamps.end()) continue;
    add_sights(sample, static_cast<std::size_t>(key - stamps.begin()),
               cameras[static_cast<std::size_t>(sample.camera)].camera, rate_at(imu, t_ns), by_id);
  }
  for (auto& [id, track] : by_id) {
    if (shared_keys(track) >= kFewestSharedKeys) window.tracks.push_back(std::move(track));
  }
  std::stable_sort(window.tracks.begin(), window.tracks.end(),
                   [](const auto& a, const auto& b) { return a.sights.size() > b.sights.size(); });
  if (window.tracks.size() > kMostTracks) window.tracks.resize(kMostTracks);
  if (window.tracks.size() < kFewestTracks) return "too few points are seen in most of the images";
  return {};
}

}  // namespace viwo

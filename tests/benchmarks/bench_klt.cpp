// What the tracker costs for a stereo pair of 848 x 800 with 200 points per image, images already
// decoded: the whole, and its parts. Time on the clock; the tracker uses as many threads as OpenCV.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>
#include <opencv2/core/utility.hpp>

#include "camera_tracker.hpp"
#include "frame.hpp"
#include "ray_ransac.hpp"
#include "stereo_matcher.hpp"
#include "test_scene.hpp"

namespace viwo::klt {
namespace {

constexpr double kPeriod = 0.1;  // s
constexpr std::size_t kPairs = 20;

/// Images of a drive through a room.
struct Drive {
  std::vector<CameraView> cameras = fisheye_pair(1.);
  std::vector<std::pair<Image, Image>> pairs;

  Drive() {
    const Room room;
    const Renderer left(cameras[0], room), right(cameras[1], room);
    for (std::size_t i = 0; i < kPairs; ++i) {
      const double t = kPeriod * static_cast<double>(i);
      CameraPose pose;
      pose.R_CtoW = exp_so3(Eigen::Vector3d(0.02 * std::sin(3. * t), 0.25 * std::sin(1.6 * t), 0.));
      pose.p_CinW = Eigen::Vector3d(0.5 * std::sin(t), 0.3, 0.6 * std::sin(0.7 * t));
      pairs.emplace_back(left.render(pose, 1.5, 2 * i),
                         right.render(pose_of(cameras[1], pose), 1.5, 2 * i + 1));
    }
  }
};

const Drive& drive() {
  static const Drive the_drive;
  return the_drive;
}

/// The tracker of a stereo pair, as the sensor runs it.
class Tracking {
 public:
  explicit Tracking(const TrackerOptions& options)
      : makers_{FrameMaker(options), FrameMaker(options)},
        tracker_(drive().cameras[0], options, {}, 1),
        matcher_(drive().cameras[0], drive().cameras[1], options, {}) {}

  void prepare() {
    cv::parallel_for_(cv::Range(0, 2), [&](const cv::Range& range) {
      for (int i = range.start; i < range.end; ++i) makers_[i].make(i == 0 ? left_ : right_);
    });
  }
  /// The images, decoded: not part of what is measured.
  void take(const std::pair<Image, Image>& pair) {
    left_.pixels = pair.first;
    right_.pixels = pair.second;
  }
  void follow() { tracker_.follow(before_, left_, kPeriod); }
  void refill() {
    tracker_.refill(left_);
    for (Track& track : tracker_.tracks()) {
      if (track.id < 0) track.id = next_id_++;
    }
  }
  void match() {
    right_points_.clear();
    matcher_.match(left_, right_, tracker_.tracks(), right_points_);
  }
  void end_pair() { std::swap(left_, before_); }
  void start() {
    tracker_.drop_all();
    take(drive().pairs[0]);
    prepare();
    refill();
    match();
    end_pair();
  }
  std::size_t left_points() { return tracker_.tracks().size(); }
  std::size_t right_points() const { return right_points_.size(); }

 private:
  FrameMaker makers_[2];
  CameraTracker tracker_;
  StereoMatcher matcher_;
  Frame left_, before_, right_;
  std::vector<FeaturePoint> right_points_;
  std::int64_t next_id_ = 0;
};

enum class Part { kAll, kPrepare, kFollow, kRefill, kMatch };

void stereo(benchmark::State& state, Part part, Histogram histogram) {
  TrackerOptions options;
  options.histogram_method = histogram;
  Tracking tracking(options);
  std::size_t next = kPairs, left = 0, right = 0;
  double seconds = 0.;
  const auto timed = [&](Part which, const std::function<void()>& work) {
    const std::int64_t begin = cv::getTickCount();
    work();
    if (part != Part::kAll && part != which) return;
    seconds += static_cast<double>(cv::getTickCount() - begin) / cv::getTickFrequency();
  };
  for (auto _ : state) {
    if (next == kPairs) {
      tracking.start();
      next = 1;
    }
    seconds = 0.;
    tracking.take(drive().pairs[next]);
    timed(Part::kPrepare, [&] { tracking.prepare(); });
    timed(Part::kFollow, [&] { tracking.follow(); });
    timed(Part::kRefill, [&] { tracking.refill(); });
    timed(Part::kMatch, [&] { tracking.match(); });
    tracking.end_pair();
    ++next;
    left += tracking.left_points();
    right += tracking.right_points();
    state.SetIterationTime(seconds);
  }
  const auto n = static_cast<double>(state.iterations());
  state.counters["left"] = static_cast<double>(left) / n;
  state.counters["right"] = static_cast<double>(right) / n;
}

/// 200 pairs of rays, some of them false.
void ransac(benchmark::State& state) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> gauss(0., 1.);
  const Eigen::Matrix3d R = exp_so3(Eigen::Vector3d(0.02, -0.06, 0.01));
  const Eigen::Vector3d t(0.03, -0.01, 0.05);
  std::vector<Eigen::Vector3d> before, after;
  for (std::int64_t i = 0; i < 200; ++i) {
    const Eigen::Vector3d p(gauss(random), gauss(random), 1. + std::abs(gauss(random)));
    const double sigma = (i < state.range(0) ? 10. : 0.15) / 282.;
    const Eigen::Vector3d noise(gauss(random), gauss(random), gauss(random));
    before.push_back(p.normalized());
    after.push_back(((R * p + t).normalized() + sigma * noise).normalized());
  }
  std::uint64_t seed = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(epipolar_inliers(before, after, 1. / 282., ++seed));
  }
}

void register_all() {
  const auto add = [](const char* name, Part part, Histogram histogram) {
    benchmark::RegisterBenchmark(name, stereo, part, histogram)
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
  };
  add("stereo pair 848 x 800", Part::kAll, Histogram::kNone);
  add("stereo pair 848 x 800, histogram", Part::kAll, Histogram::kEqualize);
  add("  pyramids", Part::kPrepare, Histogram::kNone);
  add("  following, with refinement and RANSAC", Part::kFollow, Histogram::kNone);
  add("  new points", Part::kRefill, Histogram::kNone);
  add("  stereo matching", Part::kMatch, Histogram::kNone);
  benchmark::RegisterBenchmark("RANSAC, 200 rays, false ones", ransac)
      ->Arg(0)
      ->Arg(60)
      ->Unit(benchmark::kMillisecond);
}

}  // namespace
}  // namespace viwo::klt

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  viwo::klt::register_all();
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

// Pictures of a run: what they show, and that they change nothing.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <numeric>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "allocations.hpp"
#include "in_folder.hpp"
#include "message_of.hpp"
#include "sensors_in_memory.hpp"
#include "simulated.hpp"
#include "viwo/results/run_output.hpp"
#include "viwo/results/run_record.hpp"
#include "viwo/view/pictures.hpp"

namespace viwo {
namespace {

using testing::error_of;
using testing::registry;

constexpr int kWidth = 64, kHeight = 48;

/// A grey image, or one that is broken.
struct Grey final : ImageSource {
  explicit Grey(int grey) : value(grey) {}
  void read(Image& out) const override {
    if (value < 0) throw InputError("broken");
    out.width_px = kWidth;
    out.height_px = kHeight;
    out.pixels.assign(static_cast<std::size_t>(kWidth * kHeight), static_cast<std::uint8_t>(value));
  }
  int value;
};

/// A camera whose clock is off by 20 ms.
std::string late_camera() {
  const auto file = std::filesystem::path(::testing::TempDir()) / "viwo_late_camera.yaml";
  std::ofstream out(file);
  out << testing::text_of(testing::configuration("cameras/pinhole.yaml"))
      << "  timeshift_cam_imu: 0.02\n";
  return file.string();
}

/// The simulated robot, which gives tracks; a sensor 'cameras' may give the images to them.
RunSetup driving(const std::string& start = "reference", int duration_s = 4) {
  const std::string robot = std::string("{type: four_wis_wid, ") + testing::kSwerve + "}";
  const std::string cameras = late_camera();
  const config::Node run = config::parse(
      "sensors: {sim: {type: simulator, motion: sweep_then_straight, features: 40, "
      "duration_s: " +
          std::to_string(duration_s) + ", cameras: " + cameras + ", robot: " + robot +
          "}}\nkinematics: " + robot + "\ncameras: {kalibr: " + cameras + "}\nestimator: {start: " +
          start + "}\nupdates: {visual_features: {}, wheel_odometry: {}}\n",
      "run.yaml");
  RunSetup setup = read_run(run, registry(), 1);
  setup.routes = testing::routes_for(setup, {{"sim", setup.sensors.front().sensor.object->yields()},
                                             {"cameras", sample_types<ImageSample>()}});
  return setup;
}

std::span<const FeatureSample> tracks_of(const RunData& data) {
  return data.recorded.of<FeatureSample>();
}

/// An image for all tracks of one, both in the clock of the camera; `grey_of` the index of the
/// image.
template <class GreyOf>
std::vector<ImageSample> pixels_of(const RunData& data, const GreyOf& grey_of) {
  std::vector<ImageSample> pixels;
  int index = 0;
  for (const FeatureSample& image : tracks_of(data)) {
    pixels.push_back({image.t_ns, image.camera, std::make_shared<Grey>(grey_of(index++))});
  }
  return pixels;
}

struct Watched {
  RunResult result;
  std::string failure;
};

Watched watch(const RunSetup& setup, const RunData& data, view::PictureSinks sinks = {}) {
  view::RunPictures pictures(setup, data, std::move(sinks));
  RunHooks hooks;
  pictures.watch(hooks);
  Watched watched;
  watched.result = run_filter(setup, data, hooks);
  watched.failure = pictures.finish(watched.result);
  return watched;
}

cv::Mat decoded(const RunPicture& picture) {
  return cv::imdecode(std::vector<uchar>(picture.png.begin(), picture.png.end()), cv::IMREAD_COLOR);
}

/// The commonest grey of an image of the first camera, which is left of the others.
int grey_of(const RunPicture& picture) {
  const cv::Mat all = decoded(picture);
  std::map<int, int> count;
  for (int y = 40; y < 300; ++y) {
    for (int x = 10; x < 200; ++x) {
      const auto pixel = all.at<cv::Vec3b>(y, x);
      if (pixel[0] == pixel[1] && pixel[1] == pixel[2]) ++count[pixel[0]];
    }
  }
  int commonest = -1, most = 10'000;
  for (const auto& [grey, n] : count) {
    if (n > most) std::tie(commonest, most) = std::pair{grey, n};
  }
  return commonest;
}

/// What a run gives but for the times that it took.
std::string results_of(const RunResult& result) {
  nlohmann::json record = to_record(result);
  for (const char* time : {"wall_s", "epoch_ms", "stages", "total_ms"}) record.erase(time);
  return record.dump();
}

TEST(Pictures, ChangeNothingInTheResults) {
  RunSetup setup = driving();
  const RunResult without = run_filter(setup, collect(setup));
  RunSetup same = driving();  // plugins count what they do
  RunData data = collect(same);
  data.recorded.set("cameras", pixels_of(data, [](int i) { return 60 + i; }));
  const auto file = std::filesystem::path(::testing::TempDir()) / "viwo_pictures.avi";
  const Watched with = watch(same, data, view::open_sinks(same, false, file));
  EXPECT_EQ(with.failure, "");
  EXPECT_TRUE(std::filesystem::exists(file));
  std::filesystem::remove(file);
  ASSERT_EQ(with.result.status, RunStatus::kOk);
  EXPECT_GT(with.result.epochs, 30);
  EXPECT_TRUE(results_of(with.result) == results_of(without));
}

/// Counts what the pictures take from the heap within the epochs of a filter.
class Counting final : public EstimatorObserver {
 public:
  explicit Counting(view::RunPictures& pictures) : pictures_(pictures) {}
  void on_epoch(const Filter& filter, const EpochData& data) override {
    const long before = testing::allocations();
    pictures_.on_epoch(filter, data);
    const long allocated = testing::allocations() - before;
    allocations_.push_back(allocated);
  }
  const std::vector<long>& allocations() const { return allocations_; }

 private:
  view::RunPictures& pictures_;
  std::vector<long> allocations_;
};

TEST(Pictures, TakeNothingFromTheHeapWithinAnEpochOfTheSteadyState) {
  if (!testing::counts_allocations()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  RunSetup setup = driving("reference", 12);
  const RunData data = collect(setup);
  view::RunPictures pictures(setup, data, {});
  Counting counting(pictures);
  RunHooks hooks;
  pictures.watch(hooks);
  hooks.on_start = [&](const Estimator&) { return &counting; };
  RunResult result = run_filter(setup, data, hooks);
  EXPECT_EQ(pictures.finish(result), "");
  EXPECT_EQ(result.pictures.size(), 3U);
  const auto& counted = counting.allocations();
  ASSERT_GT(counted.size(), 100U);
  EXPECT_GT(counted.front(), 0) << "room for points";
  EXPECT_EQ(std::accumulate(counted.begin() + 20, counted.end(), 0L), 0);
}

TEST(Pictures, AreOfTheBeginningTheMiddleAndTheEnd) {
  RunSetup setup = driving();
  const Watched run = watch(setup, collect(setup));
  ASSERT_EQ(run.result.pictures.size(), 3U);
  EXPECT_NEAR(run.result.pictures[0].t_s, 0.4, 0.11);
  EXPECT_NEAR(run.result.pictures[1].t_s, 2., 0.11);
  EXPECT_EQ(run.result.pictures[2].t_s, run.result.epoch_t_s.back());
  for (const RunPicture& picture : run.result.pictures) {
    EXPECT_EQ(decoded(picture).size(), cv::Size(1280, 720));
  }
}

TEST(Pictures, ShowTheImageThatTheTracksAreOfInTheClockOfTheCamera) {
  RunSetup setup = driving();
  RunData data = collect(setup);
  data.recorded.set("cameras", pixels_of(data, [](int i) { return 60 + i; }));
  int last = -1;  // the last image of camera 0
  for (std::size_t i = 0; i < tracks_of(data).size(); ++i) {
    if (tracks_of(data)[i].camera == 0) last = 60 + static_cast<int>(i);
  }
  const Watched run = watch(setup, data);
  ASSERT_EQ(run.result.pictures.size(), 3U);
  EXPECT_EQ(grey_of(run.result.pictures[2]), last);
  EXPECT_GT(grey_of(run.result.pictures[1]), 60);
  EXPECT_LT(grey_of(run.result.pictures[1]), last);
}

TEST(Pictures, ShowTheNearestImageWhereTheTracksHaveTheStampOfTheOtherCamera) {
  // GIVEN images 4 ms later than their tracks, and others 9 ms later; recorded, or as they arrive
  for (const bool live : {false, true}) {
    RunSetup setup = driving();
    RunData data = collect(setup);
    std::vector<ImageSample> pixels;
    int last = -1;
    for (ImageSample image : pixels_of(data, [](int i) { return 60 + i; })) {
      if (image.camera == 0) last = static_cast<const Grey&>(*image.source).value;
      image.t_ns += 4'000'000;
      pixels.push_back(image);
      pixels.push_back({image.t_ns + 5'000'000, image.camera, std::make_shared<Grey>(30)});
    }
    if (!live) data.recorded.set("cameras", pixels);
    view::RunPictures pictures(setup, data, {});
    RunHooks hooks;
    pictures.watch(hooks);
    for (const ImageSample& image : pixels) {
      if (live) hooks.on_live_image(image);
    }
    RunResult result = run_filter(setup, data, hooks);
    EXPECT_EQ(pictures.finish(result), "");
    ASSERT_EQ(result.pictures.size(), 3U);
    EXPECT_EQ(grey_of(result.pictures[2]), last) << live;
  }
}

TEST(Pictures, ShowImagesThatArriveWhileTheRunGoesOn) {
  RunSetup setup = driving();
  RunData data = collect(setup);
  const auto arriving = pixels_of(data, [](int i) { return 60 + i; });
  view::RunPictures pictures(setup, data, {});
  RunHooks hooks;
  pictures.watch(hooks);
  std::thread device([&] {
    for (const ImageSample& image : arriving) hooks.on_live_image(image);
  });
  RunResult result = run_filter(setup, data, hooks);
  device.join();
  EXPECT_EQ(pictures.finish(result), "");
  ASSERT_EQ(result.pictures.size(), 3U);
  EXPECT_GT(grey_of(result.pictures[2]), 60);
}

TEST(Pictures, HaveADarkFieldForAnImageThatIsBrokenOrMissing) {
  RunSetup setup = driving();
  RunData data = collect(setup);
  for (const bool missing : {true, false}) {
    if (!missing) data.recorded.set("cameras", pixels_of(data, [](int) { return -1; }));
    const Watched run = watch(setup, data);
    EXPECT_EQ(run.failure, "");
    EXPECT_EQ(run.result.status, RunStatus::kOk);
    ASSERT_EQ(run.result.pictures.size(), 3U);
    EXPECT_EQ(grey_of(run.result.pictures[2]), -1) << "no grey";
  }
}

TEST(Pictures, AreNotMadeOfARunWithoutImages) {
  RunSetup setup = driving();
  RunData data = collect(setup);
  data.recorded.set<FeatureSample>("sim", {});
  const Watched run = watch(setup, data);
  EXPECT_GT(run.result.epochs, 10);
  EXPECT_TRUE(run.result.pictures.empty());
  for (const auto& section : report_of(setup, run.result).sections) {
    EXPECT_NE(section.heading, "Pictures");
  }
}

TEST(Pictures, AreMadeWhereTheReferenceHasAnotherWorld) {
  RunSetup setup = driving("moving");
  const Watched run = watch(setup, collect(setup));
  EXPECT_EQ(run.failure, "");
  EXPECT_EQ(run.result.status, RunStatus::kOk) << run.result.cause;
  EXPECT_EQ(run.result.pictures.size(), 3U);
}

TEST(Pictures, StandInThePageWithWordsForThoseWhoCannotSeeThem) {
  RunSetup setup = driving();
  const Watched run = watch(setup, collect(setup));
  const report::Document page = report_of(setup, run.result);
  std::vector<report::Image> images;
  for (const auto& section : page.sections) {
    if (section.heading != "Pictures") continue;
    for (const auto& block : section.blocks) {
      if (const auto* image = std::get_if<report::Image>(&block)) images.push_back(*image);
    }
  }
  ASSERT_EQ(images.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(images[i].bytes, run.result.pictures[i].png);
    EXPECT_EQ(images[i].mime_type, "image/png");
    EXPECT_EQ(images[i].alternative,
              "Tracked points, trajectory and calibration at " + images[i].caption);
  }
}

TEST(Pictures, NeedTheFilter) {
  RunSetup setup = read_run(testing::simulated("circle"), registry(), 1);
  EXPECT_EQ(error_of([&] { view::open_sinks(setup, true, ""); }),
            "--show shows what the filter does, but this run has none (a section 'updates')");
  EXPECT_EQ(error_of([&] { view::open_sinks(setup, false, "a.mp4"); }),
            "--video shows what the filter does, but this run has none (a section 'updates')");
  const view::PictureSinks none = view::open_sinks(setup, false, "");
  EXPECT_EQ(none.window, nullptr);
  EXPECT_EQ(none.video, nullptr);
}

}  // namespace
}  // namespace viwo

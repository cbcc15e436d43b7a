// Sensor video, on videos that OpenCV writes here.
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>

#include "support.hpp"
#include "video_frames.hpp"

namespace viwo {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr int kFrames = 12;
/// Frames differ by three times as much; compression costs a little.
constexpr double kClose = 5.;

class VideoSensor : public SensorsInFolder {
 protected:
  void SetUp() override {
    for (const int camera : {0, 1}) {
      // Each frame by itself, and each from those before it.
      const int codec = camera == 0 ? cv::VideoWriter::fourcc('M', 'J', 'P', 'G')
                                    : cv::VideoWriter::fourcc('m', 'p', '4', 'v');
      cv::VideoWriter out((folder_ / name(camera)).string(), codec, 20., {64, 48});
      if (!out.isOpened()) GTEST_SKIP() << "OpenCV cannot write a video here";
      for (int i = 0; i < kFrames; ++i) {
        out.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(grey(i, camera))));
      }
    }
    std::string table = "frame,timestamp_ns\n";
    for (int i = 0; i < kFrames; ++i) {
      table += std::to_string(i) + "," + std::to_string(stamp_ns(i)) + "\n";
    }
    write("stamps.csv", table);
  }

  static std::string name(int camera) { return camera == 0 ? "cam0.avi" : "cam1.mp4"; }
  static int grey(int i, int camera) { return 20 + 15 * i + 5 * camera; }
  static std::int64_t stamp_ns(int i) { return 1'000'000'000 + std::int64_t{50'000'000} * i; }
  std::string config(const std::string& rest) const {
    return "{type: video, path: " + folder_.string() + rest + "}";
  }
  /// Of all pixels, which are alike.
  static double grey_of(const ImageSample& sample) {
    Image image;
    sample.source->read(image);
    EXPECT_EQ(image.width_px, 64);
    EXPECT_EQ(image.height_px, 48);
    double sum = 0.;
    for (const std::uint8_t pixel : image.pixels) sum += pixel;
    return sum / static_cast<double>(image.pixels.size());
  }
};

TEST_F(VideoSensor, GivesTheFramesOfItsCamerasWithTheStampsOfTheirTables) {
  const auto images = play_only<ImageSample>(
      config(", videos: [cam1.mp4, cam0.avi], stamps: [stamps.csv, stamps.csv]"));
  ASSERT_EQ(images.size(), 2U * kFrames);
  for (int k = 0; k < 2 * kFrames; ++k) {
    const ImageSample& image = images[static_cast<std::size_t>(k)];
    EXPECT_EQ(image.t_ns, stamp_ns(k / 2));
    EXPECT_EQ(image.camera, k % 2);
    EXPECT_NEAR(grey_of(image), grey(k / 2, 1 - k % 2), kClose) << k;  // swapped
  }
}

TEST_F(VideoSensor, GivesTheSamePixelsInAnyOrder) {
  for (const int camera : {0, 1}) {
    const auto images =
        play_only<ImageSample>(config(", videos: [" + name(camera) + "], stamps: [stamps.csv]"));
    ASSERT_EQ(images.size(), static_cast<std::size_t>(kFrames));
    for (const std::size_t i : {7U, 3U, 3U, 11U, 0U, 8U}) {
      EXPECT_NEAR(grey_of(images[i]), grey(static_cast<int>(i), camera), kClose) << i;
    }
  }
}

TEST_F(VideoSensor, TakesTheTimesOfTheContainerWithoutATable) {
  for (const int camera : {0, 1}) {
    const auto images =
        play_only<ImageSample>(config(", videos: [" + name(camera) + "], start_ns: 7000000000"));
    ASSERT_EQ(images.size(), static_cast<std::size_t>(kFrames));
    for (int i = 0; i < kFrames; ++i) {
      const ImageSample& image = images[static_cast<std::size_t>(i)];
      EXPECT_NEAR(1e-9 * static_cast<double>(image.t_ns), 7. + 0.05 * i, 1e-4);
      EXPECT_NEAR(grey_of(image), grey(i, camera), kClose);
    }
  }
}

TEST_F(VideoSensor, ARowThatCannotBeReadKeepsItsFrameOut) {
  std::string table = "t\n";
  for (int i = 0; i < kFrames; ++i) {
    table += i == 4 ? "x\n" : std::to_string(stamp_ns(i) / 1000) + "\n";
  }
  write("us.csv", table);
  const auto sensor =
      make_sensor(config(", videos: [cam0.avi], stamps: [us.csv], time_column: t, time_unit: us"));
  const auto images = only<ImageSample>(play(*sensor));
  ASSERT_EQ(images.size(), static_cast<std::size_t>(kFrames) - 1);
  EXPECT_NEAR(grey_of(images[4]), grey(5, 0), kClose);
  EXPECT_THAT(rejections_of(*sensor), ElementsAre(HasSubstr("row that cannot be read | 1")));
}

TEST_F(VideoSensor, AFrameThatIsNotThereIsAnErrorWhenItIsNeeded) {
  write(
      "more.csv", "timestamp_ns\n" + [] {
        std::string rows;
        for (int i = 0; i < kFrames + 2; ++i) rows += std::to_string(stamp_ns(i)) + "\n";
        return rows;
      }());
  const auto images = play_only<ImageSample>(config(", videos: [cam0.avi], stamps: [more.csv]"));
  ASSERT_EQ(images.size(), static_cast<std::size_t>(kFrames) + 2);
  Image image;
  EXPECT_THAT(testing::error_of([&] { images.back().source->read(image); }),
              HasSubstr("cam0.avi: there is no frame 13 that can be decoded"));
  EXPECT_NEAR(grey_of(images[2]), grey(2, 0), kClose);  // and goes on
}

TEST(VideoFrames, TheTimeOfAFrameIsANumberOfThisCentury) {
  using Limits = std::numeric_limits<double>;
  EXPECT_EQ(video::frame_time_ns(12.5, "a.mp4", 3), 12'500'000);
  for (const double t_ms : {Limits::quiet_NaN(), Limits::infinity(), -Limits::max(), 1e13}) {
    EXPECT_EQ(testing::error_of([&] { video::frame_time_ns(t_ms, "a.mp4", 3); }),
              "a.mp4  frame 3 has a time of another century, or none");
  }
}

TEST_F(VideoSensor, SaysWhatIsWrong) {
  write("no.avi", "text");
  EXPECT_THAT(error_of(config(", videos: [no.avi], stamps: [stamps.csv]")),
              HasSubstr("no.avi  is no video that can be decoded"));
  EXPECT_THAT(error_of(config(", videos: [none.avi], stamps: [stamps.csv]")),
              HasSubstr("none.avi  cannot be read: No such file"));
  EXPECT_THAT(error_of(config(", videos: []")), HasSubstr("at least one video is needed"));
  EXPECT_THAT(error_of(config(", videos: [cam0.avi], start_ns: 9223372036854775807")),
              HasSubstr("start_ns"));
  EXPECT_THAT(error_of(config(", videos: [cam0.avi, cam1.mp4], stamps: [stamps.csv]")),
              HasSubstr("stamps: needs as many names as videos, 2, or none"));
  EXPECT_THAT(error_of(config(", videos: [cam0.avi], stamps: [stamps.csv], time_column: t")),
              HasSubstr("no column 't'"));
  // Cut anywhere, it is refused or ends early; nothing else.
  std::ifstream in(folder_ / "cam0.avi", std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  for (std::size_t size = 0; size < bytes.size(); size += bytes.size() / 20) {
    write("cut.avi", bytes.substr(0, size));
    const std::string why = testing::error_of([&] {
      const auto images = play_only<ImageSample>(config(", videos: [cut.avi], start_ns: 1"));
      EXPECT_LE(images.size(), static_cast<std::size_t>(kFrames));
    });
    EXPECT_TRUE(why.empty() || why.find("cut.avi  ") != std::string::npos) << why;
  }
}

}  // namespace
}  // namespace viwo

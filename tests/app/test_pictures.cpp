// viwo run --show and --video.
#include <csignal>
#include <cstdlib>
#include <filesystem>

#include <opencv2/videoio.hpp>
#include <sys/resource.h>

#include "support.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

class PicturesTest : public CommandLineTest {
 protected:
  void SetUp() override {
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
  }
  /// Three seconds of the robot with the stereo pair.
  static std::vector<std::string> run(std::vector<std::string> more) {
    std::vector<std::string> words{"run", VIWO_TEST_SOURCE_DIR "/configs/runs/viwo_swerve.yaml",
                                   "--set", "sensors.simulator0.duration_s=3"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
};

TEST_F(PicturesTest, AreAVideoWithAPictureForEachEpoch) {
  expect_done(run({"--out", "plain"}));
  for (const std::string file : {"run.mp4", "videos/run.avi"}) {
    expect_done(run({"--out", "out", "--video", file}));
    cv::VideoCapture video(at(file).string());
    ASSERT_TRUE(video.isOpened()) << file;
    EXPECT_EQ(video.get(cv::CAP_PROP_FPS), 10.);
    cv::Mat picture;
    int n = 0;
    while (video.read(picture)) {
      EXPECT_EQ(picture.size(), cv::Size(1280, 720));
      ++n;
    }
    EXPECT_EQ(n, summary().at("epochs")) << file;
    EXPECT_GE(n, 29);
    for (const char* result : {"trajectory.tum", "calibration.csv", "config.resolved.yaml"}) {
      EXPECT_EQ(read(std::string("out/") + result), read(std::string("plain/") + result));
    }
  }
}

TEST_F(PicturesTest, AreInThePageOfEveryRunOfTheFilter) {
  expect_done(run({"--out", "out"}));
  const std::string page = read("out/report.html");
  int n = 0;
  for (std::size_t i = 0;
       (i = page.find("src=\"data:image/png;base64,iVBORw0KGgo", i)) != std::string::npos; ++i) {
    ++n;
  }
  EXPECT_EQ(n, 3);
}

TEST_F(PicturesTest, AreRefusedBeforeTheRunWhereTheyCannotBe) {
  expect_refused(run({"--out", "out", "--video", "run.mkv"}),
                 "video run.mkv: the name of a video ends in .mp4 or .avi");
  expect_refused(run({"--out", "out", "--video", ""}),
                 "viwo run: --video needs the name of a file (see viwo run --help)");
  expect_refused(run({"--out", "out", "--video", "/proc/run.mp4"}),
                 "video /proc/run.mp4: cannot be written (is the folder writable, and does this "
                 "OpenCV write .mp4?)");
  expect_refused(run({"--out", "out", "--show"}),
                 "no screen to show pictures on: neither DISPLAY nor WAYLAND_DISPLAY is set; a "
                 "video file needs no screen");
  write("recording.mp4", "of a camera");
  expect_refused(run({"--out", "out", "--video", "recording.mp4"}),
                 "video recording.mp4: is there already and was not written by --video (of this "
                 "version): choose another name, or remove it");
  EXPECT_EQ(read("recording.mp4"), "of a camera");
  write("run.yaml", kRun);
  expect_refused({"run", "run.yaml", "--out", "out", "--show"},
                 "--show shows what the filter does, but this run has none (a section 'updates')");
  expect_refused({"run", "run.yaml", "--out", "out", "--video", "a.mp4"},
                 "--video shows what the filter does, but this run has none (a section "
                 "'updates')");
  EXPECT_FALSE(fs::exists(at("a.mp4")));
}

TEST_F(PicturesTest, OfAFullDiskAreAnErrorAfterTheResultsAreWritten) {
  // A limit of the size of files, which all results are below, but not the video.
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit limit{5'000'000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &limit);
  const Outcome outcome =
      viwo({"run", VIWO_TEST_SOURCE_DIR "/configs/runs/viwo_swerve.yaml", "--set",
            "sensors.simulator0.duration_s=12", "--out", "out", "--video", "run.avi"});
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.err.find("video run.avi: it cannot be read back whole, or not all of it was "
                             "written (120 pictures; is the disk full?)\n"),
            std::string::npos)
      << outcome.err;
  EXPECT_EQ(summary().at("status"), "ok");
  EXPECT_TRUE(fs::exists(at("out/report.html")));
  for (const fs::directory_entry& entry : fs::directory_iterator(at("."))) {
    EXPECT_NE(entry.path().extension(), ".avi") << entry;
  }
}

}  // namespace
}  // namespace viwo

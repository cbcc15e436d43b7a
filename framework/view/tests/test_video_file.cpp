// Videos, read again with OpenCV.
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "in_folder.hpp"
#include "message_of.hpp"
#include "show/video_file.hpp"
#include "viwo/api/status.hpp"
#include "viwo/files/files.hpp"

namespace viwo::view {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 320, kHeight = 240;

class VideoFileTest : public testing::InFolder {
 protected:
  fs::path at(const std::string& name) const { return folder_ / name; }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::recursive_directory_iterator(folder_),
                                                  fs::recursive_directory_iterator()));
  }
  /// What an InputError of the constructor says, with the folder as TMP.
  std::string refusal_of(const fs::path& file) const {
    std::string text = testing::error_of([&] { const VideoFile video(file); });
    const auto begin = text.find(folder_.string());
    if (begin != std::string::npos) text.replace(begin, folder_.string().size(), "TMP");
    return text;
  }
};

Picture grey(int value) {
  return {kWidth, kHeight,
          std::vector<std::uint8_t>(3U * kWidth * kHeight, static_cast<std::uint8_t>(value))};
}

/// Mean of a picture's pixels is 40 + 4 k for the k-th.
void write_video(const fs::path& file, int pictures, double period_s) {
  VideoFile video(file);
  for (int k = 0; k < pictures; ++k) video.add(grey(40 + 4 * k), 100. + period_s * k);
  video.close();
}

struct ReadVideo {
  cv::Size size;
  double rate_hz = 0.;
  std::vector<double> means;
};

ReadVideo read(const fs::path& file) {
  cv::VideoCapture capture(file.string());
  ReadVideo video;
  video.size = {static_cast<int>(capture.get(cv::CAP_PROP_FRAME_WIDTH)),
                static_cast<int>(capture.get(cv::CAP_PROP_FRAME_HEIGHT))};
  video.rate_hz = capture.get(cv::CAP_PROP_FPS);
  cv::Mat picture;
  while (capture.read(picture)) video.means.push_back(cv::mean(picture)[0]);
  return video;
}

TEST_F(VideoFileTest, HasEveryPictureAtTheRateOfTheRun) {
  for (const char* name : {"a.mp4", "a.avi"}) {
    for (const auto& [period_s, rate_hz] : {std::pair{0.1, 10.}, {1. / 29.97, 30.}, {0.4, 2.5}}) {
      write_video(at(name), 30, period_s);
      const ReadVideo video = read(at(name));
      EXPECT_EQ(video.size, cv::Size(kWidth, kHeight)) << name;
      EXPECT_NEAR(video.rate_hz, rate_hz, 0.01) << name;
      ASSERT_EQ(video.means.size(), 30U) << name;
      for (int k = 0; k < 30; ++k) {
        // The codec follows slow changes a little late.
        const auto i = static_cast<std::size_t>(k);
        EXPECT_NEAR(video.means[i], 40 + 4 * k, 8.) << name << " " << k;
        EXPECT_GT(video.means[i], i > 0 ? video.means[i - 1] : 0.) << name << " " << k;
      }
    }
  }
  EXPECT_EQ(files(), 2U) << "nothing else is left";
}

TEST_F(VideoFileTest, LeavesOtherFilesWhateverTheyAreCalled) {
  const fs::path mine = folder_ / "mine";
  const fs::path part = folder_ / ("a" + files::this_process() + ".mp4");
  std::ofstream(mine) << "of somebody";
  fs::create_symlink(mine, part);
  std::ofstream(folder_ / "a.part.mp4") << "of somebody";
  write_video(folder_ / "a.mp4", 3, 0.1);
  EXPECT_EQ(fs::file_size(mine), 11U) << "a link of the name that is written to";
  EXPECT_EQ(fs::file_size(folder_ / "a.part.mp4"), 11U);
  EXPECT_EQ(files(), 3U);
  ASSERT_EQ(::mkfifo(part.c_str(), 0600), 0);
  write_video(folder_ / "a.mp4", 3, 0.1);
  EXPECT_EQ(read(folder_ / "a.mp4").means.size(), 3U);
}

TEST_F(VideoFileTest, MayBeShorterThanTheRateNeeds) {
  for (const int pictures : {1, 2, 10, 11, 12}) {
    write_video(at("short.mp4"), pictures, 0.05);
    const ReadVideo video = read(at("short.mp4"));
    EXPECT_EQ(video.means.size(), static_cast<std::size_t>(pictures));
    EXPECT_NEAR(video.rate_hz, pictures == 1 ? 10. : 20., 0.01);
  }
}

TEST_F(VideoFileTest, TakesTimesThatStandStill) {
  write_video(at("still.mp4"), 15, 0.);
  EXPECT_EQ(read(at("still.mp4")).means.size(), 15U);
}

TEST_F(VideoFileTest, IsNotThereWithoutPictures) {
  VideoFile video(at("none.mp4"));
  EXPECT_EQ(files(), 0U);
  video.close();
  EXPECT_EQ(files(), 0U);
}

TEST_F(VideoFileTest, LeavesAnOlderOneAloneUntilItIsWhole) {
  write_video(at("run.mp4"), 5, 0.1);
  {
    VideoFile video(at("run.mp4"));
    for (int k = 0; k < 20; ++k) video.add(grey(k), 0.1 * k);
    EXPECT_EQ(read(at("run.mp4")).means.size(), 5U);
  }
  EXPECT_EQ(read(at("run.mp4")).means.size(), 5U);
  EXPECT_EQ(files(), 1U);
  write_video(at("run.mp4"), 7, 0.1);
  EXPECT_EQ(read(at("run.mp4")).means.size(), 7U);
}

TEST_F(VideoFileTest, MakesItsFolder) {
  write_video(at("new/folder/a.avi"), 3, 0.1);
  EXPECT_EQ(read(at("new/folder/a.avi")).means.size(), 3U);
}

TEST_F(VideoFileTest, MayBeInTheFolderOfTheProcess) {
  const fs::path before = fs::current_path();
  fs::current_path(folder_);
  write_video("here.mp4", 3, 0.1);
  fs::current_path(before);
  EXPECT_EQ(read(at("here.mp4")).means.size(), 3U);
}

TEST_F(VideoFileTest, RefusesWhatCannotBeOne) {
  for (const char* name : {"a.mkv", "a", "mp4", "a.MP4"}) {
    EXPECT_EQ(refusal_of(at(name)),
              "video TMP/" + std::string(name) + ": the name of a video ends in .mp4 or .avi");
  }
  fs::create_directory(at("folder.mp4"));
  EXPECT_EQ(refusal_of(at("folder.mp4")), "video TMP/folder.mp4: this is a folder");
  std::ofstream(at("file")) << "text";
  EXPECT_EQ(refusal_of(at("file/a.mp4")),
            "video TMP/file/a.mp4: cannot create the folder: Not a directory");
  EXPECT_EQ(refusal_of("/proc/a.mp4"),
            "video /proc/a.mp4: cannot be written (is the folder writable, and does this OpenCV "
            "write .mp4?)");
}

TEST_F(VideoFileTest, ReplacesNothingButVideosOfARun) {
  const std::string why =
      ": is there already and was not written by --video (of this version): choose another name, "
      "or remove it";
  for (const std::string name : {"a.mp4", "a.avi"}) {
    cv::VideoWriter other(at(name).string(),
                          name == "a.avi" ? cv::VideoWriter::fourcc('M', 'J', 'P', 'G')
                                          : cv::VideoWriter::fourcc('m', 'p', '4', 'v'),
                          10., {kWidth, kHeight});
    other.write(cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar::all(40)));
    other.release();
    EXPECT_EQ(refusal_of(at(name)), "video TMP/" + name + why);
    EXPECT_EQ(read(at(name)).means.size(), 1U);
    std::ofstream(at(name), std::ios::trunc);  // holds nothing
    for (const int pictures : {3, 5}) {
      write_video(at(name), pictures, 0.1);
      EXPECT_EQ(read(at(name)).means.size(), static_cast<std::size_t>(pictures));
    }
  }
  ASSERT_EQ(::mkfifo(at("pipe.mp4").c_str(), 0600), 0);
  EXPECT_EQ(refusal_of(at("pipe.mp4")), "video TMP/pipe.mp4" + why);
}

TEST_F(VideoFileTest, RefusesAPictureOfAnotherSize) {
  VideoFile video(at("a.mp4"));
  video.add(grey(1), 0.);
  EXPECT_THROW(video.add({2, 2, std::vector<std::uint8_t>(12)}, 0.1), std::invalid_argument);
}

/// Files of this process cannot become larger, as if the disk were full.
class SmallFiles {
 public:
  explicit SmallFiles(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~SmallFiles() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  SmallFiles(const SmallFiles&) = delete;
  SmallFiles& operator=(const SmallFiles&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

TEST_F(VideoFileTest, SaysSoWhenTheDiskIsFullAndLeavesNoHalfOne) {
  std::mt19937_64 random(1);
  Picture noise = grey(0);
  for (const char* name : {"full.mp4", "full.avi"}) {
    std::string message;
    {
      const SmallFiles small(300'000);
      VideoFile video(at(name));
      for (int k = 0; k < 60; ++k) {
        for (std::uint8_t& pixel : noise.bgr) pixel = static_cast<std::uint8_t>(random());
        video.add(noise, 0.1 * k);
      }
      message = testing::error_of<std::runtime_error>([&] { video.close(); });
    }
    EXPECT_EQ(message, "video " + at(name).string() +
                           ": it cannot be read back whole, or not all of it was written (60 "
                           "pictures; is the disk full?)");
    EXPECT_EQ(files(), 0U) << name;
  }
}

}  // namespace
}  // namespace viwo::view

// Runs on images as a user meets them: through a log to the same bits, and with what goes wrong.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

const std::string kRuns = VIWO_TEST_SOURCE_DIR "/configs/runs/";

/// The fisheye pair of configs/cameras with half the pixels, for speed.
constexpr const char* kCameras = R"(
cam0: &left
  camera_model: pinhole
  intrinsics: [141.0, 140.5, 207.75, 198.75]
  distortion_model: equidistant
  distortion_coeffs: [-0.003, 0.054, -0.052, 0.011]
  resolution: [424, 400]
  T_cam_imu:
    - [0.0, -1.0, 0.0, 0.0315]
    - [-0.0998334166468282, 0.0, -0.9950041652780258, 0.0]
    - [0.9950041652780258, 0.0, -0.0998334166468282, -0.02]
    - [0.0, 0.0, 0.0, 1.0]
cam1:
  camera_model: pinhole
  intrinsics: [141.0, 140.5, 207.75, 198.75]
  distortion_model: equidistant
  distortion_coeffs: [-0.003, 0.054, -0.052, 0.011]
  resolution: [424, 400]
  T_cam_imu:
    - [0.0, -1.0, 0.0, -0.0315]
    - [-0.0998334166468282, 0.0, -0.9950041652780258, 0.0]
    - [0.9950041652780258, 0.0, -0.0998334166468282, -0.02]
    - [0.0, 0.0, 0.0, 1.0]
)";

class ImagesTest : public CommandLineTest {
 protected:
  void SetUp() override { write("cameras.yaml", kCameras); }

  /// Words of a run on simulated images of `seconds`.
  std::vector<std::string> simulated(const std::string& command, const std::string& seconds,
                                     const std::string& out) const {
    const std::string cameras = at("cameras.yaml").string();
    return {command, kRuns + "viwo_images.yaml",
            "--out", out,
            "--set", "sensors.simulator0.duration_s=" + seconds,
            "--set", "sensors.images0.cameras=" + cameras,
            "--set", "sensors.tracks0.cameras=" + cameras,
            "--set", "cameras.kalibr=" + cameras};
  }

  std::vector<std::string> from_log(const std::string& log, const std::string& out) const {
    const std::string cameras = at("cameras.yaml").string();
    return {"run",   kRuns + "viwo_images_log.yaml",
            "--out", out,
            "--set", "placeholders.log=" + at(log).string(),
            "--set", "sensors.tracks0.cameras=" + cameras,
            "--set", "cameras.kalibr=" + cameras};
  }

  /// A copy of the log to break.
  fs::path broken(const std::string& name) const {
    fs::copy(at("log"), at(name), fs::copy_options::recursive);
    return at(name);
  }

  /// The n-th image of a camera's folder.
  static fs::path image(const fs::path& camera, std::size_t n) {
    std::vector<fs::path> files;
    for (const auto& file : fs::directory_iterator(camera / "data")) files.push_back(file.path());
    // Their names are numbers: stamps.
    std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
      return std::stoll(a.stem()) < std::stoll(b.stem());
    });
    return files.at(n);
  }

  /// Leaves out the images of a camera from the n-th to the one before `end`.
  static void drop_images(const fs::path& camera, std::size_t n, std::size_t end) {
    std::ifstream in(camera / "data.csv");
    std::stringstream kept;
    std::string line;
    for (std::size_t row = 0; std::getline(in, line); ++row) {
      if (row < n + 1 || row >= end + 1) kept << line << "\n";  // behind the header
    }
    in.close();
    std::ofstream(camera / "data.csv") << kept.str();
  }

  /// What was dropped of a sensor, as "count x reason".
  std::string dropped(const std::string& folder, const std::string& sensor) const {
    std::string all;
    const auto rejected = summary(folder).at("rejected_measurements");
    if (!rejected.contains(sensor)) return all;
    for (const auto& entry : rejected.at(sensor)) {
      all += entry.at("count").dump() + " x " + entry.at("reason").get<std::string>() + ", first " +
             entry.at("first").get<std::string>() + "\n";
    }
    return all;
  }
};

TEST_F(ImagesTest, GiveTheSameTrajectoryFromALogToTheBit) {
  expect_done(simulated("run", "3", "direct"));
  const std::string said = expect_done(simulated("simulate", "3", "log")).out;
  EXPECT_NE(said.find("60 images"), std::string::npos) << said;
  expect_done(from_log("log", "from_log"));
  EXPECT_EQ(read("direct/trajectory.tum"), read("from_log/trajectory.tum"));
  EXPECT_EQ(read("direct/calibration.csv"), read("from_log/calibration.csv"));
  EXPECT_TRUE(summary("direct").at("timing_ms").contains("sensor tracks0"));
}

TEST_F(ImagesTest, ThatAreBrokenOrMissingAreCountedAndTheRunGoesOn) {
  expect_done(simulated("simulate", "4", "log"));
  expect_done(from_log("log", "whole"));
  const double ate_m = summary("whole").at("accuracy").at("ate_m");
  EXPECT_LT(ate_m, 0.01);
  {
    const fs::path cut = image(broken("cut") / "cam0", 20);
    fs::resize_file(cut, fs::file_size(cut) / 2);
    expect_done(from_log("cut", "cut_out"));
    const std::string text = dropped("cut_out", "tracks0");
    EXPECT_NE(text.find("1 x "), std::string::npos) << text;
    EXPECT_NE(text.find(cut.filename().string() + ": the image is cut short"), std::string::npos)
        << text;
    EXPECT_LT(summary("cut_out").at("accuracy").at("ate_m"), 2. * ate_m + 0.002);
  }
  {
    const fs::path large = image(broken("large") / "cam0", 20);
    std::fstream(large, std::ios::binary | std::ios::in | std::ios::out)
        .seekp(16)
        .write("\0\0\xea\x60\0\0\xea\x60", 8);
    const Outcome outcome = expect_done(from_log("large", "large_out"));
    const std::string text = dropped("large_out", "tracks0");
    EXPECT_NE(text.find("an image of 60000 x 60000 pixels"), std::string::npos) << text;
    EXPECT_LT(outcome.peak_mb, 512);
  }
  {
    const fs::path missing = image(broken("missing") / "cam1", 10);
    fs::remove(missing);
    expect_done(from_log("missing", "missing_out"));
    const std::string text = dropped("missing_out", "images0") + dropped("missing_out", "tracks0");
    EXPECT_NE(text.find(missing.filename().string()), std::string::npos) << text;
    EXPECT_LT(summary("missing_out").at("accuracy").at("ate_m"), 2. * ate_m + 0.002);
  }
  {
    const fs::path log = broken("gap");  // nothing from 1 s to 3 s
    for (const char* camera : {"cam0", "cam1"}) drop_images(log / camera, 10, 30);
    expect_done(from_log("gap", "gap_out"));
    EXPECT_LT(summary("gap_out").at("accuracy").at("ate_m"), 2. * ate_m + 0.005);
  }
}

TEST_F(ImagesTest, OfAnotherCameraAreRefused) {
  expect_done(simulated("simulate", "2", "log"));
  {
    auto words = from_log("log", "out");
    for (std::string& word : words) {
      if (word.starts_with("sensors.tracks0.cameras=")) {
        word = "sensors.tracks0.cameras=" VIWO_TEST_SOURCE_DIR "/configs/cameras/t265_like.yaml";
      }
    }
    const Outcome outcome = viwo(words);
    EXPECT_EQ(outcome.code, 2) << outcome.out;
    EXPECT_NE(outcome.err.find("424 x 400"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("848 x 800"), std::string::npos) << outcome.err;
  }
  {
    // One of another size in the middle is left out and counted.
    const fs::path log = broken("size");
    fs::copy_file(VIWO_TEST_SOURCE_DIR "/tests/app/data/tiny.png", image(log / "cam0", 12),
                  fs::copy_options::overwrite_existing);
    const Outcome outcome = viwo(from_log("size", "size_out"));
    EXPECT_EQ(outcome.code, 0) << outcome.out << outcome.err;
    EXPECT_NE(outcome.out.find("tracks0: 1 x image of another size than the camera's"),
              std::string::npos)
        << outcome.out;
    EXPECT_GT(summary("size_out").at("epochs").get<int>(), 15);
  }
}

TEST_F(ImagesTest, OfSwappedCamerasAreNoticed) {
  expect_done(simulated("simulate", "4", "log"));
  const fs::path log = broken("swapped");
  fs::rename(log / "cam0", log / "other");
  fs::rename(log / "cam1", log / "cam0");
  fs::rename(log / "other", log / "cam1");
  const Outcome outcome = viwo(from_log("swapped", "out"));
  EXPECT_NE(outcome.err.find("swapped"), std::string::npos) << outcome.err << outcome.out;
}

TEST_F(ImagesTest, CanBeDarkForFiveSecondsWhileWheelsAndImuGoOn) {
  auto words = simulated("run", "12", "out");
  words.insert(words.end(), {"--set", "sensors.images0.dark_start_s=[4]", "--set",
                             "sensors.images0.dark_duration_s=5"});
  expect_done(words);
  const auto accuracy = summary("out").at("accuracy");
  EXPECT_LT(accuracy.at("ate_m"), 0.02);
  // Of one run.
  EXPECT_LT(accuracy.at("nees_pose"), 16.);
}

}  // namespace
}  // namespace viwo

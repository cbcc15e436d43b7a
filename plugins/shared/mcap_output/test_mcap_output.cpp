// What `viwo run --mcap` writes, read back by the reader of bags.
#include <csignal>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "in_folder.hpp"
#include "mcap_output.hpp"
#include "message_of.hpp"
#include "ros2_file.hpp"

namespace viwo::live {
namespace {

constexpr std::int64_t kStart = 1'700'000'000'000'000'000, kStep = 100'000'000;

class McapOutputTest : public testing::InFolder {
 protected:
  static void write(McapOutput& out, int epochs) {
    EstimateSample estimate;
    estimate.calibration_names = {"r_1", "cam0.fx"};
    estimate.calibration = {0.05, 400.};
    estimate.calibration_sigma = {1e-4, 0.5};
    for (int k = 0; k < epochs; ++k) {
      estimate.t_ns = kStart + k * kStep;
      estimate.p_IinG_m = {0.1 * k, 1., 2.};
      const log::SeenImage image{1, estimate.t_ns, {{10., 20., 0.}, {30., 40., 1.}}};
      out.write(estimate, {&image, 1});
    }
  }

  std::map<std::string, int> counts() const {
    const auto bag = bag::open_ros2(file_);
    std::vector<bag::Wanted> wanted;
    for (const bag::Topic& topic : bag->topics()) wanted.push_back({topic.name, false});
    std::map<std::string, int> counts;
    std::int64_t last_ns = 0;
    Rejections damage;
    bag->read(
        wanted, 0, std::numeric_limits<std::int64_t>::max(),
        [&](const bag::Message& message) {
          EXPECT_GE(message.received_ns, last_ns);
          last_ns = message.received_ns;
          ++counts[wanted[message.topic].name];
        },
        damage);
    return counts;
  }

  const std::filesystem::path file_ = folder_ / "run.mcap";
};

TEST_F(McapOutputTest, HasEachEpochThePathEachFiveSecondsAndTheLastState) {
  McapOutput out(file_);
  write(out, 101);
  out.close("", {});
  // The path at 0, 5 and 10 s, and at the end.
  EXPECT_THAT(counts(), ::testing::UnorderedElementsAre(
                            ::testing::Pair("/viwo/odometry", 101), ::testing::Pair("/tf", 101),
                            ::testing::Pair("/viwo/calibration", 101),
                            ::testing::Pair("/viwo/cam1/tracks", 101),
                            ::testing::Pair("/viwo/path", 4), ::testing::Pair("/diagnostics", 12)));
}

TEST_F(McapOutputTest, WhatIsCutOffIsReadUpToThere) {
  {
    McapOutput out(file_);
    write(out, 5000);
  }  // as if the process were killed
  const int read = counts()["/viwo/odometry"];
  EXPECT_GT(read, 500);
  EXPECT_LT(read, 5000);
}

TEST_F(McapOutputTest, ADiskThatIsFullIsAnErrorAndWhatWasWrittenIsRead) {
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit limit{200'000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &limit);
  const std::string failure = testing::error_of<std::runtime_error>([&] {
    McapOutput out(file_);
    write(out, 5000);
    out.close("", {});
  });
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(failure, file_.string() + "  cannot be written: File too large");
  EXPECT_GT(counts()["/viwo/odometry"], 100);
}

TEST_F(McapOutputTest, WritesOverARunButNotOverARecordingOrAText) {
  for (int twice = 0; twice < 2; ++twice) {
    McapOutput out(file_);
    write(out, 3);
    out.close("", {});
  }
  EXPECT_EQ(counts()["/viwo/odometry"], 3);
  const auto refused = [](const std::filesystem::path& file) {
    return testing::error_of<std::runtime_error>([&] { McapOutput{file}; });
  };
  const auto recording = folder_ / "recording.mcap", text = folder_ / "run.yaml";
  bag::mcap::Writer(recording.string()).close();
  std::ofstream(text) << "name: run\n";
  for (const auto& file : {recording, text}) {
    const auto before = std::filesystem::file_size(file);
    EXPECT_THAT(refused(file), ::testing::HasSubstr("was not written by --mcap"));
    EXPECT_EQ(std::filesystem::file_size(file), before);
  }
  const auto pipe = folder_ / "pipe.mcap";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THAT(refused(pipe), ::testing::HasSubstr("cannot be written: No such device"));
}

TEST_F(McapOutputTest, EndsWithWhatWasWarnedOfSinceTheLastEpoch) {
  {
    McapOutput out(file_);
    write(out, 3);
    out.close("", {"imu0: no samples", "wheels0: no samples"});
  }
  std::string last;
  const auto bag = bag::open_ros2(file_);
  Rejections damage;
  bag->read(
      {{"/diagnostics", false}}, 0, std::numeric_limits<std::int64_t>::max(),
      [&](const bag::Message& message) {
        last.assign(reinterpret_cast<const char*>(message.bytes.data()), message.bytes.size());
      },
      damage);
  EXPECT_THAT(last, ::testing::HasSubstr("imu0: no samples; wheels0: no samples"));
}

}  // namespace
}  // namespace viwo::live

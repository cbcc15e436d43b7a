// `viwo run` on a ROS 2 robot: a simulated one, whose bag another DDS plays on loopback.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "dds_system.hpp"

namespace viwo {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::Child;
using ::testing::HasSubstr;

class Ros2Run : public testing::DdsTest {
 protected:
  static void run(const std::vector<std::string>& words, const std::string& log) {
    Child child(words, dds_->file(log));
    ASSERT_EQ(child.wait(1h), 0) << words[0] << " " << words[1] << "\n" << dds_->text_of(log);
  }

  static bool wait_for(const std::string& text, const std::string& log) {
    const auto deadline = std::chrono::steady_clock::now() + 60s;
    while (dds_->text_of(log).find(text) == std::string::npos) {
      if (std::chrono::steady_clock::now() > deadline) return false;
      std::this_thread::sleep_for(20ms);
    }
    return true;
  }

  /// What a robot would give, in a bag of ROS 2.
  static void make_bag(const std::string& duration_s) {
    run({VIWO_TEST_PROGRAM, "simulate", VIWO_TEST_SOURCE_DIR "/tests/live/simulate.yaml", "--set",
         "sensors.simulator0.duration_s=" + duration_s, "--out", dds_->file("log")},
        "simulate.log");
    if (HasFatalFailure()) return;
    run({VIWO_TEST_BAG_PROGRAM, dds_->file("log"), dds_->file("robot")}, "bag.log");
  }

  /// viwo run to the folder `out`; `--set`s and options behind it.
  static std::vector<std::string> run_words(const std::string& out,
                                            const std::vector<std::string>& more) {
    std::vector<std::string> words{VIWO_TEST_PROGRAM, "run",
                                   VIWO_TEST_SOURCE_DIR "/configs/runs/viwo_live_ros2.yaml",
                                   "--out", dds_->file(out)};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  static std::vector<std::string> dds_words(std::vector<std::string> more) {
    more.insert(more.end(),
                {"--set", "sensors.ros0.domain_id=" + dds_->domain(), "--set",
                 "sensors.ros0.interfaces=[127.0.0.1]", "--set", "sensors.ros0.peers=[127.0.0.1]"});
    return more;
  }

  /// The same run on the bag itself.
  static void run_on_bag() {
    run(run_words("of_bag", {"--set",
                             "sensors.ros0={type: ros2_bag, path: " + dds_->file("robot") +
                                 ", imu_topic: /imu0, image_topics: [/cam0/image_raw, "
                                 "/cam1/image_raw], joint_topic: /joint_states, drive_joints: "
                                 "[drive_1, drive_2, drive_3, drive_4], steer_joints: [steer_1, "
                                 "steer_2, steer_3, steer_4], drive_input: velocity}",
                             "--mcap", dds_->file("of_bag.mcap")}),
        "of_bag.log");
  }

  static std::vector<std::string> lines_with(const std::string& begin, const std::string& name) {
    std::vector<std::string> found;
    std::istringstream in(dds_->text_of(name));
    for (std::string line; std::getline(in, line);) {
      if (line.rfind(begin, 0) == 0) found.push_back(line);
    }
    return found;
  }

  /// ATE [m] of a trajectory against that of the bag.
  static double ate_to_bag(const std::string& trajectory) {
    run({VIWO_TEST_PROGRAM, "evaluate", "--reference", dds_->file("of_bag/trajectory.tum"),
         "--estimate", dds_->file(trajectory)},
        "evaluate.json");
    if (HasFatalFailure()) return 1e9;
    return json::parse(dds_->text_of("evaluate.json")).at("ate_m").get<double>();
  }
};

TEST_F(Ros2Run, InStepGivesTheBitsOfTheBagAndInItsOwnTimeNearlySo) {
  make_bag("10");
  if (HasFatalFailure()) return;
  run_on_bag();
  if (HasFatalFailure()) return;
  const std::string expected = dds_->text_of("of_bag/trajectory.tum");
  ASSERT_GT(expected.size(), 5000U);

  {  // in step
    Child viwo(
        run_words("in_step", dds_words({"--lockstep", "--mcap", dds_->file("in_step.mcap")})),
        dds_->file("in_step.log"));
    Child play(dds_->node("step", dds_->file("robot")), dds_->file("play.log"));
    EXPECT_EQ(play.wait(1h), 0) << dds_->text_of("play.log");
    ASSERT_EQ(viwo.wait(1h), 0) << dds_->text_of("in_step.log");
  }
  EXPECT_TRUE(dds_->text_of("in_step/trajectory.tum") == expected) << "other bits";
  EXPECT_TRUE(dds_->text_of("in_step/calibration.csv") == dds_->text_of("of_bag/calibration.csv"));
  const std::string seen = dds_->text_of("of_bag.mcap");
  EXPECT_GT(seen.size(), expected.size());
  EXPECT_TRUE(dds_->text_of("in_step.mcap") == seen) << "viewers are shown something else";

  {  // in its own time
    Child recorder(dds_->node("record", dds_->file("heard.txt")), dds_->file("recorder.log"));
    Child viwo(run_words("live", dds_words({"--mcap", dds_->file("live.mcap")})),
               dds_->file("live.log"));
    ASSERT_TRUE(wait_for("listening", "live.log")) << dds_->text_of("live.log");
    run(dds_->node("play", dds_->file("robot")), "play.log");
    std::this_thread::sleep_for(1s);
    viwo.signal(SIGINT);
    EXPECT_EQ(viwo.wait(60s), 0) << dds_->text_of("live.log");
  }
  const json summary = json::parse(dds_->text_of("live/summary.json"));
  EXPECT_EQ(summary.at("status"), "ok");
  const auto epochs = summary.at("epochs").get<std::size_t>();
  EXPECT_GT(epochs, 80U);
  EXPECT_THAT(dds_->text_of("live.mcap"), ::testing::EndsWith("\x89MCAP0\r\n")) << "not closed";
  const double ate_m = ate_to_bag("live/trajectory.tum");
  EXPECT_LT(ate_m, 0.005) << "cells that look back, and what was lost on the way";
  // What the robot was told.
  const auto odometry = lines_with("odometry ", "heard.txt");
  EXPECT_GE(odometry.size() + 2, epochs);
  EXPECT_EQ(lines_with("tf ", "heard.txt").size(), odometry.size());
  // Those of estimates; where there is none for a while, a line says that.
  const auto diagnostics = lines_with("diagnostics ", "heard.txt");
  EXPECT_EQ(std::count_if(diagnostics.begin(), diagnostics.end(),
                          [](const std::string& line) {
                            return line.find("sigma position") != std::string::npos;
                          }),
            static_cast<std::ptrdiff_t>(odometry.size()));
  EXPECT_GT(lines_with("path ", "heard.txt").size(), 10U);
  std::cout << "in its own time, ATE to the run on the bag " << ate_m
            << " m; latency from image to pose, ms: "
            << summary.at("timing_ms").at("latency from image to pose") << "; rejected "
            << summary.at("rejected_measurements") << "\n";
}

TEST_F(Ros2Run, InStepIsAnErrorWhereMessagesAreLost) {
  make_bag("3");
  if (HasFatalFailure()) return;
  Child viwo(run_words("lossy", dds_words({"--lockstep"})), dds_->file("lossy.log"));
  Child play(dds_->node("lossy", dds_->file("robot")), dds_->file("play.log"));
  play.wait(100s);
  EXPECT_NE(viwo.wait(100s), 0);
  EXPECT_THAT(dds_->text_of("lossy.log"), HasSubstr("in step nothing may be lost"));
}

TEST_F(Ros2Run, InStepNeedsASensorThatCan) {
  Child viwo({VIWO_TEST_PROGRAM, "run", VIWO_TEST_SOURCE_DIR "/configs/runs/viwo_swerve.yaml",
              "--lockstep", "--out", dds_->file("none")},
             dds_->file("none.log"));
  EXPECT_EQ(viwo.wait(60s), 2);
  EXPECT_THAT(dds_->text_of("none.log"),
              HasSubstr("--lockstep: no sensor of this run can be played in step"));
}

}  // namespace
}  // namespace viwo

// `viwo run` on a robot in real time: a simulated one, whose bag ROS plays.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "ros_system.hpp"

namespace viwo {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::Child;

class LiveRun : public testing::LiveTest {
 protected:
  static std::string text_of(const std::string& name) {
    std::ifstream in(ros_->file(name));
    return {std::istreambuf_iterator<char>(in), {}};
  }

  /// Runs a program to its end, for as long as ctest lets the test.
  static void run(const std::vector<std::string>& words, const std::string& log) {
    Child child(words, ros_->file(log));
    ASSERT_EQ(child.wait(1h), 0) << words[0] << " " << words[1] << "\n" << text_of(log);
  }

  static bool wait_for(const std::string& text, const std::string& log) {
    const auto deadline = std::chrono::steady_clock::now() + 60s;
    while (text_of(log).find(text) == std::string::npos) {
      if (std::chrono::steady_clock::now() > deadline) return false;
      std::this_thread::sleep_for(20ms);
    }
    return true;
  }

  /// The true states of the log, as a trajectory: stamp, p, q (w first), ... become t p q (w last).
  static void write_truth() {
    std::ifstream in(ros_->file("log/state_groundtruth_estimate0/data.csv"));
    std::ofstream out(ros_->file("truth.tum"));
    std::string line;
    std::getline(in, line);
    while (std::getline(in, line)) {
      std::istringstream fields(line);
      std::vector<std::string> f(8);
      for (std::string& field : f) std::getline(fields, field, ',');
      std::string t = std::string(10 - std::min<std::size_t>(10, f[0].size()), '0') + f[0];
      t.insert(t.size() - 9, ".");
      out << t << " " << f[1] << " " << f[2] << " " << f[3] << " " << f[5] << " " << f[6] << " "
          << f[7] << " " << f[4] << "\n";
    }
  }

  static std::vector<std::string> lines_with(const std::string& begin, const std::string& name) {
    std::vector<std::string> found;
    std::ifstream in(ros_->file(name));
    for (std::string line; std::getline(in, line);) {
      if (line.rfind(begin, 0) == 0) found.push_back(line);
    }
    return found;
  }

  static std::string last_line(const std::string& name) {
    std::string last;
    std::ifstream in(ros_->file(name));
    for (std::string line; std::getline(in, line);) last = line;
    return last;
  }

  /// What a robot would give, in a bag.
  static void make_bag(const std::string& robot = VIWO_TEST_SOURCE_DIR
                       "/tests/live/simulate.yaml") {
    run({VIWO_TEST_PROGRAM, "simulate", robot, "--out", ros_->file("log")}, "simulate.log");
    if (HasFatalFailure()) return;
    run({VIWO_TEST_BAG_PROGRAM, ros_->file("log"), ros_->file("robot.bag")}, "bag.log");
  }

  static std::vector<std::string> run_words() {
    return {VIWO_TEST_PROGRAM, "run", VIWO_TEST_SOURCE_DIR "/configs/runs/viwo_live.yaml", "--out",
            ros_->file("out")};
  }

  /// Of a former run, what it has said included.
  static void remove_outputs() {
    std::filesystem::remove_all(ros_->file("out"));
    std::filesystem::remove(ros_->file("viwo.log"));
  }

  static void play_to_a_run_that_is_interrupted() {
    Child recorder({VIWO_TEST_ROS_NODE, "record", ros_->file("heard.txt")},
                   ros_->file("recorder.log"));
    Child viwo(run_words(), ros_->file("viwo.log"));
    ASSERT_TRUE(wait_for("listening", "viwo.log")) << text_of("viwo.log");
    run({VIWO_TEST_ROSBAG_PLAY, "--quiet", "-d", "2", ros_->file("robot.bag")}, "play.log");
    std::this_thread::sleep_for(1s);
    viwo.signal(SIGINT);
    EXPECT_EQ(viwo.wait(60s), 0) << text_of("viwo.log");
  }
};

TEST_F(LiveRun, FollowsARobotInRealTimeAndTellsItWhereItIs) {
  make_bag();
  if (HasFatalFailure()) return;
  play_to_a_run_that_is_interrupted();
  if (HasFatalFailure()) return;
  const json summary = json::parse(text_of("out/summary.json"));
  EXPECT_EQ(summary.at("status"), "ok");
  EXPECT_GT(summary.at("duration_s").get<double>(), 8.);

  // Where it was: the truth is known to the simulation alone.
  write_truth();
  run({VIWO_TEST_PROGRAM, "evaluate", "--reference", ros_->file("truth.tum"), "--estimate",
       ros_->file("out/trajectory.tum")},
      "evaluate.json");
  if (HasFatalFailure()) return;
  const json accuracy = json::parse(text_of("evaluate.json"));
  EXPECT_GT(accuracy.at("path_length_m").get<double>(), 4.);
  EXPECT_LT(accuracy.at("ate_m").get<double>(), 0.03) << text_of("viwo.log");
  EXPECT_LT(accuracy.at("ate_deg").get<double>(), 0.5);

  // What the robot was told, to the last.
  const auto odometry = lines_with("odometry ", "heard.txt");
  const auto epochs = summary.at("epochs").get<std::size_t>();
  EXPECT_GT(epochs, 80U);
  EXPECT_GE(odometry.size() + 2, epochs);
  EXPECT_EQ(lines_with("tf ", "heard.txt").size(), odometry.size());
  // Those of estimates; where there is none for a while, a line says that.
  const auto diagnostics = lines_with("diagnostics ", "heard.txt");
  EXPECT_EQ(std::count_if(diagnostics.begin(), diagnostics.end(),
                          [](const std::string& line) {
                            return line.find("sigma position") != std::string::npos;
                          }),
            static_cast<std::ptrdiff_t>(odometry.size()));
  ASSERT_FALSE(odometry.empty());
  std::istringstream told(odometry.back()), written(last_line("out/trajectory.tum"));
  std::string ignored, world, body;
  double t_ns = 0., t_s = 0., a = 0., b = 0.;
  told >> ignored >> t_ns >> world >> body;
  EXPECT_EQ(world, "odom");
  EXPECT_EQ(body, "imu");
  written >> t_s;
  EXPECT_NEAR(1e-9 * t_ns, t_s, 1e-6);
  for (int i = 0; i < 3; ++i) {
    told >> a;
    written >> b;
    EXPECT_NEAR(a, b, 1e-6) << "axis " << i;
  }

  const json latency = summary.at("timing_ms").at("latency from image to pose");
  std::cout << "latency from image to pose, ms: " << latency << ", ATE " << accuracy.at("ate_m")
            << " m\n";
  EXPECT_GT(latency.at("mean").get<double>(), 0.);
  EXPECT_LT(latency.at("mean").get<double>(), 250.);
}

TEST_F(LiveRun, HasItsResultsOnDiskAsTheyComeAlsoWhenItIsKilled) {
  // The same robot in the dark.
  std::ifstream all(VIWO_TEST_SOURCE_DIR "/tests/live/simulate.yaml");
  std::ofstream dark(ros_->file("dark.yaml"));
  for (std::string line; std::getline(all, line);) {
    if (line.find("images0:") != std::string::npos) continue;
    const std::size_t path = line.find("../../configs");
    if (path != std::string::npos) line.replace(path, 5, VIWO_TEST_SOURCE_DIR);
    dark << line << "\n";
  }
  dark.close();
  make_bag(ros_->file("dark.yaml"));
  if (HasFatalFailure()) return;
  remove_outputs();
  Child viwo(run_words(), ros_->file("viwo.log"));
  ASSERT_TRUE(wait_for("listening", "viwo.log")) << text_of("viwo.log");
  Child play({VIWO_TEST_ROSBAG_PLAY, "--quiet", "-d", "2", ros_->file("robot.bag")},
             ros_->file("play.log"));
  const auto n_poses = [] {
    const std::string text = text_of("out/trajectory.tum");
    return std::count(text.begin(), text.end(), '\n') - 1;
  };
  const auto deadline = std::chrono::steady_clock::now() + 60s;
  while (n_poses() < 12 && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(20ms);
  }
  viwo.signal(SIGKILL);
  viwo.wait(5s);
  EXPECT_GE(n_poses(), 12) << text_of("viwo.log");
  EXPECT_FALSE(std::filesystem::exists(ros_->file("out/summary.json")));
  for (const char* file : {"out/trajectory.tum", "out/calibration.csv", "out/timing.csv"}) {
    EXPECT_EQ(text_of(file).back(), '\n') << file << " ends within a line";
  }
  // It may have been killed between the two.
  EXPECT_NEAR(static_cast<double>(lines_with("", "out/timing.csv").size()),
              static_cast<double>(n_poses() + 1), 1.);
}

TEST_F(LiveRun, EndsSoonByAnySignalAlsoWhileNothingComes) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    remove_outputs();
    Child viwo(run_words(), ros_->file("viwo.log"));
    ASSERT_TRUE(wait_for("listening", "viwo.log")) << text_of("viwo.log");
    const auto begin = std::chrono::steady_clock::now();
    viwo.signal(number);
    EXPECT_EQ(viwo.wait(20s), 1) << text_of("viwo.log");
    EXPECT_LT(std::chrono::steady_clock::now() - begin, 3s) << "with the writing of the results";
    const json summary = json::parse(text_of("out/summary.json"));
    EXPECT_EQ(summary.at("cause"), "nothing has come: no IMU sample arrived") << number;
  }
}

}  // namespace
}  // namespace viwo

// Live sensors that are played in step.
#include <atomic>
#include <chrono>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "live_device.hpp"
#include "pictures_of_points.hpp"
#include "viwo/api/status.hpp"
#include "viwo/run/run.hpp"

namespace viwo {
namespace {

using testing::BreakingDevice;
using testing::Device;
using testing::routes_of_pictures;
using testing::standing_then_driving;
using testing::stream;
using testing::Tracker;
using testing::with_pictures;

/// A run on `device` in step, with a tracker of its pictures.
RunResult play(const std::shared_ptr<Sensor>& device, const RunHooks& hooks = {},
               std::shared_ptr<Sensor> tracker = std::make_shared<Tracker>()) {
  RunSetup setup = standing_then_driving();  // updates that have not learned anything yet
  setup.routes = routes_of_pictures(setup);
  RunData data;
  data.lockstep = true;
  data.live.push_back(stream("device", device));
  data.streams.push_back(stream("tracks", std::move(tracker), "device"));
  return run_filter(setup, data, hooks);
}

void expect_same_bits(const RunResult& a, const RunResult& b) {
  ASSERT_EQ(a.estimate.size(), b.estimate.size());
  for (std::size_t i = 0; i < a.estimate.size(); ++i) {
    ASSERT_EQ(a.estimate[i].t_ns, b.estimate[i].t_ns) << i;
    ASSERT_EQ(a.estimate[i].p_BinW, b.estimate[i].p_BinW) << i;
    ASSERT_EQ(a.estimate[i].q_BtoW.coeffs(), b.estimate[i].q_BtoW.coeffs()) << i;
  }
  ASSERT_EQ(a.calibration.size(), b.calibration.size());
  for (std::size_t i = 0; i < a.calibration.size(); ++i) {
    EXPECT_EQ(a.calibration[i].estimate, b.calibration[i].estimate) << a.calibration[i].name;
    EXPECT_EQ(a.calibration[i].sigma, b.calibration[i].sigma) << a.calibration[i].name;
  }
}

/// Takes its time, now and then.
template <class Base>
class Slow final : public Base {
 public:
  using Base::Base;
  Status next(Measurement& out) override {
    if (random_() % 16 == 0) std::this_thread::sleep_for(std::chrono::microseconds(300));
    return Base::next(out);
  }

 private:
  std::minstd_rand random_{5};
};

TEST(LockstepFeed, GivesTheBitsOfTheSameMeasurementsRecordedWhoeverIsSlow) {
  RunSetup setup = standing_then_driving();
  const RunData recorded = collect(setup);
  const RunResult expected = run_filter(setup, recorded);
  ASSERT_EQ(expected.status, RunStatus::kOk) << expected.cause;
  const auto measurements = with_pictures(recorded);

  const auto device = std::make_shared<Device>(measurements, false);
  RunResult played = play(device);
  ASSERT_EQ(played.status, RunStatus::kOk) << played.cause;
  EXPECT_FALSE(played.live);
  expect_same_bits(played, expected);
  ASSERT_EQ(device->estimates.size(), played.estimate.size()) << "it is told, as a live one";
  EXPECT_EQ(device->estimates.back().p_IinG_m[0], played.estimate.back().p_BinW.x());

  expect_same_bits(play(std::make_shared<Slow<Device>>(measurements, false)), expected);
  expect_same_bits(
      play(std::make_shared<Device>(measurements, false), {}, std::make_shared<Slow<Tracker>>()),
      expected);
}

TEST(LockstepFeed, WaitsForWhatComesUntilItIsInterrupted) {
  RunSetup setup = standing_then_driving();
  auto measurements = with_pictures(collect(setup));
  measurements.resize(measurements.size() / 2);
  std::atomic<bool> interrupted = false;
  std::atomic<int> epochs = 0;
  RunHooks hooks;
  hooks.interrupted = [&] { return interrupted.load(); };
  hooks.on_epoch = [&](const RunResult&) { ++epochs; };
  std::thread user([&] {
    while (epochs == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    interrupted = true;
  });
  const RunResult result = play(std::make_shared<Device>(measurements, true), hooks);
  user.join();
  EXPECT_GT(result.epochs, 0);
  ASSERT_FALSE(result.warnings.empty());
  EXPECT_NE(result.warnings.front().find("interrupted at "), std::string::npos);
}

TEST(LockstepFeed, EndsWithWhatItsSensorSays) {
  RunSetup setup = standing_then_driving();
  const auto measurements = with_pictures(collect(setup));
  const RunResult result =
      play(std::make_shared<BreakingDevice>(measurements, "messages were lost"));
  EXPECT_EQ(result.status, RunStatus::kFailed);
  EXPECT_EQ(result.cause, "messages were lost");
}

}  // namespace
}  // namespace viwo

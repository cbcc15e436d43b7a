// When an epoch ends, and what it waits for.
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "estimator_fixture.hpp"
#include "viwo/estimator/epoch_schedule.hpp"

namespace viwo {
namespace {

using testing::cell_at;
using testing::imu_at;
using testing::kMs;
using testing::tick_at;

/// An IMU, ticks that end epochs, and cells that are awaited if there are any; times in ms.
struct ScheduleBench {
  StateBlocks blocks{{testing::base_clock(0.)}, {}, 0};
  ScheduleOptions options;
  ImuBuffer imu{ImuLimits{.max_gap_s = 1.}};
  std::vector<Stream> streams;
  Rejections rejections;
  bool finished = false;

  explicit ScheduleBench(int per_instant = 1, std::vector<StreamSpec::Clock> clocks = {},
                         bool with_cells = false) {
    StreamSpec spec = testing::ticks_spec(per_instant);
    spec.clocks = std::move(clocks);
    streams.emplace_back(SharedStream{spec, "test", false});
    if (with_cells) streams.emplace_back(SharedStream{testing::cells_spec({0}), "test", true});
  }
  void imu_to(std::int64_t t_ms) { imu.add(imu_at(t_ms * kMs), rejections); }
  void tick(std::int64_t t_ms, int channel = 0) {
    streams[0].add(tick_at(t_ms * kMs, channel), blocks, std::nullopt, rejections);
  }
  void cell(std::int64_t end_ms) {
    streams[1].add(cell_at(end_ms * kMs), blocks, std::nullopt, rejections);
  }
  /// End of the epoch after `present_ms`; -1: none yet.
  std::int64_t next(std::int64_t present_ms = 0) const {
    const auto t = next_epoch_ns(options, present_ms * kMs, imu, streams, blocks, finished);
    return t ? *t / kMs : -1;
  }
};

TEST(EpochSchedule, EndsAnEpochAtATickOnceSomethingLaterHasCome) {
  ScheduleBench bench;
  EXPECT_EQ(bench.next(), -1) << "no IMU";
  bench.imu_to(100);
  bench.tick(100);
  EXPECT_EQ(bench.next(), -1) << "more of the same stamp may come";
  bench.imu_to(101);
  EXPECT_EQ(bench.next(), 100);
}

TEST(EpochSchedule, WaitsForTheImuToReachTheTick) {
  ScheduleBench bench;
  bench.imu_to(90);
  bench.tick(100);
  bench.tick(200);
  EXPECT_EQ(bench.next(), -1);
  bench.imu_to(100);
  EXPECT_EQ(bench.next(), 100) << "a later tick has come";
}

TEST(EpochSchedule, EndsAnEpochAfterAWhileWithoutATick) {
  ScheduleBench bench;
  bench.imu_to(250);
  EXPECT_EQ(bench.next(), -1);
  bench.imu_to(251);
  EXPECT_EQ(bench.next(), 250);
  bench.tick(300);
  EXPECT_EQ(bench.next(), 250) << "before the tick";
}

TEST(EpochSchedule, WaitsForAwaitedStreamsButNotLongerThanItMay) {
  ScheduleBench bench(1, {}, true);
  bench.imu_to(120);
  bench.tick(100);
  bench.cell(90);
  EXPECT_EQ(bench.next(), -1);
  bench.imu_to(300);
  EXPECT_EQ(bench.next(), -1) << "not for longer than max_wait_s";
  bench.imu_to(301);
  EXPECT_EQ(bench.next(), 100);
  ScheduleBench reached(1, {}, true);
  reached.imu_to(120);
  reached.tick(100);
  reached.cell(100);
  EXPECT_EQ(reached.next(), 100);
}

TEST(EpochSchedule, WaitsForNothingWhenNothingMoreWillCome) {
  ScheduleBench bench(2, {}, true);
  bench.imu_to(100);
  bench.tick(100);
  EXPECT_EQ(bench.next(), -1);
  bench.finished = true;
  EXPECT_EQ(bench.next(), 100);
  EXPECT_EQ(bench.next(100), -1) << "the IMU ends here";
}

TEST(EpochSchedule, NeverGoesBackAndMakesNoTwoClonesOfOneInstant) {
  ScheduleBench bench(1, {{0., {0}}});
  bench.imu_to(200);
  bench.tick(100);
  EXPECT_EQ(bench.next(80), 100);
  // A clock is found to be another: the tick is at 70.
  bench.blocks.correct(Eigen::VectorXd::Constant(1, -0.03), true);
  EXPECT_EQ(bench.next(60), 70);
  EXPECT_EQ(bench.next(80), 81) << "a millisecond is the least";
  EXPECT_EQ(bench.next(70), 71);
}

TEST(EpochSchedule, InTheOrderOfStampsWaitsForTheOtherTickOfAnInstantOnlyIfOneIsThere) {
  // The ticks' clocks are 30 ms early: what is stamped 130 is of 100.
  const std::vector<StreamSpec::Clock> clocks{{-0.03, {}}, {-0.03, {}}};
  ScheduleBench bench(2, clocks);
  bench.imu_to(130);
  bench.tick(130, 0);
  EXPECT_EQ(bench.next(), -1) << "the other has the same stamp, and comes next";
  bench.tick(130, 1);
  EXPECT_EQ(bench.next(), 100);
  ScheduleBench alone(2, clocks);
  alone.imu_to(130);
  alone.tick(130, 0);
  alone.imu_to(300);
  EXPECT_EQ(alone.next(), -1);
  alone.tick(163, 0);
  EXPECT_EQ(alone.next(), 100) << "the next instant has begun";
  ScheduleBench lost(2, clocks);
  lost.tick(130, 0);
  lost.imu_to(301);
  EXPECT_EQ(lost.next(), 100) << "longer than max_wait_s";
}

TEST(EpochSchedule, OfLiveMeasurementsWaitsForTheOthersOfAnInstant) {
  const auto next = [](int ticks, std::int64_t imu_ms) {
    ScheduleBench bench(2);
    bench.options.max_instant_wait_s = 0.05;
    bench.imu_to(imu_ms);
    for (int channel = 0; channel < ticks; ++channel) bench.tick(100, channel);
    return bench.next(-150);
  };
  EXPECT_EQ(next(2, 100), 100) << "at once when all are there";
  EXPECT_EQ(next(1, 150), -1);
  EXPECT_EQ(next(1, 151), 100);
  EXPECT_EQ(next(0, 150), -1) << "they may be on their way";
  EXPECT_EQ(next(0, 151), 100);
}

TEST(EpochSchedule, OfTwoStreamsTheEarlierEndsAnEpoch) {
  ScheduleBench bench;
  StreamSpec fixes = testing::fixes_spec();
  fixes.ends_epochs = true;
  bench.streams.emplace_back(SharedStream{fixes, "test", false});
  bench.imu_to(200);
  bench.tick(100);
  bench.streams[1].add(testing::FixSample{90 * kMs, 0.}, bench.blocks, std::nullopt,
                       bench.rejections);
  EXPECT_EQ(bench.next(), 90);
}

}  // namespace
}  // namespace viwo

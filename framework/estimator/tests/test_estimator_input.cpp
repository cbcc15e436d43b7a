// Measurements that come late, never, in the wrong order or broken.
#include <algorithm>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "estimator_fixture.hpp"
#include "viwo/estimator/estimator.hpp"

namespace viwo {
namespace {

using testing::Bench;
using testing::cell_at;
using testing::CellSample;
using testing::Counts;
using testing::expect_same;
using testing::imu_at;
using testing::kMs;
using testing::kNaN;
using testing::kStart;
using testing::level_prior;
using testing::Seen;
using testing::tick_at;
using testing::TickSample;

TEST(Estimator, StorageOfFormerTicksDoesNotLeakIntoLaterOnes) {
  Bench bench = Bench::started();
  bench.imu(-10, 400);
  TickSample many = tick_at(kStart + 100 * kMs);
  many.values.resize(50);
  bench.add(many);
  TickSample none = tick_at(kStart + 200 * kMs);
  none.values.clear();
  bench.add(none);
  bench.tick(300);
  EXPECT_EQ(bench.steps(), 3);
  EXPECT_EQ(bench.update->seen[0].ticks[0].values.size(), 50u);
  EXPECT_EQ(bench.update->seen[1].ticks[0].values.size(), 0u);
  EXPECT_EQ(bench.update->seen[2].ticks[0].values.size(), 2u);
}

TEST(Estimator, WaitsForCellsThatReachTheEpochInTheirOwnClock) {
  Bench bench = Bench::started({.cells = true});
  bench.imu(-10, 150);
  bench.tick(100);
  EXPECT_EQ(bench.steps(), 0);
  // They are 4 ms late: the epoch is at 96 ms of their clock.
  bench.add(cell_at(kStart + 85 * kMs));
  bench.add(cell_at(kStart + 95 * kMs));
  EXPECT_EQ(bench.steps(), 0);
  bench.add(cell_at(kStart + 105 * kMs));
  EXPECT_EQ(bench.steps(), 1);
  EXPECT_EQ(bench.update->seen[0].cells.size(), 3u);
}

TEST(Estimator, WaitsForCellsNotLongerThanItMay) {
  EstimatorOptions options;
  options.schedule.max_wait_s = 0.15;
  Bench bench = Bench::started({.cells = true}, {}, options);
  bench.tick(100);
  bench.imu(-10, 240);
  EXPECT_EQ(bench.steps(), 0);
  bench.imu(240, 260);
  EXPECT_EQ(bench.steps(), 1);
  EXPECT_TRUE(bench.update->seen[0].cells.empty());
}

TEST(Estimator, DoesNotTakeTheClockOfTheCellsForItsOwn) {
  // Their clock is ten seconds ahead: nothing can be said from their stamps alone.
  Bench bench = Bench::started({.cells = true, .late_s = -10.});
  bench.imu(-10, 100);
  bench.tick(100, 0);
  const std::int64_t ahead = kStart + 10'000 * kMs;
  for (std::int64_t t = 10; t <= 100; t += 10) bench.add(cell_at(ahead + t * kMs));
  EXPECT_EQ(bench.steps(), 0) << "nothing yet is later than the tick";
  bench.tick(100, 1);
  bench.imu(100, 110);
  EXPECT_EQ(bench.steps(), 1);
  EXPECT_EQ(bench.update->seen[0].ticks.size(), 2u);
  EXPECT_EQ(bench.rejected(), Counts{});
}

TEST(Estimator, KeepsEveryCellSinceTheOldestClone) {
  EstimatorOptions options;
  options.filter.clones = 4;
  Bench bench = Bench::started({.cells = true}, {}, options);
  std::size_t most = 0;
  for (std::int64_t t = 10; t <= 8000; t += 10) {
    if (t == 10) bench.imu(-10, 0);
    bench.estimator.add(imu_at(kStart + t * kMs));
    bench.add(cell_at(kStart + t * kMs));
    if (t % 100 == 0) bench.tick(t);
    bench.steps();
  }
  ASSERT_EQ(bench.update->seen.size(), 79u);
  for (const Seen& seen : bench.update->seen) {
    ASSERT_FALSE(seen.cells.empty());
    const std::int64_t offset_ns = 4 * kMs;
    if (seen.clones.front() - offset_ns > kStart) {
      EXPECT_LE(seen.cells.front().begin_ns, seen.clones.front() - offset_ns);
    }
    EXPECT_GE(seen.cells.back().end_ns, seen.end_ns - offset_ns);
    for (std::size_t i = 1; i < seen.cells.size(); ++i) {
      EXPECT_EQ(seen.cells[i].begin_ns, seen.cells[i - 1].end_ns);
    }
    most = std::max(most, seen.cells.size());
  }
  EXPECT_LT(most, 200u) << "what is not needed any more goes";
}

TEST(Estimator, CountsWhatItCannotUse) {
  Bench bench = Bench::started({.cells = true});
  bench.imu(-10, 100);
  const std::int64_t t = kStart + 100 * kMs;
  ImuSample sample = imu_at(t + 5 * kMs);
  sample.gyro_rad_per_s[2] = kNaN;
  bench.estimator.add(sample);
  sample = imu_at(t + 5 * kMs);
  sample.accel_m_per_s2[0] = std::numeric_limits<double>::infinity();
  bench.estimator.add(sample);
  bench.estimator.add(imu_at(t));
  bench.estimator.add(imu_at(t - 1));
  bench.estimator.add(imu_at(t + 51 * kMs));
  bench.tick(0);
  bench.tick(90);
  bench.tick(80);
  bench.tick(80, 1);
  CellSample cell = cell_at(t);
  cell.rate = kNaN;
  bench.add(cell);
  cell = cell_at(t);
  std::swap(cell.begin_ns, cell.end_ns);
  bench.add(cell);
  bench.add(cell_at(t));
  bench.add(cell_at(t + 9 * kMs));
  EXPECT_EQ(bench.rejected(), (Counts{{"imu: value that is not finite", 2},
                                      {"imu: stamp not after the last", 2},
                                      {"imu: gap bridged", 1},
                                      {"ticks: at or before the present epoch", 1},
                                      {"ticks: stamp not after the last", 1},
                                      {"ticks: stamp before the last", 1},
                                      {"cells: value that is not finite", 1},
                                      {"cells: sample that ends before it begins", 1},
                                      {"cells: begins before the end of the last", 1}}));
  const RejectionCount first = bench.estimator.rejections().front();
  EXPECT_EQ(first.first, "stamp 1105000000 ns");
  EXPECT_EQ(bench.steps(), 1);
  for (const ImuSample& used : bench.update->seen[0].imu) {
    expect_same(used, imu_at(used.t_ns), 1e-12);
  }
  EXPECT_EQ(bench.update->seen[0].cells.size(), 1u);
  EXPECT_EQ(bench.estimator.failure(), "");
}

TEST(Estimator, BridgesAGapOfTheImuThatIsLongerThanAnEpoch) {
  Bench bench = Bench::started();
  bench.imu(-10, 100);
  bench.imu(900, 1000);
  for (const std::int64_t t : {100, 200, 700, 950}) bench.tick(t);
  EXPECT_EQ(bench.steps(), 5);  // one of them without a tick, 250 ms after that of 200 ms
  std::int64_t last_ns = kStart;
  for (const Seen& seen : bench.update->seen) {
    EXPECT_EQ(seen.begin_ns, last_ns);
    EXPECT_EQ(seen.imu.front().t_ns, seen.begin_ns);
    EXPECT_EQ(seen.imu.back().t_ns, seen.end_ns);
    for (const ImuSample& sample : seen.imu) expect_same(sample, imu_at(sample.t_ns), 1e-12);
    last_ns = seen.end_ns;
  }
  EXPECT_EQ(bench.rejected(), (Counts{{"imu: gap bridged", 1}}));
}

TEST(Estimator, HoldsTheFirstReadingOfAnImuThatBeginsAfterTheStart) {
  Bench bench = Bench::started();
  bench.imu(40, 200);  // the first one at 50 ms
  bench.tick(45);
  bench.tick(113);
  EXPECT_EQ(bench.steps(), 2);
  const ImuSample first = imu_at(kStart + 50 * kMs);
  const auto expect_held = [&](const ImuSample& sample, std::int64_t t_ms) {
    ImuSample expected = first;
    expected.t_ns = kStart + t_ms * kMs;
    expect_same(sample, expected, 1e-12);
  };
  const auto& before = bench.update->seen[0].imu;
  ASSERT_EQ(before.size(), 2u);
  expect_held(before[0], 0);
  expect_held(before[1], 45);
  const auto& then = bench.update->seen[1].imu;
  ASSERT_EQ(then.size(), 9u);
  expect_held(then[0], 45);
  expect_held(then[1], 50);
  expect_same(then.back(), imu_at(kStart + 113 * kMs), 1e-12);
}

TEST(Estimator, DoesNothingWithoutMeasurementsOrWithoutAnImu) {
  Bench bench = Bench::started();
  EXPECT_FALSE(bench.estimator.step());
  bench.tick(100);
  EXPECT_FALSE(bench.estimator.step());
  bench.estimator.finish();
  EXPECT_FALSE(bench.estimator.step());
  EXPECT_EQ(bench.estimator.epochs(), 0);
  EXPECT_EQ(bench.estimator.failure(), "");
  EXPECT_TRUE(bench.update->seen.empty());
}

TEST(Estimator, FinishingDoesWhatWaitedForOthers) {
  Bench bench = Bench::started({.cells = true});
  bench.imu(-10, 110);
  bench.tick(60);
  bench.tick(110);
  EXPECT_EQ(bench.steps(), 0);
  bench.estimator.finish();
  EXPECT_EQ(bench.steps(), 2);
  EXPECT_EQ(bench.update->seen.back().end_ns, kStart + 110 * kMs);
}

TEST(Estimator, TakesBothTicksOfAnInstantWhateverTheClockOfTheCells) {
  // Ticks are triggered with the IMU; in the order of the stamps the cells are in between.
  for (const double late_s : {-0.02, 0., 0.02}) {
    Bench bench = Bench::started({.cells = true, .ticks_per_instant = 2, .late_s = late_s});
    for (std::int64_t t = 0; t <= 500; t += 10) {
      bench.estimator.add(imu_at(kStart + t * kMs));
      bench.steps();
      bench.add(cell_at(kStart + t * kMs));
      bench.steps();
      for (const int channel : {0, 1}) {
        if (t % 100 == 0 && t > 0) bench.tick(t, channel);
        bench.steps();
      }
    }
    ASSERT_EQ(bench.update->seen.size(), 4U) << late_s;
    for (const Seen& seen : bench.update->seen) EXPECT_EQ(seen.ticks.size(), 2U) << late_s;
  }
}

TEST(Estimator, IsNotSpoiltByAStampInTheFuture) {
  Bench bench = Bench::started({.cells = true});
  bench.imu(-10, 0);
  bench.tick(3'600'000);
  bench.add(cell_at(kStart + 3'600'000 * kMs));
  for (std::int64_t t = 10; t <= 300; t += 10) {
    bench.imu(t - 10, t);
    bench.add(cell_at(kStart + t * kMs));
    if (t % 100 == 0) bench.tick(t);
    bench.steps();
  }
  ASSERT_EQ(bench.update->seen.size(), 2U);
  EXPECT_EQ(bench.update->seen[1].ticks.size(), 1U);
  EXPECT_GT(bench.update->seen[1].cells.size(), 15U);
  EXPECT_EQ(bench.rejected(), (Counts{{"ticks: stamp more than 10 s ahead of the IMU", 1},
                                      {"cells: stamp more than 10 s ahead of the IMU", 1}}));
}

TEST(Estimator, CannotGoOnWhenTheClockOfTheImuWasSetBack) {
  Bench bench = Bench::started();
  bench.imu(-10, 100);
  EXPECT_EQ(bench.steps(), 0);
  bench.imu(-60'000, -59'800);
  EXPECT_EQ(bench.steps(), 0);
  EXPECT_EQ(bench.estimator.failure(), "the clock of the IMU was set back by 60.090000 s");
}

/// Of a base that stands, with some noise: every 10 ms.
void rest(Bench& bench, std::int64_t from_ms, std::int64_t to_ms) {
  for (std::int64_t t = from_ms + 10; t <= to_ms; t += 10) {
    const double noise = 1e-4 * static_cast<double>(t / 10 % 3);
    bench.estimator.add(ImuSample{kStart + t * kMs, {noise, 0., 0.}, {0., noise, 9.81}});
  }
}

TEST(Estimator, CannotGoOnWhenTheImuWasSilentForAMinute) {
  Bench bench = Bench::started();
  rest(bench, -10, 1000);
  rest(bench, 10'000, 11'000);
  EXPECT_GT(bench.steps(), 30) << "over some seconds it goes on";
  EXPECT_EQ(bench.estimator.failure(), "");
  rest(bench, 3'600'000, 3'601'000);
  EXPECT_LT(bench.steps(), 3) << "not one epoch after the other for an hour";
  EXPECT_THAT(bench.estimator.failure(), ::testing::StartsWith("the IMU was silent for 35"));
}

TEST(Estimator, NamesTheSilenceOfTheImuAfterWhichItFailed) {
  EstimatorOptions options = testing::any_motion();
  options.health.max_speed_m_per_s = 100.;
  for (const bool silent : {true, false}) {
    Bench bench = Bench::started({}, {}, options);
    rest(bench, -10, 1000);
    const std::int64_t begin_ms = silent ? 21'000 : 1010;
    for (std::int64_t t = begin_ms; t < begin_ms + 5000; t += 10) {
      const double noise = 1e-4 * static_cast<double>(t / 10 % 3);
      bench.estimator.add(ImuSample{kStart + t * kMs, {noise, 0., 0.}, {50., noise, 9.81}});
      bench.steps();
    }
    EXPECT_THAT(bench.estimator.failure(), ::testing::StartsWith("the speed is 1"));
    EXPECT_EQ(
        bench.estimator.failure().find(": the IMU had been silent for 20.0") != std::string::npos,
        silent)
        << bench.estimator.failure();
  }
}

TEST(Estimator, DoesNotMakeEpochsFromAStartInAnotherClockToTheFirstReading) {
  Bench bench = Bench::started();
  rest(bench, 1'000'000'000, 1'000'000'200);
  EXPECT_EQ(bench.steps(), 0);
  EXPECT_THAT(bench.estimator.failure(), ::testing::StartsWith("the IMU was silent for 1000000."));
}

TEST(Estimator, RefusesStampsWhoseDifferencesOverflow) {
  Bench bench = Bench::started({.cells = true});
  rest(bench, -10, 100);
  using Limits = std::numeric_limits<std::int64_t>;
  for (const std::int64_t t_ns : {Limits::min(), Limits::max(), -4'000'000'000'000'000'001}) {
    ImuSample sample = imu_at(kStart);
    sample.t_ns = t_ns;
    bench.estimator.add(sample);
    CellSample cell = cell_at(kStart + 50 * kMs);
    cell.begin_ns = t_ns;
    bench.add(cell);
  }
  CellSample cell = cell_at(kStart + 50 * kMs);
  cell.t_ns = cell.end_ns + 1;
  bench.add(cell);
  EXPECT_EQ(bench.rejected(), (Counts{{"imu: stamp that is none", 3},
                                      {"cells: stamp that is none", 2},
                                      {"cells: sample that ends before it begins", 1},
                                      {"cells: stamp outside of the time that it stands for", 1}}));
}

TEST(Estimator, OfLiveMeasurementsWaitsForTheTickOfTheOtherChannel) {
  const auto ticks_of_epoch = [](bool second_comes, std::int64_t imu_until_ms) {
    EstimatorOptions options;
    options.schedule.max_instant_wait_s = 0.05;
    Bench bench = Bench::started({.ticks_per_instant = 2}, {}, options);
    // To find them takes time: the IMU is ahead when they come.
    bench.imu(-10, imu_until_ms);
    bench.tick(100, 0);
    bench.estimator.step();
    if (second_comes) bench.tick(100, 1);
    bench.estimator.step();
    return bench.update->seen.empty() ? 0U : bench.update->seen.front().ticks.size();
  };
  EXPECT_EQ(ticks_of_epoch(true, 120), 2U);   // at once when both are there
  EXPECT_EQ(ticks_of_epoch(false, 120), 0U);  // waits
  EXPECT_EQ(ticks_of_epoch(false, 160), 1U);  // but not for ever
}

}  // namespace
}  // namespace viwo

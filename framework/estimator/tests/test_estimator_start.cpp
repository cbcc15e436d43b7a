// Measurements that wait for a start which does not come about, or comes late.
#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "estimator_fixture.hpp"
#include "viwo/estimator/estimator.hpp"

namespace viwo {
namespace {

using testing::Bench;
using testing::cell_at;
using testing::CellSample;
using testing::Counts;
using testing::FixSample;
using testing::imu_at;
using testing::kMs;
using testing::kStart;
using testing::level_prior;
using testing::tick_at;

FixSample fix_at(std::int64_t t_ns) { return {t_ns, 1.}; }

/// An estimator of cells and fixes that asks for a start, and what it showed when it asked.
struct Waiting {
  std::vector<std::int64_t> asked_ms;  ///< the last IMU sample; -1: none
  std::size_t n_imu = 0;               ///< of the last attempt
  std::int64_t imu_span_ms = 0;
  std::int64_t cells_begin_ms = 0;
  std::size_t most_imu = 0, most_cells = 0;
  std::int64_t start_at_ms = std::numeric_limits<std::int64_t>::max();
  Bench bench;

  explicit Waiting(double late_s = 0.) : bench({.cells = true, .fixes = true, .late_s = late_s}) {
    bench.estimator.start([this](const StartData& data) -> StartAttempt {
      const auto imu = data.imu;
      // In the order in which the update has declared them.
      const auto cells = data.samples<CellSample>(StreamId{0});
      asked_ms.push_back(imu.empty() ? -1 : (imu.back().t_ns - kStart) / kMs);
      if (!imu.empty()) imu_span_ms = (imu.back().t_ns - imu.front().t_ns) / kMs;
      n_imu = imu.size();
      most_imu = std::max(most_imu, imu.size());
      most_cells = std::max(most_cells, cells.size());
      if (!cells.empty()) cells_begin_ms = (cells.front().begin_ns - kStart) / kMs;
      if (asked_ms.back() < start_at_ms) return no_start(n_imu < 6 ? "far too early" : "not yet");
      return {level_prior(imu.back().t_ns), {}};
    });
  }
  Waiting(const Waiting&) = delete;

  Counts rejected() const {
    Counts counts = bench.rejected();
    counts.erase("imu: gap bridged");
    return counts;
  }
};

TEST(EstimatorStart, IsTriedEvery50MsAndOnceMoreAtTheEnd) {
  Waiting waiting;
  for (std::int64_t t = 0; t <= 120; t += 10) {
    waiting.bench.estimator.add(imu_at(kStart + t * kMs));
    waiting.bench.add(cell_at(kStart + t * kMs));
    EXPECT_FALSE(waiting.bench.estimator.step());
    EXPECT_FALSE(waiting.bench.estimator.step());
  }
  EXPECT_EQ(waiting.asked_ms, (std::vector<std::int64_t>{0, 50, 100}));
  waiting.bench.estimator.finish();
  EXPECT_FALSE(waiting.bench.estimator.step());
  EXPECT_FALSE(waiting.bench.estimator.step());
  EXPECT_EQ(waiting.asked_ms, (std::vector<std::int64_t>{0, 50, 100, 120}));
  const auto obstacles = waiting.bench.estimator.start_obstacles();
  ASSERT_EQ(obstacles.size(), 2u);
  EXPECT_EQ(obstacles[0].text, "far too early");
  EXPECT_EQ(obstacles[0].count, 1);
  EXPECT_EQ(obstacles[1].text, "not yet");
  EXPECT_EQ(obstacles[1].count, 3);
}

TEST(EstimatorStart, IsTriedAtTheEndWithoutAnyImuSoThatItSaysWhatIsMissing) {
  Waiting waiting;
  waiting.bench.tick(0);
  EXPECT_FALSE(waiting.bench.estimator.step());
  EXPECT_TRUE(waiting.asked_ms.empty());
  waiting.bench.estimator.finish();
  EXPECT_FALSE(waiting.bench.estimator.step());
  EXPECT_EQ(waiting.asked_ms, (std::vector<std::int64_t>{-1}));
}

TEST(EstimatorStart, OfAContinuationIsWhereTheImuWasWithTheBlocksOfThen) {
  EstimatorOptions options = testing::any_motion();
  Continuation::Place place;
  place.R_GtoI = exp_so3({0.1, -0.2, 2.5});
  place.p_IinG = {1., 2., 3.};
  place.t_ns = kStart - 4'000'000'000;
  place.speed_m_per_s = 0.5;
  options.continuation = {{{"base.clock", {0.009}}, {"unknown", {1.}}}, place};
  Bench bench({.cells = true}, {}, options);
  ImuPrior found = level_prior(kStart);
  found.state.v_IinG = {1., 0., 0.};
  found.P(kVelocityColumn, kVelocityColumn) = 4.;
  bench.estimator.start([&](const StartData&) -> StartAttempt { return {found, {}}; });
  bench.imu(0, 20);
  bench.estimator.step();
  const Filter& filter = bench.estimator.filter();
  ASSERT_TRUE(filter.initialized());
  std::vector<BlockEstimate> clock;
  for (int i = 0; i < static_cast<int>(filter.blocks().specs().size()); ++i) {
    if (filter.blocks().specs()[static_cast<std::size_t>(i)].name == "base.clock") {
      filter.estimates({i}, clock);
    }
  }
  ASSERT_EQ(clock.size(), 1U);
  EXPECT_EQ(clock[0].value, 0.009);
  EXPECT_EQ(clock[0].sigma, testing::base_clock(0.).entries[0].sigma) << "that of the prior";
  // Level stays level; what is left of the turn to the former orientation is none about the
  // vertical.
  const ImuState& imu = filter.imu();
  EXPECT_NEAR(imu.R_GtoI(2, 2), 1., 1e-12);
  const Eigen::Vector3d left = log_so3(imu.R_GtoI.transpose() * place.R_GtoI);
  EXPECT_NEAR(left.z(), 0., 1e-12);
  EXPECT_LT(left.norm(), 0.3);
  EXPECT_EQ(imu.p_IinG, place.p_IinG);
  // The velocity, and its covariance, are turned along.
  const Eigen::Vector3d v_IinI = imu.R_GtoI * imu.v_IinG;
  EXPECT_NEAR((v_IinI - found.state.R_GtoI * found.state.v_IinG).norm(), 0., 1e-12);
  const Eigen::Vector3d along = imu.v_IinG.normalized();
  const Eigen::Matrix3d P_v = filter.covariance().block<3, 3>(kVelocityColumn, kVelocityColumn);
  EXPECT_NEAR(along.dot(P_v * along), 4., 1e-12);
  // In the meantime it may have gone on.
  EXPECT_NEAR(filter.covariance()(kPositionColumn, kPositionColumn),
              found.P(kPositionColumn, kPositionColumn) + 4., 1e-9);
}

TEST(EstimatorStart, FromThereOnMakesEpochs) {
  Bench bench;
  int asked = 0;
  bench.estimator.start([&](const StartData& data) -> StartAttempt {
    ++asked;
    if (data.imu.size() < 21) return no_start("too short");
    return {level_prior(data.imu.back().t_ns), {}};
  });
  for (std::int64_t t = 0; t <= 400; t += 10) {
    bench.estimator.add(imu_at(kStart + t * kMs));
    if (t % 50 == 0) bench.tick(t);
    bench.estimator.step();
  }
  EXPECT_EQ(asked, 5);
  ASSERT_EQ(bench.update->seen.size(), 3u);  // 250, 300, 350: nothing is later than the last tick
  EXPECT_EQ(bench.update->seen[0].begin_ns, kStart + 200 * kMs);
  EXPECT_EQ(bench.update->seen[0].end_ns, kStart + 250 * kMs);
  EXPECT_EQ(bench.rejected(), (Counts{{"ticks: before the start", 5}}));
}

TEST(EstimatorStart, ForgetsWhatNoStartLooksAtWhileItWaitsForOne) {
  Waiting waiting;
  for (std::int64_t t = 0; t <= 600'000; t += 100) {
    waiting.bench.estimator.add(imu_at(kStart + t * kMs));
    if (t % 1000 == 0) waiting.bench.tick(t);
    EXPECT_FALSE(waiting.bench.estimator.step());
    if (t > 200'000) {
      EXPECT_GE(waiting.imu_span_ms, 59'900);
    }
  }
  EXPECT_LE(waiting.most_imu, 1202U);
  EXPECT_GT(waiting.rejected().at("ticks: before the start"), 400);
}

TEST(EstimatorStart, IsNotSpoiltByAStampInTheFuture) {
  // GIVEN a tick and a fix of an hour later; then the IMU for a second
  const std::int64_t ahead = kStart + 3600'000 * kMs;
  Waiting waiting;
  waiting.start_at_ms = 1000;
  waiting.bench.add(tick_at(ahead));
  waiting.bench.add(fix_at(ahead));
  for (std::int64_t t = 0; t <= 1300; t += 10) {
    waiting.bench.estimator.add(imu_at(kStart + t * kMs));
    waiting.bench.add(cell_at(kStart + t * kMs));
    waiting.bench.estimator.step();
    // THEN the start sees all of it
    if (!waiting.bench.estimator.filter().initialized()) {
      EXPECT_GE(waiting.imu_span_ms, t - 50);
    }
  }
  EXPECT_EQ(waiting.asked_ms.back(), 1000);
  EXPECT_TRUE(waiting.bench.estimator.filter().initialized());
  EXPECT_FALSE(waiting.bench.update->seen.empty());
}

TEST(EstimatorStart, IsGivenAMinuteOfCellsInTheirOwnClock) {
  for (const double late_s : {-1000., 1000.}) {
    Waiting waiting(late_s);
    const auto in_its_clock = [&](std::int64_t t) {
      return kStart + t * kMs - static_cast<std::int64_t>(late_s * 1e9);
    };
    for (std::int64_t t = 0; t <= 300'000; t += 100) {
      waiting.bench.estimator.add(imu_at(kStart + t * kMs));
      waiting.bench.add(cell_at(in_its_clock(t)));
      waiting.bench.estimator.step();
      const std::int64_t oldest = waiting.cells_begin_ms + static_cast<std::int64_t>(late_s * 1e3);
      if (t >= 60'000) {
        ASSERT_LE(oldest, t - 59'000);
      }
    }
    EXPECT_LE(waiting.most_cells, 1202u);
  }
}

TEST(EstimatorStart, ForgetsCellsThatHaveStopped) {
  Waiting waiting;
  for (std::int64_t t = 0; t <= 300'000; t += 100) {
    waiting.bench.estimator.add(imu_at(kStart + t * kMs));
    if (t <= 1000) waiting.bench.add(cell_at(kStart + t * kMs));
    waiting.most_cells = 0;
    waiting.bench.estimator.step();
  }
  EXPECT_EQ(waiting.most_cells, 0u);
}

TEST(EstimatorStart, DoesNotKeepWhatComesWithoutAnImu) {
  Waiting waiting;
  for (std::int64_t t = 0; t <= 600'000; t += 100) {
    waiting.bench.tick(t, 0);
    waiting.bench.tick(t, 1);
    waiting.bench.add(fix_at(kStart + t * kMs));
    waiting.bench.add(cell_at(kStart + t * kMs));
    waiting.bench.estimator.step();
  }
  waiting.bench.estimator.finish();
  waiting.bench.estimator.step();
  // At most two minutes are kept; each tick counts, also of the same instant.
  EXPECT_LE(waiting.most_cells, 1202u);
  const Counts rejected = waiting.rejected();
  EXPECT_GE(rejected.at("fixes: before the start"), 4800);
  EXPECT_EQ(rejected.at("ticks: before the start"), 2 * rejected.at("fixes: before the start"));
}

TEST(EstimatorStart, CountsTheFixesBeforeItAndGivesTheOthers) {
  Waiting waiting;
  waiting.start_at_ms = 100;
  for (std::int64_t t = 0; t <= 400; t += 10) {
    waiting.bench.estimator.add(imu_at(kStart + t * kMs));
    waiting.bench.add(cell_at(kStart + t * kMs));
    if (t == 150) waiting.bench.add(fix_at(kStart + 95 * kMs));  // it came late
    if (t < 60 || t > 150) waiting.bench.add(fix_at(kStart + t * kMs));
    if (t == 60) waiting.bench.add(fix_at(kStart + 65 * kMs));
    waiting.bench.estimator.step();
  }
  EXPECT_EQ(waiting.rejected(), (Counts{{"fixes: before the start", 8}}));
  const auto& seen = waiting.bench.update->seen;
  ASSERT_EQ(seen.size(), 1u);
  ASSERT_EQ(seen[0].fixes.size(), 20u);
  EXPECT_EQ(seen[0].fixes.front().t_ns, kStart + 160 * kMs);
}

TEST(EstimatorStart, CanLookAtAStreamThatNoUpdateTakes) {
  // GIVEN an update without cells, and a start that wants them
  const auto update = std::make_shared<testing::FakeUpdate>();
  StreamSpec cells = testing::cells_spec({});
  cells.awaited = false;
  Estimator estimator({}, {{"fake", update, nullptr, ""}}, {{cells, "start"}});
  ASSERT_EQ(estimator.streams().size(), 2u);
  EXPECT_EQ(estimator.streams()[1].takers(), "start");
  std::size_t shown = 0;
  estimator.start([&](const StartData& data) -> StartAttempt {
    shown = data.samples<CellSample>(StreamId{1}).size();
    if (data.imu.back().t_ns < kStart + 100 * kMs) return no_start("not yet");
    return {level_prior(data.imu.back().t_ns), {}};
  });
  for (std::int64_t t = 0; t <= 5000; t += 10) {
    estimator.add(imu_at(kStart + t * kMs));
    estimator.add(1, cell_at(kStart + t * kMs));
    while (estimator.step()) {
    }
  }
  // THEN it is shown them, and nobody is in their way later.
  EXPECT_EQ(shown, 11u);
  EXPECT_EQ(update->seen.size(), 19u);
  EXPECT_EQ(testing::rejected_by(estimator), Counts{});
}

}  // namespace
}  // namespace viwo

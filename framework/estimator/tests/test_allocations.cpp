// An epoch of an estimator does not touch the heap in the steady state, with blocks that come and
// go and samples of all kinds, also such as cannot be used.
#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "allocations.hpp"
#include "estimator_fixture.hpp"
#include "viwo/api/status.hpp"
#include "viwo/estimator/estimator.hpp"

namespace viwo {
namespace {

using testing::imu_at;
using testing::kMs;
using testing::kStart;

/// Adds a block in every epoch, rewrites the second oldest, drops the oldest, and measures.
class Busy final : public Update {
 public:
  void declare(Declarations& host) override {
    mount_ = host.block(testing::base_mount());
    const BlockId clock = host.block(testing::base_clock());
    BlockSpec slip = testing::numbers_block("slip", "s_", {0.}, {0.1});
    slip.process = Process::kGaussMarkov;
    slip.time_constant_s = 1.;
    slip.entries[0].process_sigma = 0.1;
    slip_ = host.block(slip);
    room_ = host.room({"points", 4, 3});
    ticks_ = host.stream(testing::ticks_spec(2));
    cells_ = host.stream(testing::cells_spec(clock));
    fixes_ = host.stream(testing::fixes_spec());
  }
  void start(const UpdateSetup&) override { mine_.reserve(8); }
  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override {
    samples += data.samples<testing::TickSample>(ticks_).size() +
               data.samples<testing::CellSample>(cells_).size() +
               data.samples<testing::FixSample>(fixes_).size();
    for (const int column : {filter.block(mount_).column(), filter.block(slip_).column()}) {
      ResidualFactor& factor = sink.add_residual();
      factor.columns.add(kPositionColumn, 3);
      factor.columns.add(column, 1);
      factor.set_rows(2);
      factor.H.setConstant(0.3);
      factor.H(0, 1) = 1.;
      factor.residual.setConstant(1e-3);
      factor.R.setIdentity();
      factor.gate_probability = 0.01;
    }
    InformationFactor& information = sink.add_information();
    information.columns.add(filter.clones.back().column, kPoseSize);
    int n = kPoseSize;
    if (const auto id = sink.add_block(room_, std::array{1., 2., 3.})) {
      mine_.push_back(*id);
      n = 3 + information.columns.add(filter.block(*id).column(), 3);
    }
    information.Lambda.topLeftCorner(n, n).setConstant(0.5);
    information.Lambda.topLeftCorner(n, n).diagonal().setConstant(20.);
    information.eta.head(n).setConstant(1e-3);
  }
  void settle(const FilterView& filter, BlockEdits& edits) override {
    if (mine_.size() >= 2) {
      BlockRewrite& anew = rewrite_;
      anew.id = mine_[1];
      anew.columns.clear();
      anew.columns.add(filter.block(mine_[1]).column(), 3);
      anew.columns.add(filter.clones.front().column, kPoseSize);
      anew.J.setZero(3, 9);
      anew.J.leftCols(3).setIdentity();
      edits.rewrite(anew);
      ++rewritten;
    }
    if (mine_.size() >= 3) {
      edits.drop(mine_.front());
      mine_.erase(mine_.begin());
      ++dropped;
    }
  }
  std::size_t samples = 0;
  int rewritten = 0, dropped = 0;

 private:
  BlockId mount_, slip_;
  RoomId room_;
  StreamId ticks_, cells_, fixes_;
  std::vector<BlockId> mine_;
  BlockRewrite rewrite_;
};

TEST(Allocations, ThereAreNoneInTheSteadyState) {
  if (!testing::counts_allocations()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  const auto busy = std::make_shared<Busy>();
  EstimatorOptions options = testing::any_motion();
  options.monitor.window_s = 1.;
  options.monitor.hold = true;
  Estimator estimator(options, {{"busy", busy, nullptr, ""}});
  estimator.start(testing::level_prior(kStart));
  ASSERT_EQ(estimator.streams().size(), 3u);
  const std::vector<testing::TickSample> shapes{testing::tick_at(0, 0), testing::tick_at(0, 1)};
  long allocations = 0;
  std::int64_t epochs = 0;
  for (std::int64_t t = 0; t <= 16'000; t += 5) {
    const std::int64_t t_ns = kStart + t * kMs;
    std::array<testing::TickSample, 2> ticks;
    std::copy(shapes.begin(), shapes.end(), ticks.begin());
    const bool warm = t > 8000;
    const std::int64_t before_epochs = estimator.epochs();
    const long before = testing::allocations();
    estimator.add(imu_at(t_ns));
    estimator.add(imu_at(t_ns - 1));  // not after the last
    if (t % 10 == 0) estimator.add(1, testing::cell_at(t_ns));
    if (t % 10 == 0) estimator.add(1, testing::cell_at(t_ns));  // once more
    if (t % 20 == 0) estimator.add(2, testing::FixSample{t_ns, 1.});
    if (t % 20 == 0) estimator.add(2, testing::FixSample{t_ns, testing::kNaN});
    if (t % 100 == 50) {
      for (testing::TickSample& tick : ticks) {
        tick.t_ns = t_ns;
        estimator.add(0, tick);
      }
    }
    while (estimator.step()) {
    }
    if (!warm) continue;
    allocations += testing::allocations() - before;
    epochs += estimator.epochs() - before_epochs;
  }
  EXPECT_EQ(allocations, 0);
  EXPECT_GT(epochs, 70);
  EXPECT_GT(busy->samples, 1000u);
  EXPECT_GT(busy->rewritten, 100);
  EXPECT_GT(busy->dropped, 100);
  EXPECT_EQ(estimator.failure(), "");
  EXPECT_EQ(estimator.failures()[0].count, 0) << estimator.failures()[0].cause;
  EXPECT_GT(estimator.counts()[0].applied, 200);
}

}  // namespace
}  // namespace viwo

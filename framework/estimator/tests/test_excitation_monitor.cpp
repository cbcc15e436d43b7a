// What the estimator's monitor says and holds, with an update that observes what the test wants.
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "estimator_fixture.hpp"
#include "viwo/estimator/estimator.hpp"

namespace viwo {
namespace {

using testing::Bench;
using testing::kMs;
using testing::kStart;
using testing::observation;
using testing::Wants;

/// A base that keeps its velocity; measurements every 100 ms.
void drive(Bench& bench, const Eigen::Vector3d& v, std::int64_t duration_ms) {
  ImuPrior prior = testing::level_prior(kStart);
  prior.state.v_IinG = v;
  bench.estimator.start(prior);
  for (std::int64_t t = -10; t <= duration_ms + 1000; t += 10) {
    bench.estimator.add(ImuSample{kStart + t * kMs, {}, {0., 0., 9.81}});
    if (t > 0 && t <= duration_ms && t % 100 == 0) bench.tick(t);
    bench.steps();
    if (bench.estimator.filter().t_ns() >= kStart + duration_ms * kMs) return;
  }
}

EstimatorOptions options(double window_s, bool hold = false) {
  EstimatorOptions options;
  options.filter.clones = 3;
  options.monitor.window_s = window_s;
  options.monitor.hold = hold;
  return options;
}

const Wants kWithBase{.cells = true};

/// The third of the numbers is observed well, the clock hardly.
void observe(const FilterView& filter, FactorSink& sink) {
  const int numbers = filter.block(testing::kBaseNumbersId).column();
  sink.add_residual() = observation(numbers + 2, Eigen::VectorXd::Zero(1), 0.001);
  Eigen::VectorXd late(1);
  late << 0.001;
  sink.add_residual() = observation(filter.block(testing::kBaseClockId).column(), late, 0.2);
}

std::vector<std::string> texts(const Estimator& estimator) {
  std::vector<std::string> out;
  for (const auto& warning : estimator.monitors()[0].warnings()) out.push_back(warning.text);
  return out;
}

TEST(ExcitationMonitor, CompressesNamesThatAreNumberedInARow) {
  const std::vector<std::string> names{"r_1",   "x_2",   "x_3",      "x_4", "y_2", "y_4",
                                       "b.r_1", "b.r_2", "baseline", "d9",  "d10"};
  EXPECT_EQ(compressed(names), "r_1, x_2..x_4, y_2, y_4, b.r_1, b.r_2, baseline, d9, d10");
  EXPECT_EQ(compressed({}), "");
}

TEST(ExcitationMonitor, WarnsOnceThatTheBaseStandsStill) {
  Bench bench(kWithBase, {}, options(2.));
  drive(bench, Eigen::Vector3d::Zero(), 1900);
  ASSERT_EQ(bench.estimator.monitors().size(), 1u);
  EXPECT_EQ(texts(bench.estimator), std::vector<std::string>{});  // the window is not full
  Bench longer(kWithBase, {}, options(2.));
  drive(longer, Eigen::Vector3d::Zero(), 6000);
  EXPECT_EQ(texts(longer.estimator),
            std::vector<std::string>{"standing still for 2 s: theta_x, theta_y, theta_z, p_x, p_y, "
                                     "p_z, late, n_1, n_3 cannot be learned - drive"});
  EXPECT_EQ(longer.estimator.monitors()[0].warnings()[0].t_ns, kStart + 2000 * kMs);
}

TEST(ExcitationMonitor, NamesOnlyWhatTheInformationAgreesIsHidden) {
  Bench bench(kWithBase, observe, options(2.));
  drive(bench, {1., 0., 0.}, 3000);
  EXPECT_EQ(texts(bench.estimator),
            (std::vector<std::string>{
                "no yaw rate for 2 s: theta_z, p_x, p_y, n_1 cannot be learned - turn",
                "constant speed and turn rate for 2 s: late cannot be learned - speed up, slow "
                "down or steer",
                "flat ground for 2 s: theta_x, theta_y, p_z cannot be learned - drive over slopes "
                "or hold them"}));
  const auto& monitor = bench.estimator.monitors()[0];
  const auto& first = monitor.warnings()[0].parameters;
  EXPECT_EQ(first, (std::vector<std::string>{"theta_z", "p_x", "p_y", "n_1"}));
  // 20 observations in the window: of a prior sigma of 0.02 with 0.001, and of 0.01 with 0.2.
  EXPECT_EQ(monitor.parameters().back(), "n_3");
  EXPECT_NEAR(monitor.sigma_ratio().back(), 1. / std::sqrt(1. + 20. * 400.), 1e-9);
  EXPECT_NEAR(monitor.sigma_ratio()[6], 1. / std::sqrt(1. + 20. / 400.), 1e-9);
  EXPECT_EQ(monitor.unexcited(), 8);
}

TEST(ExcitationMonitor, HoldsWhatIsNotExcitedAndNothingElse) {
  const auto late = [](const Bench& bench) {
    return bench.estimator.filter().blocks().view(testing::kBaseClockId).numbers()[0];
  };
  const auto sigma = [](const Bench& bench, BlockId id, std::size_t entry) {
    std::vector<BlockEstimate> estimates;
    bench.estimator.filter().estimates(id, estimates);
    return estimates[entry].sigma;
  };
  const BlockId clock = testing::kBaseClockId, numbers = testing::kBaseNumbersId;
  Bench bench(kWithBase, observe, options(2., true));
  drive(bench, {1., 0., 0.}, 500);
  const double held_at = late(bench), held_sigma = sigma(bench, clock, 0);
  const double other_sigma = sigma(bench, numbers, 2);
  EXPECT_GT(held_at, 0.004);  // nothing is held in the first period
  EXPECT_EQ(bench.estimator.filter().held().size(), 8);
  Bench longer(kWithBase, observe, options(2., true));
  drive(longer, {1., 0., 0.}, 4000);
  EXPECT_NEAR(late(longer), held_at, 1e-15);
  EXPECT_NEAR(sigma(longer, clock, 0), held_sigma, 1e-15);
  EXPECT_LT(sigma(longer, numbers, 2), 0.5 * other_sigma);
  Bench free(kWithBase, observe, options(2.));
  drive(free, {1., 0., 0.}, 4000);
  EXPECT_GT(late(free), held_at + 1e-5);
  EXPECT_EQ(free.estimator.filter().held().size(), 0);
}

TEST(ExcitationMonitor, IsThereOnlyForGroupsOfWhichSomethingIsEstimated) {
  EXPECT_EQ(Bench(kWithBase, {}, options(2.)).estimator.monitors().size(), 1u);
  EstimatorOptions off = options(2.);
  off.monitor.enabled = false;
  EXPECT_TRUE(Bench(kWithBase, {}, off).estimator.monitors().empty());
  EXPECT_TRUE(Bench({}, {}, options(2.)).estimator.monitors().empty());
  EstimatorOptions wrong = options(2.);
  wrong.monitor.period_s = 0.;
  EXPECT_THROW(Bench(kWithBase, {}, wrong), std::invalid_argument);
  wrong.monitor.period_s = 0.001;
  EXPECT_THROW(Bench(kWithBase, {}, wrong), std::invalid_argument);
}

TEST(ExcitationMonitor, NeedsAPoseToKnowHowTheGroupMoves) {
  const StateBlocks blocks({testing::base_clock()}, {}, kImuSize);
  ASSERT_EQ(blocks.groups().size(), 1u);
  EXPECT_THROW(ExcitationMonitor({}, blocks, blocks.groups()[0]), std::invalid_argument);
}

/// Two groups, of which the second comes to see what the first is told.
class TwoBases final : public Update {
 public:
  void declare(Declarations& host) override {
    host.block(testing::base_mount());
    host.block(testing::base_numbers());
    const auto second = [](BlockSpec block) {
      block.name = "second." + block.name;
      block.group = "second";
      for (BlockEntry& entry : block.entries) entry.name = "second." + entry.name;
      return block;
    };
    host.block(second(testing::base_mount()));
    numbers_ = host.block(second(testing::base_numbers()));
    host.stream(testing::ticks_spec());
  }
  void update(const FilterView& filter, const EpochData&, FactorSink& sink) override {
    sink.add_residual() =
        observation(filter.block(numbers_).column(), Eigen::VectorXd::Zero(1), 1e-5);
  }

 private:
  BlockId numbers_;
};

TEST(ExcitationMonitor, OfOneGroupDoesNotCountWhatIsLearnedOfAnother) {
  Estimator estimator(options(2.), {{"two", std::make_shared<TwoBases>(), nullptr, ""}});
  ImuPrior prior = testing::level_prior(kStart);
  prior.state.v_IinG.x() = 1.;
  estimator.start(prior);
  for (std::int64_t t = 0; t <= 700; t += 10) {
    estimator.add(ImuSample{kStart + t * kMs, {}, {0., 0., 9.81}});
    if (t % 100 == 0) estimator.add(0, testing::tick_at(kStart + t * kMs));
    while (estimator.step()) {
    }
  }
  ASSERT_EQ(estimator.monitors().size(), 2u);
  EXPECT_EQ(estimator.monitors()[1].parameters().front(), "second.theta_x");
  const InformationWindow& first = estimator.monitors()[0].information();
  const InformationWindow& second = estimator.monitors()[1].information();
  EXPECT_EQ(second.columns().front(), first.columns().back() + 1);
  EXPECT_EQ(first.information().maxCoeff(), 0.);
  // Five observations of a prior sigma of 0.001 with 0.00001.
  EXPECT_NEAR(second.information().maxCoeff(), 5e4, 1.);
}

}  // namespace
}  // namespace viwo

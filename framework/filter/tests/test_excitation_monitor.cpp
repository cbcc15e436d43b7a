// What the estimator's monitor says and holds, with an update that observes what the test wants.
#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "estimator_fixture.hpp"
#include "viwo/filter/estimator.hpp"

namespace viwo {
namespace {

using testing::kIntrinsics;
using testing::kMs;
using testing::kStart;
using testing::kTimeOffset;
using testing::observation;
using testing::Rig;

/// A base that keeps its velocity; measurements every 100 ms.
void drive(Rig& rig, const Eigen::Vector3d& v, std::int64_t duration_ms) {
  ImuPrior prior = testing::level_prior(kStart);
  prior.state.v_IinG = v;
  rig.estimator.start(prior);
  for (std::int64_t t = -10; t <= duration_ms + 1000; t += 10) {
    rig.estimator.add(ImuSample{kStart + t * kMs, {}, {0., 0., 9.81}});
    if (t > 0 && t <= duration_ms && t % 100 == 0) rig.image(t);
    rig.steps();
    if (rig.estimator.filter().t_ns() >= kStart + duration_ms * kMs) return;
  }
}

EstimatorOptions options(double window_s, bool hold = false) {
  EstimatorOptions options;
  options.filter.clones = 3;
  options.monitor.window_s = window_s;
  options.monitor.hold = hold;
  return options;
}

/// The third intrinsic is observed well, the clock hardly.
void observe(const FilterView&, FactorSink& sink) {
  sink.add_residual() = observation(kIntrinsics + 2, Eigen::VectorXd::Zero(1), 0.001);
  Eigen::VectorXd late(1);
  late << 0.001;
  sink.add_residual() = observation(kTimeOffset, late, 0.2);
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
  Rig rig(true, {}, options(2.));
  drive(rig, Eigen::Vector3d::Zero(), 1900);
  ASSERT_EQ(rig.estimator.monitors().size(), 1u);
  EXPECT_EQ(texts(rig.estimator), std::vector<std::string>{});  // the window is not full
  Rig longer(true, {}, options(2.));
  drive(longer, Eigen::Vector3d::Zero(), 6000);
  EXPECT_EQ(texts(longer.estimator),
            std::vector<std::string>{
                "standing still for 2 s: theta_ItoO_x, theta_ItoO_y, theta_ItoO_z, p_IinO_x, "
                "p_IinO_y, p_IinO_z, t_OtoI, intrinsic_1, intrinsic_3 cannot be learned - drive"});
  EXPECT_EQ(longer.estimator.monitors()[0].warnings()[0].t_ns, kStart + 2000 * kMs);
}

TEST(ExcitationMonitor, NamesOnlyWhatTheInformationAgreesIsHidden) {
  Rig rig(true, observe, options(2.));
  drive(rig, {1., 0., 0.}, 3000);
  EXPECT_EQ(texts(rig.estimator),
            (std::vector<std::string>{
                "no yaw rate for 2 s: theta_ItoO_z, p_IinO_x, p_IinO_y, intrinsic_1 cannot be "
                "learned - turn",
                "constant speed and turn rate for 2 s: t_OtoI cannot be learned - speed up, slow "
                "down or steer",
                "flat ground for 2 s: theta_ItoO_x, theta_ItoO_y, p_IinO_z cannot be learned - "
                "drive over slopes or hold them"}));
  const auto& monitor = rig.estimator.monitors()[0];
  const auto& first = monitor.warnings()[0].parameters;
  EXPECT_EQ(first,
            (std::vector<std::string>{"theta_ItoO_z", "p_IinO_x", "p_IinO_y", "intrinsic_1"}));
  // 20 observations in the window: of a prior sigma of 0.02 with 0.001, and of 0.01 with 0.2.
  EXPECT_EQ(monitor.parameters().back(), "intrinsic_3");
  EXPECT_NEAR(monitor.sigma_ratio().back(), 1. / std::sqrt(1. + 20. * 400.), 1e-9);
  EXPECT_NEAR(monitor.sigma_ratio()[6], 1. / std::sqrt(1. + 20. / 400.), 1e-9);
  EXPECT_EQ(monitor.unexcited(), 8);
}

TEST(ExcitationMonitor, HoldsWhatIsNotExcitedAndNothingElse) {
  const auto t_OtoI = [](const Rig& rig) { return rig.estimator.filter().wheels()[0].t_OtoI_s; };
  const auto sigma = [](const Rig& rig, int at) {
    return std::sqrt(rig.estimator.filter().covariance()(at, at));
  };
  Rig rig(true, observe, options(2., true));
  drive(rig, {1., 0., 0.}, 500);
  const double held_at = t_OtoI(rig), held_sigma = sigma(rig, kTimeOffset);
  const double other_sigma = sigma(rig, kIntrinsics + 2);
  EXPECT_GT(held_at, 0.004);  // nothing is held in the first period
  EXPECT_EQ(rig.estimator.filter().held().size(), 8);
  Rig longer(true, observe, options(2., true));
  drive(longer, {1., 0., 0.}, 4000);
  EXPECT_NEAR(t_OtoI(longer), held_at, 1e-15);
  EXPECT_NEAR(sigma(longer, kTimeOffset), held_sigma, 1e-15);
  EXPECT_LT(sigma(longer, kIntrinsics + 2), 0.5 * other_sigma);
  Rig free(true, observe, options(2.));
  drive(free, {1., 0., 0.}, 4000);
  EXPECT_GT(t_OtoI(free), held_at + 1e-5);
  EXPECT_EQ(free.estimator.filter().held().size(), 0);
}

TEST(ExcitationMonitor, IsThereOnlyForWheelSetsOfWhichSomethingIsEstimated) {
  EstimatorOptions off = options(2.);
  off.monitor.enabled = false;
  EXPECT_TRUE(Rig(true, {}, off).estimator.monitors().empty());
  EXPECT_TRUE(Rig(false, {}, options(2.)).estimator.monitors().empty());
  EstimatorOptions wrong = options(2.);
  wrong.monitor.period_s = 0.;
  EXPECT_THROW(Rig(true, {}, wrong), std::invalid_argument);
  wrong.monitor.period_s = 0.001;
  EXPECT_THROW(Rig(true, {}, wrong), std::invalid_argument);
}

}  // namespace
}  // namespace viwo

// What is known of a base whose first wheel, which places O, is not where the drawing has it.
#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "simulated_calibration.hpp"
#include "viwo/math/se2.hpp"
#include "viwo/wheel/held_gauge.hpp"

namespace viwo {
namespace {

using namespace calibration;
using testing::setup_of;

/// The robot whose first steering zero is off by `rad`, as it is in the frame in which that zero is
/// nominal again: turned about the first wheel.
Intrinsics in_held_frame(const WheelModel& model, double rad) {
  const Intrinsics nominal = model.nominal();
  const int x_1 = model.find("x_1"), y_1 = model.find("y_1"), zero = model.find("delta_o1");
  const Eigen::Vector2d p(nominal[x_1], nominal[y_1]);
  Intrinsics best = nominal;
  double left = HUGE_VAL;
  for (const double yaw : {rad, -rad}) {
    Intrinsics x = nominal;
    x[zero] += rad;
    const Eigen::Vector2d q = p - Eigen::Rotation2Dd(yaw) * p;
    EXPECT_EQ(model.model().move_frame({yaw, q.x(), q.y()}, x), Status::kOk);
    const double off = std::abs(x[zero] - nominal[zero]);
    if (off < left) best = x;
    left = std::min(left, off);
  }
  EXPECT_LT(left, 1e-9);
  EXPECT_NEAR(best[x_1], nominal[x_1], 1e-9);
  EXPECT_NEAR(best[y_1], nominal[y_1], 1e-9);
  return best;
}

TEST(HeldPrior, HasInTheOthersWhatTheHeldMayBeOffBy) {
  const auto setup = setup_of({"figure_eight"}, 1);
  const WheelModel& model = *setup.recordings[0].setup.model;
  Intrinsics sigma = Intrinsics::Zero(model.n_intrinsics());
  constexpr double kSigma = 1e-3;
  sigma[model.find("delta_o1")] = kSigma;
  const Eigen::MatrixXd P = prior_in_held_frame(model, model.nominal(), sigma);
  const Intrinsics moved = in_held_frame(model, kSigma) - model.nominal();
  EXPECT_GT(moved.norm(), 0.1 * kSigma);
  // To the second order of the turn.
  EXPECT_LT((P - moved * moved.transpose()).norm(), 5. * kSigma * P.norm());
  EXPECT_EQ(P.row(model.find("delta_o1")).norm(), 0.);
}

// The body of the poses stays where it is when O turns about the first wheel.
TEST(HeldPrior, MovesTheBodyOfThePosesWithO) {
  const auto setup = setup_of({"figure_eight"}, 1);
  const WheelModel& model = *setup.recordings[0].setup.model;
  const Intrinsics nominal = model.nominal();
  constexpr double kSigma = 1e-3, kKnown = 1e-9;
  Intrinsics sigma = Intrinsics::Zero(model.n_intrinsics());
  sigma[model.find("delta_o1")] = kSigma;
  const PlanarExtrinsics E(0.2, -0.1, 0.7);
  const Eigen::MatrixXd P =
      prior_in_held_frame(model, nominal, sigma, known_of_body(E, {kKnown, kKnown, kKnown}));
  const auto n = nominal.size();
  // Where the first wheel is in B, at the ends of what the zero may be off by.
  const Eigen::Vector2d wheel(nominal[model.find("x_1")], nominal[model.find("y_1")]);
  const Eigen::Vector3d at = compose(as_se2(E), {0., wheel.x(), wheel.y()});
  for (const double by : {1., -1.}) {
    const Eigen::Vector3d step = by * P.topRightCorner(n, 3).row(model.find("x_2")).transpose() /
                                 std::sqrt(P(model.find("x_2"), model.find("x_2")));
    const Eigen::Vector3d there = compose(as_se2(E + step), {0., wheel.x(), wheel.y()});
    EXPECT_LT((there - at).tail<2>().norm(), kSigma * kSigma);
    EXPECT_NEAR(std::abs(there[0] - at[0]), kSigma, 1e-3 * kSigma);
  }
}

TEST(HeldPrior, LeavesTheBodyWhereItIsHeld) {
  const auto setup = setup_of({"figure_eight"}, 1);
  const WheelModel& model = *setup.recordings[0].setup.model;
  const Eigen::MatrixXd P = prior_in_held_frame(model, model.nominal(), model.prior_sigma(),
                                                known_of_body({0.2, -0.1, 0.7}, {0., 0., 0.}));
  EXPECT_TRUE(P.bottomRows<3>().isZero(0.));
}

TEST(HeldPrior, OfWheelsThatAreWellKnownIsThatOfTheirSigmas) {
  const auto setup = setup_of({"figure_eight"}, 1);
  const WheelModel& model = *setup.recordings[0].setup.model;
  const Intrinsics sigma = model.prior_sigma();  // none of those that are held
  const Eigen::MatrixXd P = prior_in_held_frame(model, model.nominal(), sigma);
  EXPECT_LT((P.diagonal().cwiseSqrt().head(sigma.size()) - sigma).norm(), 1e-12);
}

// The zero of the first wheel is off by two of its sigmas, the places of the wheels are well known:
// in the held frame they are off by six of theirs.
TEST(HeldPrior, FindsARobotWhoseFirstWheelIsOff) {
  constexpr double kOff_rad = 0.04;
  std::vector<std::string> assignments{"sensors.simulator0.robot.steer_offset_rad=[0.04, 0, 0, 0]"};
  for (const std::string section : {"kinematics.", "sensors.simulator0.robot."}) {
    for (const char* sigma :
         {"sigma_drive_rad_per_s=", "sigma_steer_rad=", "sigma_lateral_m_per_s="}) {
      assignments.push_back(section + sigma + "0.0001");
    }
    assignments.push_back(section + "prior_sigma_steer_offset_rad=0.02");
    assignments.push_back(section + "prior_sigma_position_m=0.001");
  }
  CalibrationSetup setup = setup_of({"icr_sweep", "figure_eight"}, 1, assignments);
  // As drawn, but for that zero.
  const WheelModel& model = *setup.recordings[0].setup.model;
  const CalibrationEstimate estimate = testing::fit_all(setup);
  WheelsView robot;
  robot.x_WI = sim::perturbed_intrinsics(model.description(), 1., 1000);
  robot.x_WI[model.find("delta_o1")] += kOff_rad;
  ASSERT_TRUE(move_to_held_gauge(model, model.nominal(), robot));
  for (int i = 0; i < model.n_intrinsics(); ++i) {
    if (!(estimate.sigma[i] > 0.)) continue;
    EXPECT_NEAR(estimate.x_WI[i], robot.x_WI[i], 5. * estimate.sigma[i])
        << model.description().intrinsics[static_cast<std::size_t>(i)].name;
  }
}

}  // namespace
}  // namespace viwo

// The information of a window against what Kalman updates leave of a prior; the motion of a window
// against motions made up for it.
#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "filter_fixture.hpp"
#include "viwo/estimator/information_window.hpp"
#include "viwo/estimator/motion_window.hpp"
#include "viwo/filter/covariance.hpp"

namespace viwo {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::Random;

constexpr int kStateSize = 20;
constexpr int kWatched = 12;
const VectorXd kSigma = (VectorXd(5) << 0.1, 0.02, 0., 3., 0.5).finished();  // 14 is held

ResidualFactor random_rows(Random& random) {
  ResidualFactor factor;
  factor.columns.add(2, 6);
  factor.columns.add(kWatched, 5);
  factor.set_rows(3);
  factor.H = random.matrix(3, 11);
  const MatrixXd A = random.matrix(3, 3);
  factor.R = A * A.transpose() + 0.1 * MatrixXd::Identity(3, 3);
  return factor;
}

InformationWindow::Vector ones(int n) { return InformationWindow::Vector::Ones(n); }

TEST(InformationWindow, OfAResidualFactorIsWhatAnUpdateAddsToAnIndependentPrior) {
  Random random(21);
  const MatrixXd A = random.matrix(kWatched, kWatched);
  MatrixXd P = MatrixXd::Zero(kStateSize, kStateSize);
  P.topLeftCorner(kWatched, kWatched) =
      A * A.transpose() + 0.1 * MatrixXd::Identity(kWatched, kWatched);
  P.diagonal().segment(kWatched, 5) = kSigma.cwiseAbs2();
  const ResidualFactor factor = random_rows(random);
  InformationWindow window(kWatched, kSigma, 2);
  ASSERT_TRUE(window.measure(factor, P));
  window.add();
  window.decompose(ones(4));

  Covariance covariance(kStateSize);
  covariance.set_block(0, P);
  VectorXd dx(kStateSize);
  ASSERT_EQ(covariance.apply(factor, dx), FactorResult::kApplied);
  const std::vector<int> columns(window.columns().begin(), window.columns().end());
  EXPECT_EQ(columns, (std::vector{12, 13, 15, 16}));
  const MatrixXd after = covariance.matrix()(columns, columns);
  const VectorXd sigma = window.sigma();
  const MatrixXd information = sigma.asDiagonal() * after.inverse() * sigma.asDiagonal() -
                               MatrixXd(MatrixXd::Identity(4, 4));
  const MatrixXd V = window.directions();
  EXPECT_LT((V * window.information().asDiagonal() * V.transpose() - information).norm(),
            1e-9 * information.norm());
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(window.sigma_ratio(i), std::sqrt(after(i, i)) / sigma[i], 1e-12);
  }
}

TEST(InformationWindow, OfAnInformationFactorIsItsBlockInUnitsOfThePrior) {
  Random random(22);
  const MatrixXd rows = random.matrix(30, 6);
  InformationFactor factor;
  factor.columns.add(15, 2);  // parameters 2 and 3
  factor.columns.add(4, 3);
  factor.columns.add(13, 1);  // parameter 1
  factor.Lambda = MatrixXd::Constant(kStateSize, kStateSize, std::nan(""));
  factor.Lambda.topLeftCorner(6, 6).triangularView<Eigen::Lower>() = rows.transpose() * rows;
  InformationWindow window(kWatched, kSigma, 1);
  ASSERT_TRUE(window.measure(factor));
  window.add();
  window.decompose(ones(4));
  MatrixXd scaled = MatrixXd::Zero(30, 4);
  scaled.col(1) = 0.02 * rows.col(5);
  scaled.col(2) = 3. * rows.col(0);
  scaled.col(3) = 0.5 * rows.col(1);
  const MatrixXd V = window.directions();
  EXPECT_LT(
      (V * window.information().asDiagonal() * V.transpose() - scaled.transpose() * scaled).norm(),
      1e-9);
  EXPECT_EQ(window.sigma_ratio(0), 1.);  // nothing was learned
}

TEST(InformationWindow, ForgetsTheOldestBinAndCountsOnlyWhatIsBelieved) {
  InformationWindow window(kWatched, VectorXd::Ones(2), 3);
  const MatrixXd P = MatrixXd::Identity(kStateSize, kStateSize);
  const auto add = [&](double sigma) {
    ASSERT_TRUE(window.measure(testing::observation(kWatched, VectorXd::Zero(2), sigma), P));
    window.add();
  };
  add(0.5);  // information 4
  window.next_bin();
  add(1.);
  add(1.);
  window.next_bin();
  window.decompose(ones(2));
  EXPECT_NEAR(window.information()[0], 6., 1e-12);
  window.next_bin();  // takes the place of the first
  window.decompose(ones(2));
  EXPECT_NEAR(window.information()[0], 2., 1e-12);
  window.decompose(Eigen::Vector2d(0.25, 1.));
  EXPECT_NEAR(window.information()[0], 0.5, 1e-12);
  EXPECT_NEAR(window.information()[1], 2., 1e-12);
}

TEST(InformationWindow, SeesNothingInFactorsOfOtherColumnsOrThatAreNotFinite) {
  InformationWindow window(kWatched, kSigma, 2);
  const MatrixXd P = MatrixXd::Identity(kStateSize, kStateSize);
  EXPECT_FALSE(window.measure(testing::observation(5, VectorXd::Zero(3), 1.), P));
  EXPECT_FALSE(window.measure(testing::observation(14, VectorXd::Zero(1), 1.), P));  // held
  ResidualFactor broken = testing::observation(kWatched, VectorXd::Zero(2), 1.);
  broken.H(0, 0) = std::nan("");
  EXPECT_FALSE(window.measure(broken, P));
  EXPECT_THROW(InformationWindow(0, VectorXd::Ones(40), 1), std::invalid_argument);
}

/// 50 samples of a motion with noise like that of an estimate.
template <class Twist>
MotionWindow motion(const Twist& twist, double tilt_rate = 0.) {
  Random random(23);
  MotionWindow window(5);
  for (int i = 0; i < 50; ++i) {
    const double t = 0.1 * i;
    const Vector3d xi = twist(t);
    const Vector3d v(xi.x(), xi.y(), 0.);
    const Vector3d w(tilt_rate * std::sin(3. * t), tilt_rate * std::cos(2. * t), xi.z());
    window.add(v + 0.002 * random.vector3(), w + 0.0005 * random.vector3(), 0.0005);
    if (i % 10 == 9 && i < 49) window.next_bin();
  }
  return window;
}

using Kinds = std::array<bool, kDegeneracies>;  // still, no yaw, steering, steady, flat

TEST(MotionWindow, TellsTheKindsApart) {
  const auto kinds = [](auto twist, double tilt_rate = 0.) {
    return motion(twist, tilt_rate).classify();
  };
  const auto still = [](double) { return Vector3d(0., 0., 0.); };
  EXPECT_EQ(kinds(still), (Kinds{true, false, false, false, false}));
  const auto straight = [](double) { return Vector3d(0.5, 0., 0.); };
  EXPECT_EQ(kinds(straight), (Kinds{false, true, false, true, true}));
  const auto faster = [](double t) { return Vector3d(0.5 + 0.2 * t, 0., 0.); };
  EXPECT_EQ(kinds(faster, 0.1), (Kinds{false, true, false, false, false}));
  const auto crab = [](double t) { return Vector3d(0.5 * std::cos(t), 0.5 * std::sin(t), 0.); };
  EXPECT_EQ(kinds(crab), (Kinds{false, true, false, false, true}));
  const auto circle = [](double) { return Vector3d(0.5, 0.1, 0.6); };
  EXPECT_EQ(kinds(circle), (Kinds{false, false, true, true, true}));
  const auto faster_circle = [](double t) -> Vector3d {
    return (1. + 0.5 * std::sin(t)) * Vector3d(0.5, 0.1, 0.6);
  };
  EXPECT_EQ(kinds(faster_circle, 0.1), (Kinds{false, false, true, false, false}));
  const auto spin = [](double) { return Vector3d(0., 0., 0.6); };
  EXPECT_EQ(kinds(spin), (Kinds{false, false, true, true, true}));
  const auto sweep = [](double t) { return Vector3d(0.5, 0.3 * std::sin(t), 0.6 * std::cos(t)); };
  EXPECT_EQ(kinds(sweep, 0.1), (Kinds{}));
  EXPECT_EQ(MotionWindow(3).classify(), (Kinds{}));
}

TEST(MotionWindow, TakesNoiseAndTheErrorOfABiasOffTheTiltRates) {
  const auto straight = [](double) { return Vector3d(0.5, 0., 0.); };
  EXPECT_EQ(motion(straight).tilt_signal(), 0.);
  // Rates of 0.01 sin and cos: variance 1e-4 of both axes together; noise 2 x 0.0005^2, twice.
  const double expected = 1. - 2. * 2. * 0.0005 * 0.0005 / 1e-4;
  EXPECT_NEAR(motion(straight, 0.01).tilt_signal(), expected, 0.002);
  EXPECT_GT(motion(straight, 0.1).tilt_signal(), 0.999);
  MotionWindow biased(1);
  for (int i = 0; i < 10; ++i) biased.add({0.5, 0., 0.}, {0.02, -0.01, 0.}, 0.0005);
  EXPECT_EQ(biased.tilt_signal(), 0.);
  EXPECT_EQ(MotionWindow(1).tilt_signal(), 0.);
}

}  // namespace
}  // namespace viwo

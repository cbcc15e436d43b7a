// Laws of the groups, at zero, where series take over, at random and near half a turn; what is
// known in closed form of the rest.
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "viwo/math/chi2.hpp"
#include "viwo/math/rpy.hpp"
#include "viwo/math/se2.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/math/trajectory.hpp"
#include "viwo/math/utf8.hpp"
#include "viwo/testing/jacobian.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

std::vector<Vector3d> rotation_vectors() {
  std::mt19937_64 random(7);
  std::normal_distribution<double> gaussian;
  std::vector<Vector3d> vectors{Vector3d::Zero()};
  for (const double length : {1e-12, 1e-8, 1e-5, 1e-4, 1e-3, 0.1, 1., 2., 3., 3.14, 3.1415926}) {
    for (int i = 0; i < 5; ++i) {
      const Vector3d direction(gaussian(random), gaussian(random), gaussian(random));
      vectors.emplace_back(length * direction.normalized());
    }
  }
  return vectors;
}

TEST(So3, ExponentialIsThatOfTheMatrix) {
  for (const Vector3d& phi : rotation_vectors()) {
    // The power series, of an angle that is halved until it converges at once.
    Matrix3d term = Matrix3d::Identity(), series = term;
    for (int k = 1; k < 30; ++k) series += term = term * skew(phi) / 1024. / k;
    for (int k = 0; k < 10; ++k) series = series * series;
    EXPECT_LT((exp_so3(phi) - series).cwiseAbs().maxCoeff(), 1e-11) << phi.transpose();
  }
}

TEST(So3, LogarithmUndoesTheExponential) {
  for (const Vector3d& phi : rotation_vectors()) {
    EXPECT_LT((log_so3(exp_so3(phi)) - phi).norm(), 1e-8 * (1. + phi.norm())) << phi.transpose();
    const Matrix3d R = exp_so3(phi);
    EXPECT_LT((exp_so3(log_so3(R)) - R).cwiseAbs().maxCoeff(), 1e-8) << phi.transpose();
  }
}

TEST(So3, RightJacobianIsThatOfCentralDifferencesAndHasItsInverse) {
  for (const Vector3d& phi : rotation_vectors()) {
    const Eigen::MatrixXd numeric = testing::central_difference(
        [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
          return log_so3(exp_so3(phi).transpose() * exp_so3(phi + d));
        },
        Vector3d::Zero(), 1e-5);
    EXPECT_EQ(testing::jacobian_mismatch(right_jacobian_so3(phi), numeric, {}, 1e-6), "")
        << phi.transpose();
    const Matrix3d product = right_jacobian_inverse_so3(phi) * right_jacobian_so3(phi);
    EXPECT_LT((product - Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-6) << phi.transpose();
  }
}

TEST(So3, SkewIsTheCrossProduct) {
  const Vector3d a(0.3, -1.2, 2.), b(-0.7, 0.4, 0.9);
  EXPECT_LT((skew(a) * b - a.cross(b)).norm(), 1e-15);
}

TEST(So3, TheNearestRotationIsOneAndUndoesWhatRoundingDid) {
  const Matrix3d R = exp_so3({0.3, -0.8, 1.1});
  Matrix3d drifted = R;
  drifted(0, 1) += 1e-9;
  const Matrix3d nearest = normalized_rotation(drifted);
  EXPECT_LT((nearest * nearest.transpose() - Matrix3d::Identity()).norm(), 1e-14);
  EXPECT_LT((nearest - R).norm(), 2e-9);
}

TEST(Se2, IsAGroup) {
  const Vector3d a(0.4, 1., -2.), b(-1.3, 0.5, 0.7), c(2.9, -0.1, 0.3);
  EXPECT_LT((compose(compose(a, b), c) - compose(a, compose(b, c))).norm(), 1e-14);
  EXPECT_LT((compose(a, between(a, b)) - b).norm(), 1e-14);
  EXPECT_LT(between(a, a).norm(), 1e-15);
  EXPECT_LT((compose(Vector3d::Zero(), a) - a).norm(), 1e-15);
}

TEST(Se2, ATurnToTheLeftTurnsForwardToTheLeft) {
  const double half_pi = std::numbers::pi / 2.;
  EXPECT_LT((compose({half_pi, 0., 0.}, {0., 1., 0.}) - Vector3d(half_pi, 0., 1.)).norm(), 1e-15);
  EXPECT_LT((J2() * Eigen::Vector2d(1., 0.) - Eigen::Vector2d(0., 1.)).norm(), 1e-15);
}

TEST(Se2, LogarithmIsTheTwistOfTheArc) {
  // A quarter of a circle of radius 2, to the left: its length is the speed in unit time.
  const double quarter = std::numbers::pi / 2.;
  EXPECT_LT((log_se2({quarter, 2., 2.}) - Vector3d(quarter, 2. * quarter, 0.)).norm(), 1e-14);
  EXPECT_LT((log_se2({0., 0.3, -0.4}) - Vector3d(0., 0.3, -0.4)).norm(), 1e-15);
  EXPECT_LT((log_se2({1e-9, 1., 0.}) - Vector3d(1e-9, 1., -0.5e-9)).norm(), 1e-14);
}

TEST(Se2, SincIsSmoothThroughZero) {
  for (const double z : {-1e-3, -1e-7, 0., 1e-9, 1e-4, 0.5, 3.}) {
    const double value = z == 0. ? 1. : std::sin(z) / z;
    EXPECT_NEAR(sinc(z).value, value, 1e-15) << z;
    const double h = 1e-5, derivative = (sinc(z + h).value - sinc(z - h).value) / (2. * h);
    EXPECT_NEAR(sinc(z).derivative, derivative, 1e-9) << z;
  }
}

TEST(Se2, AnglesAreWrappedToHalfATurn) {
  EXPECT_DOUBLE_EQ(wrap_angle(3. * std::numbers::pi / 2.), -std::numbers::pi / 2.);
  EXPECT_DOUBLE_EQ(wrap_angle(std::numbers::pi), std::numbers::pi);
  EXPECT_DOUBLE_EQ(wrap_angle(-7.), -7. + 2. * std::numbers::pi);
}

TEST(Chi2, HasTheQuantilesOfTables) {
  EXPECT_NEAR(chi2_quantile(0.95, 1.), 3.841, 5e-4);
  EXPECT_NEAR(chi2_quantile(0.95, 3.), 7.815, 5e-4);
  EXPECT_NEAR(chi2_quantile(0.99, 6.), 16.812, 5e-4);
  EXPECT_NEAR(chi2_quantile(0.05, 100.), 77.929, 5e-4);
}

TEST(Interpolation, IsLinearInPlaceAndEvenInTurnsAndStopsAtGaps) {
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(1., Vector3d::UnitZ()));
  const Trajectory way{{0, {0., 0., 0.}, Eigen::Quaterniond::Identity()},
                       {1'000'000'000, {4., 0., 0.}, turned},
                       {5'000'000'000, {4., 4., 0.}, turned}};
  const auto quarter = interpolate(way, 250'000'000, 1.5);
  ASSERT_TRUE(quarter);
  EXPECT_LT((planar(*quarter) - Vector3d(0.25, 1., 0.)).norm(), 1e-14);
  EXPECT_FALSE(interpolate(way, 2'000'000'000, 1.5));
  EXPECT_FALSE(interpolate(way, -1, 1.5));
  EXPECT_FALSE(interpolate(way, 5'000'000'001, 1.5));
  EXPECT_TRUE(interpolate(way, 5'000'000'000, 1.5));
}

TEST(Utf8, KeepsCharactersAndReplacesEachOtherByte) {
  const std::string no = "\xef\xbf\xbd";
  const auto expect = [](const std::string& text, const std::string& expected) {
    EXPECT_EQ(valid_utf8(text), expected);
  };
  // The first and the last character of each length, and those beside the halves of pairs.
  for (const std::string text :
       {"plain", "\x7f", "\xc2\x80", "\xdf\xbf", "\xe0\xa0\x80", "\xed\x9f\xbf", "\xee\x80\x80",
        "\xef\xbf\xbf", "\xf0\x90\x80\x80", "\xf4\x8f\xbf\xbf", "caf\xc3\xa9 \xf0\x9f\x9a\x97!"}) {
    expect(text, text);
  }
  expect("", "");
  expect(std::string("a\0b", 3), std::string("a\0b", 3));
  expect("caf\xe9", "caf" + no);
  expect("\xe9t\xe9", no + "t" + no);
  expect("a\x80z", "a" + no + "z");      // follows nothing
  expect("\xc3", no);                    // ends in its middle
  expect("\xe2\x82<", no + no + "<");    // goes on as something else
  expect("\xf0\x9f\x9a", no + no + no);  // ends in its middle
  expect("\xc0\xaf", no + no);           // a detour to '/'
  expect("\xe0\x80\xaf", no + no + no);  // a longer one
  expect("\xf0\x80\x80\xaf", no + no + no + no);
  expect("\xed\xa0\x80", no + no + no);           // half of a pair
  expect("\xf4\x90\x80\x80", no + no + no + no);  // beyond the last
  expect("\xf5\xff\xfe", no + no + no);           // in no text at all
}

TEST(Rpy, TurnsAboutFixedAxesInTheirOrder) {
  // Each axis by hand: roll takes y to z, then pitch z to x, then yaw x to y.
  const Eigen::Vector3d y = rotation_of_rpy({M_PI_2, M_PI_2, M_PI_2}) * Eigen::Vector3d::UnitY();
  EXPECT_NEAR((y - Eigen::Vector3d::UnitY()).norm(), 0., 1e-12);
  const Eigen::Vector3d x = rotation_of_rpy({0.3, M_PI_2, 0.}) * Eigen::Vector3d::UnitX();
  EXPECT_NEAR((x + Eigen::Vector3d::UnitZ()).norm(), 0., 1e-12);
  for (const Eigen::Vector3d& rpy :
       {Eigen::Vector3d(0.1, -0.7, 2.5), Eigen::Vector3d(-3., 1.5, -0.2),
        Eigen::Vector3d::Zero().eval()}) {
    EXPECT_NEAR((rpy_of_rotation(rotation_of_rpy(rpy)) - rpy).norm(), 0., 1e-12);
  }
  for (const double pitch : {M_PI_2, -M_PI_2}) {
    const Eigen::Matrix3d R = rotation_of_rpy({0.4, pitch, 0.9});
    EXPECT_NEAR((rotation_of_rpy(rpy_of_rotation(R)) - R).norm(), 0., 1e-7) << "up or down";
  }
}

}  // namespace
}  // namespace viwo

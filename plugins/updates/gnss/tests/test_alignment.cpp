// Fixes in the local frame, and the yaw from two places that are known in both frames.
#include <cmath>
#include <numbers>
#include <random>

#include <GeographicLib/Geocentric.hpp>
#include <gtest/gtest.h>

#include "alignment.hpp"
#include "filter_fixture.hpp"
#include "local_frame.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using namespace gnss;

GnssSample at(double latitude_deg, double longitude_deg, double altitude_m) {
  GnssSample fix;
  fix.latitude_deg = latitude_deg;
  fix.longitude_deg = longitude_deg;
  fix.altitude_m = altitude_m;
  return fix;
}

/// Earth-centred, without LocalCartesian.
Vector3d earth_centred(const GnssSample& fix) {
  Vector3d p;
  GeographicLib::Geocentric::WGS84().Forward(fix.latitude_deg, fix.longitude_deg, fix.altitude_m,
                                             p.x(), p.y(), p.z());
  return p;
}

/// Columns: east, north and up there, by differences of positions on the ellipsoid and above it.
Matrix3d ENU_to_earth(const GnssSample& fix) {
  constexpr double kStepDeg = 1e-5, kStepM = 1.;
  GnssSample east = fix, west = fix, high = fix;
  east.longitude_deg += kStepDeg;
  west.longitude_deg -= kStepDeg;
  high.altitude_m += kStepM;
  Matrix3d R;
  R.col(0) = (earth_centred(east) - earth_centred(west)).normalized();
  R.col(2) = (earth_centred(high) - earth_centred(fix)).normalized();
  R.col(1) = R.col(2).cross(R.col(0));
  return R;
}

TEST(LocalFrame, HasAFixWhereEarthCentredCoordinatesHaveIt) {
  const GnssSample origin = at(42.3758, -71.1474, 7.3);
  LocalFrame frame(origin.latitude_deg, origin.longitude_deg, origin.altitude_m);
  for (const GnssSample& fix : {origin, at(42.3858, -71.1374, 30.), at(42.2, -71.4, -20.)}) {
    const Vector3d expected =
        ENU_to_earth(origin).transpose() * (earth_centred(fix) - earth_centred(origin));
    EXPECT_LT((frame.at(fix, {}).p_AinE - expected).norm(), 1e-4);
  }
}

TEST(LocalFrame, TurnsAndScalesTheCovarianceThatComesWithAFix) {
  const GnssSample origin = at(42., -71., 0.);
  LocalFrame frame(42., -71., 0.);
  GnssSample fix = at(42.5, -70., 0.);  // east of the origin north points elsewhere
  fix.covariance_ENU_m2 = {4., 1., 0., 1., 9., 0.5, 0., 0.5, 25.};
  Matrix3d C;
  C << 4., 1., 0., 1., 9., 0.5, 0., 0.5, 25.;
  const Matrix3d M = ENU_to_earth(origin).transpose() * ENU_to_earth(fix);
  EXPECT_GT((M - Matrix3d::Identity()).norm(), 0.01);
  EXPECT_LT((frame.at(fix, {}).R - M * C * M.transpose()).norm(), 1e-7);
  EXPECT_LT((frame.at(fix, {1., 2.}).R - 4. * M * C * M.transpose()).norm(), 1e-7);
}

TEST(LocalFrame, TakesTheConfiguredSigmaForAFixWithoutCovariance) {
  LocalFrame frame(42., -71., 0.);
  GnssSample fix = at(42., -71., 0.);
  fix.covariance_ENU_m2 = {4., 0., 0., 0., 4., 0., 0., 0., 0.};  // of the height nothing is known
  EXPECT_TRUE(frame.at(fix, {1.5, 2.}).R.isApprox(9. * Matrix3d::Identity()));
}

Baseline baseline_of(double yaw, const Vector3d& in_G, double sigma_G, double sigma_E) {
  Baseline baseline;
  baseline.in_G = in_G;
  baseline.P_G = sigma_G * sigma_G * Matrix3d::Identity();
  baseline.in_E = R_GtoE(yaw) * in_G;
  baseline.P_E = sigma_E * sigma_E * Matrix3d::Identity();
  return baseline;
}

TEST(YawOfTwoPlaces, IsExactForExactPlacesAtAnyYaw) {
  for (double yaw = -3.1; yaw < 3.2; yaw += 0.1) {
    const YawGuess guess = yaw_of(baseline_of(yaw, {3., -4., 1.}, 0.03, 0.04));
    EXPECT_NEAR(std::remainder(guess.yaw_EtoG - yaw, 2. * std::numbers::pi), 0., 1e-12);
    EXPECT_NEAR(guess.sigma_rad, 0.05 / 5., 1e-12);
    EXPECT_NEAR(guess.chi2, 0., 1e-20);
  }
}

TEST(YawOfTwoPlaces, IsNotKnownAboveEachOther) {
  EXPECT_EQ(yaw_of(baseline_of(1., {0., 0., 3.}, 0.1, 0.1)).sigma_rad,
            std::numeric_limits<double>::infinity());
}

TEST(YawOfTwoPlaces, TakesTheLargerHorizontalAxisOfTheirNoise) {
  Baseline baseline = baseline_of(0., {10., 0., 0.}, 0., 0.);
  baseline.P_G << 5., 3., 0., 3., 5., 0., 0., 0., 100.;  // 2 and 8 along the diagonals
  baseline.P_E(1, 1) = 1.;
  EXPECT_NEAR(yaw_of(baseline).sigma_rad, std::sqrt(8. + 1.) / 10., 1e-12);
}

TEST(YawOfTwoPlaces, IsAsGoodAsItSaysAndItsChiSquareIsAtMostThatOfThreeDimensions) {
  constexpr int kTrials = 2000;
  constexpr double kSigma = 0.2;
  std::mt19937_64 rng(5);
  double squared = 0., chi2 = 0., chi2_at_rest = 0.;
  for (int trial = 0; trial < kTrials; ++trial) {
    Baseline baseline = baseline_of(2.5, {3., 4., 0.5}, kSigma, 0.);
    baseline.in_E += kSigma * Vector3d(testing::gaussian(3, rng));
    const YawGuess guess = yaw_of(baseline);
    squared +=
        std::pow(std::remainder(guess.yaw_EtoG - 2.5, 2. * std::numbers::pi) / guess.sigma_rad, 2);
    chi2 += guess.chi2;
    baseline.in_E -= R_GtoE(2.5) * baseline.in_G;
    baseline.in_G.setZero();
    chi2_at_rest += yaw_of(baseline).chi2;
  }
  // Five sigma of the mean; two of three dimensions when the places are apart, three at one place.
  EXPECT_NEAR(squared / kTrials, 1., 5. * std::sqrt(2. / kTrials));
  EXPECT_NEAR(chi2 / kTrials, 2., 5. * std::sqrt(4. / kTrials));
  EXPECT_NEAR(chi2_at_rest / kTrials, 3., 5. * std::sqrt(6. / kTrials));
}

TEST(YawOfTwoPlaces, ShowsPlacesThatAreFurtherApartInOneFrame) {
  Baseline baseline = baseline_of(1., {10., 0., 0.}, 0.6, 0.8);
  baseline.in_E *= 1.5;
  EXPECT_NEAR(yaw_of(baseline).chi2, 25., 1e-9);
}

}  // namespace
}  // namespace viwo

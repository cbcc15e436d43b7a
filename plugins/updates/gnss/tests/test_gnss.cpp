// The factors of fixes whose yaw is known: where they are zero, their derivatives, what they cannot
// tell, what is left out.
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <GeographicLib/Geocentric.hpp>
#include <GeographicLib/LocalCartesian.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "alignment.hpp"
#include "allocations.hpp"
#include "filter_fixture.hpp"
#include "local_frame.hpp"
#include "viwo/sim/planar_motion.hpp"
#include "viwo/testing/jacobian.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::UpdateHost;

constexpr double kYaw = 2.2;
const Vector3d kOrigin(5., -3., 1.);
const Vector3d kLever(0.2, -0.1, 0.5);
constexpr char kKnown[] =
    "{type: gnss, p_AinI_m: [0.2, -0.1, 0.5], yaw_EtoG_rad: 2.2, sigma_yaw_rad: 0.1, "
    "p_EinG_m: [5, -3, 1], sigma_p_EinG_m: 0.2, origin_deg: [48.14, 11.58], origin_altitude_m: 520";

/// A drive over a tilted plane with a clone every 0.2 s, and what a receiver says at any time.
class Fixes : public ::testing::Test {
 protected:
  static constexpr double kPeriod = 0.2;

  Fixes() : motion_("icr_sweep", {.ramp_s = 0.}) {
    for (int k = 0; k < 4; ++k) truth_.clones.push_back(at(1. + kPeriod * k, k));
  }

  CloneView at(double t_s, int slot) const {
    sim::PoseIntegrator pose(motion_);
    return drive_.clone(std::llround(t_s * 1e9), slot, pose.advance_to(t_s), motion_.twist(t_s));
  }

  GnssSample fix(double t_s) const {
    const CloneView imu = at(t_s, 0);
    const Vector3d p =
        gnss::R_GtoE(kYaw) * (imu.p_IinG + imu.R_GtoI.transpose() * kLever - kOrigin);
    const GeographicLib::LocalCartesian frame(48.14, 11.58, 520.);
    GnssSample fix;
    fix.t_ns = imu.t_ns;
    frame.Reverse(p.x(), p.y(), p.z(), fix.latitude_deg, fix.longitude_deg, fix.altitude_m);
    fix.covariance_ENU_m2 = {0.04, 0.01, 0., 0.01, 0.09, 0., 0., 0., 0.25};
    return fix;
  }

  /// Started in truth_, whose blocks then exist.
  std::shared_ptr<Update> load(const std::string& more = "") {
    const auto update = testing::load_update(kKnown + more + "}");
    truth_.start(*update);
    truth_.layout();
    truth_.set_priors();
    return update;
  }

  static std::vector<ResidualFactor> factors(Update& update, const UpdateHost& filter,
                                             const std::vector<GnssSample>& fixes) {
    FactorSink sink(16, 80);
    EpochData data = filter.epoch(fixes);
    data.end_ns = filter.clones.back().t_ns;
    update.update(filter.view(), data, sink);
    return {sink.residuals().begin(), sink.residuals().end()};
  }

  static std::map<std::string, std::int64_t> left_out(const Update& update) {
    std::vector<RejectionCount> all;
    update.rejections(all);
    std::map<std::string, std::int64_t> counts;
    for (const RejectionCount& r : all) counts[r.reason] = r.count;
    return counts;
  }

  testing::TiltedDrive drive_;
  sim::PlanarMotion motion_;
  UpdateHost truth_;
};

TEST_F(Fixes, AreWhereTheAntennaIsAtAnyTimeBetweenTwoClones) {
  const auto update = load();
  for (const double t : {1.0, 1.01, 1.05, 1.1, 1.17, 1.2, 1.21, 1.35, 1.5, 1.6}) {
    const auto made = factors(*update, truth_, {fix(t)});
    ASSERT_EQ(made.size(), 1u) << t;
    EXPECT_LT(made[0].residual.cwiseAbs().maxCoeff(), 3e-5) << t;
    const int first = made[0].columns.blocks()[0].first;
    EXPECT_EQ((first - kImuSize) / kPoseSize, t <= 1.2 ? 0 : t <= 1.4 ? 1 : 2) << t;
  }
  EXPECT_TRUE(left_out(*update).empty());
}

TEST_F(Fixes, HaveTheDerivativesOfCentralDifferencesByAllBlocks) {
  const auto update = load(", sigma_drift_m: 0.5, sigma_height_drift_m: 2");
  const auto residual = [&](const VectorXd& d) -> VectorXd {
    UpdateHost moved = truth_;
    moved.plus(d);
    return factors(*update, moved, {fix(1.27)})[0].residual;
  };
  const ResidualFactor factor = factors(*update, truth_, {fix(1.27)})[0];
  EXPECT_EQ(factor.columns.size(), 12 + 3 + 4 + 3);
  const auto size = truth_.P.rows();
  EXPECT_EQ(testing::jacobian_mismatch(-UpdateHost::spread(factor.columns, factor.H, size),
                                       testing::central_difference(residual, VectorXd::Zero(size)),
                                       {}, 1e-6),
            "");
}

TEST_F(Fixes, TellNothingOfATurnAndAShiftOfEverythingAlsoWhereFirstEstimatesAreOthers) {
  const auto update = load();
  factors(*update, truth_, {fix(1.1)});  // the first estimate of the alignment
  std::mt19937_64 rng(4);
  UpdateHost moved = truth_;
  moved.plus(0.05 * testing::gaussian(static_cast<int>(truth_.P.rows()), rng));
  const ResidualFactor factor = factors(*update, moved, {fix(1.27)})[0];
  const Eigen::MatrixXd H = UpdateHost::spread(factor.columns, factor.H, truth_.P.rows());
  const ResidualFactor before = factors(*update, truth_, {fix(1.27)})[0];
  EXPECT_GT((factor.H - before.H).cwiseAbs().maxCoeff(), 1e-3) << "the estimate counts for nothing";
  VectorXd turn = VectorXd::Zero(H.cols()), shift = turn;
  for (const CloneView& clone : truth_.clones) {
    turn.segment<3>(clone.column) = clone.R_GtoI_fej * Vector3d::UnitZ();
    turn.segment<3>(clone.column + 3) = Vector3d::UnitZ().cross(clone.p_IinG_fej);
    shift.segment<3>(clone.column + 3) << 1., 2., 3.;
  }
  const int alignment = factor.columns.blocks().back().first;
  turn[alignment] = 1.;
  turn.segment<3>(alignment + 1) = Vector3d::UnitZ().cross(kOrigin);
  shift.segment<3>(alignment + 1) << 1., 2., 3.;
  EXPECT_LT((H * turn).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((H * shift).cwiseAbs().maxCoeff(), 1e-12);
}

TEST_F(Fixes, AreLinearisedAtTheFirstOfThemWhereThePositionOfTheEarthIsNotKnown) {
  const auto update = testing::load_update(
      "{type: gnss, p_AinI_m: [0.2, -0.1, 0.5], yaw_EtoG_rad: 2.2, sigma_yaw_rad: 0.1}");
  truth_.start(*update);
  truth_.layout();
  truth_.set_priors();
  const auto made = factors(*update, truth_, {fix(1.1), fix(1.3)});
  ASSERT_EQ(made.size(), 2u);
  const CloneView imu = at(1.1, 0);
  const Vector3d first = imu.p_IinG + imu.R_GtoI.transpose() * kLever;
  // The origin of E is the first fix, the declared position of it zero.
  const Vector3d expected = gnss::R_GtoE(kYaw) * -first;
  EXPECT_LT((made[0].residual - expected).norm(), 1e-4);
  EXPECT_LT((made[1].residual - expected).norm(), 1e-4);
  EXPECT_LT(made[0].H.col(15).norm(), 1e-4) << "of its origin no yaw is seen";
  UpdateHost solved = truth_;
  FactorSink sink(16, 80);
  const std::vector later{fix(1.5)};
  EpochData data = truth_.epoch(later);
  update->update(truth_.view(), data, sink);
  // With the alignment that was found the residuals are zero.
  solved.numbers({1}) << kYaw, first;
  EXPECT_LT(factors(*update, solved, {fix(1.4)})[0].residual.norm(), 1e-4);
}

TEST_F(Fixes, HaveTheCovarianceOfTheMessageOrElseTheConfiguredOne) {
  const auto update = load(", sigma_m: 3, sigma_scale: 2");
  GnssSample without = fix(1.3);
  without.covariance_ENU_m2 = {};
  const auto made = factors(*update, truth_, {fix(1.25), without});
  ASSERT_EQ(made.size(), 2u);
  Matrix3d expected;
  expected << 0.16, 0.04, 0., 0.04, 0.36, 0., 0., 0., 1.;
  EXPECT_TRUE(made[0].R.isApprox(expected, 1e-4));
  EXPECT_TRUE(made[1].R.isApprox(Vector3d(36., 36., 36.).asDiagonal().toDenseMatrix(), 1e-4));
}

TEST_F(Fixes, AreTakenAtTheTimeOfTheirClock) {
  const auto update = load(", t_AtoI_s: -0.15");
  GnssSample late = fix(1.25);
  late.t_ns += 150'000'000;
  const auto made = factors(*update, truth_, {late});
  ASSERT_EQ(made.size(), 1u);
  EXPECT_LT(made[0].residual.cwiseAbs().maxCoeff(), 3e-5);
  ASSERT_EQ(truth_.streams.size(), 1u);
  EXPECT_EQ(truth_.streams[0].clocks.at(0).constant_s, -0.15);
}

TEST_F(Fixes, LeaveOutBlocksThatAreHeld) {
  const auto update = testing::load_update(
      "{type: gnss, p_AinI_m: [0.2, -0.1, 0.5], sigma_p_AinI_m: [0, 0, 0], yaw_EtoG_rad: 2.2, "
      "sigma_yaw_rad: 0, p_EinG_m: [5, -3, 1], sigma_p_EinG_m: 0, origin_deg: [48.14, 11.58], "
      "origin_altitude_m: 520}");
  truth_.start(*update);
  truth_.layout();
  const auto made = factors(*update, truth_, {fix(1.3)});
  ASSERT_EQ(made.size(), 1u);
  EXPECT_EQ(made[0].columns.size(), 12);
  EXPECT_LT(made[0].residual.cwiseAbs().maxCoeff(), 3e-5);
}

TEST_F(Fixes, AreCountedWhenTheyAreLeftOut) {
  const auto update = load();
  GnssSample indefinite = fix(1.3), elsewhere = fix(1.31), broken = fix(1.32);
  indefinite.covariance_ENU_m2[1] = indefinite.covariance_ENU_m2[3] = 1.;
  elsewhere.latitude_deg += 3.;
  broken.altitude_m = std::nan("");
  EXPECT_EQ(factors(*update, truth_, {fix(0.99), fix(1.1), indefinite, elsewhere, broken}).size(),
            1u);
  EXPECT_EQ(factors(*update, truth_, std::vector(20, fix(1.3))).size(), 15u);
  UpdateHost one = truth_;
  one.clones.erase(one.clones.begin(), one.clones.end() - 1);
  EXPECT_EQ(factors(*update, one, {fix(1.6)}).size(), 0u);
  EXPECT_EQ(left_out(*update), (std::map<std::string, std::int64_t>{
                                   {"fix that is older than the oldest clone", 2},
                                   {"fix whose covariance is not positive definite", 1},
                                   {"fix more than 100 km from the origin", 1},
                                   {"fix with values that cannot be used", 1},
                                   {"fix beyond 15 in an epoch", 5}}));
  const auto strict = testing::load_update(std::string(kKnown) + ", max_span_s: 0.1}");
  UpdateHost other = truth_;
  other.start(*strict);
  EXPECT_EQ(factors(*strict, truth_, {fix(1.3)}).size(), 0u);
  EXPECT_EQ(
      left_out(*strict),
      (std::map<std::string, std::int64_t>{{"fix between clones that are too far apart", 1}}));
}

TEST_F(Fixes, DoNotAllocate) {
  if (!testing::counts_allocations()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  const auto update = load(", sigma_drift_m: 0.5");
  const std::vector<GnssSample> fixes{fix(1.45), fix(1.5), fix(1.55)};
  factors(*update, truth_, {fix(1.3)});
  FactorSink sink(16, 80);
  const EpochData data = truth_.epoch(fixes);
  const FilterView view = truth_.view();
  const long before = testing::allocations();
  update->update(view, data, sink);
  EXPECT_EQ(testing::allocations() - before, 0);
  EXPECT_EQ(sink.residuals().size(), 3u);
}

std::string error_of(const std::string& parameters) {
  try {
    testing::load_update("{type: gnss, " + parameters + "}");
  } catch (const InputError& error) {
    return error.what();
  }
  return "(no error)";
}

TEST(GnssParameters, SayWhatContradictsWhat) {
  using ::testing::HasSubstr;
  EXPECT_THAT(error_of("p_AinI_m: [1, 2]"), HasSubstr("p_AinI_m: needs three numbers"));
  EXPECT_THAT(error_of("sigma_p_EinG_m: 0"),
              HasSubstr("origin_deg: is not given, but where it is in G"));
  EXPECT_THAT(error_of("origin_deg: [48, 11]"),
              HasSubstr("origin_deg: needs a yaw that is known: sigma_yaw_rad must be at most "
                        "alignment_sigma_rad"));
  EXPECT_THAT(error_of("sigma_yaw_rad: 0.1, origin_deg: [148, 11]"),
              HasSubstr("origin_deg: has a latitude beyond 90 degrees"));
  EXPECT_THAT(error_of("name: ''"), HasSubstr("name: must not be empty"));
}

/// Where a point is, by the textbook: from the ellipsoid to the centre of the Earth and back.
Vector3d in_local_frame(const GnssSample& fix, const std::array<double, 3>& origin) {
  const GeographicLib::Geocentric earth = GeographicLib::Geocentric::WGS84();
  const auto geocentric = [&](double latitude, double longitude, double altitude) {
    Vector3d p;
    earth.Forward(latitude, longitude, altitude, p.x(), p.y(), p.z());
    return p;
  };
  const double phi = origin[0] * M_PI / 180., lambda = origin[1] * M_PI / 180.;
  Matrix3d R;
  R << -std::sin(lambda), std::cos(lambda), 0.,  //
      -std::sin(phi) * std::cos(lambda), -std::sin(phi) * std::sin(lambda), std::cos(phi),
      std::cos(phi) * std::cos(lambda), std::cos(phi) * std::sin(lambda), std::sin(phi);
  return R * (geocentric(fix.latitude_deg, fix.longitude_deg, fix.altitude_m) -
              geocentric(origin[0], origin[1], origin[2]));
}

TEST(LocalFrame, IsEastNorthAndUpAtItsOrigin) {
  const std::array<double, 3> origin{48.14, 11.58, 520.};
  gnss::LocalFrame frame(origin[0], origin[1], origin[2]);
  GnssSample fix{0, 48.15, 11.61, 530., {}};
  fix.covariance_ENU_m2 = {1., 0., 0., 0., 4., 0., 0., 0., 9.};
  const gnss::LocalFix local = frame.at(fix, {});
  EXPECT_GT(local.p_AinE.x(), 2000.);
  EXPECT_LT((local.p_AinE - in_local_frame(fix, origin)).norm(), 1e-6);
  // Along the axes at the antenna, which is 2.5 km away: turned by less than a thousandth.
  EXPECT_NEAR(local.R(0, 0), 1., 1e-2);
  EXPECT_NEAR(local.R(2, 2), 9., 1e-2);
  EXPECT_GT(std::abs(local.R(0, 2)), 1e-4);
}

TEST(Alignment, IsToldByTheWayBetweenTwoPlaces) {
  gnss::Baseline way;
  way.in_G = {3., 4., 0.5};
  way.in_E = gnss::R_GtoE(kYaw) * way.in_G;
  way.P_G = way.P_E = 0.01 * Matrix3d::Identity();
  const gnss::YawGuess guess = gnss::yaw_of(way);
  EXPECT_NEAR(std::remainder(guess.yaw_EtoG - kYaw, 2. * M_PI), 0., 1e-12);
  EXPECT_NEAR(guess.sigma_rad, std::sqrt(0.02) / 5., 1e-12);
  EXPECT_NEAR(guess.chi2, 0., 1e-12);
  way.in_E.z() += 1.;
  EXPECT_NEAR(gnss::yaw_of(way).chi2, 1. / 0.02, 1e-9);
}

}  // namespace
}  // namespace viwo

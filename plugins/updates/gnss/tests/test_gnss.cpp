// The factors of fixes whose yaw is known: where they are zero, their derivatives, what they cannot
// tell, what is left out.
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <Eigen/LU>
#include <GeographicLib/LocalCartesian.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "alignment.hpp"
#include "allocations.hpp"
#include "filter_fixture.hpp"
#include "message_of.hpp"
#include "rejections.hpp"
#include "viwo/sim/planar_motion.hpp"
#include "viwo/testing/jacobian.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::counts_of;
using testing::UpdateHost;

constexpr double kYaw = 2.2;
const Vector3d kOrigin(5., -3., 1.);
const Vector3d kLever(0.2, -0.1, 0.5);
constexpr char kKnown[] =
    "{type: gnss, p_AinI_m: [0.2, -0.1, 0.5], yaw_EtoG_rad: 2.2, sigma_yaw_rad: 0.1, "
    "p_EinG_m: [5, -3, 1], sigma_p_EinG_m: 0.2, origin_deg: [48.14, 11.58], "
    "origin_altitude_m: 520";

/// A drive over a tilted plane with a clone every 0.2 s, and what a receiver says at any time.
class Fixes : public ::testing::Test {
 protected:
  static constexpr double kPeriod = 0.2;

  Fixes() : motion_("icr_sweep", {.ramp_s = 0.}) {
    for (int k = 0; k < 4; ++k) truth_.clones.push_back(at(1. + kPeriod * k, k));
  }

  CloneState at(double t_s, int slot) const {
    sim::PoseIntegrator pose(motion_);
    return drive_.clone(std::llround(t_s * 1e9), slot, pose.advance_to(t_s), motion_.twist(t_s));
  }

  GnssSample fix(double t_s) const {
    const CloneState imu = at(t_s, 0);
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

  /// The two factors of a fix, horizontal and height, as one.
  struct Rows {
    FactorColumns columns;
    Eigen::MatrixXd H;
    Vector3d residual;
    Matrix3d R = Matrix3d::Zero();
  };

  static std::vector<Rows> rows_of(Update& update, const UpdateHost& filter,
                                   const std::vector<GnssSample>& fixes) {
    FactorSink sink(16, 80);
    EpochData data = filter.epoch(fixes);
    data.end_ns = filter.clones.back().t_ns;
    update.update(filter.view(), data, sink);
    std::vector<Rows> all;
    for (std::size_t i = 0; i + 1 < sink.residuals().size(); i += 2) {
      const ResidualFactor& horizontal = sink.residuals()[i];
      const ResidualFactor& height = sink.residuals()[i + 1];
      Rows& rows = all.emplace_back();
      rows.columns = horizontal.columns;
      rows.H.resize(3, horizontal.columns.size());
      rows.H << horizontal.H, height.H;
      rows.residual << horizontal.residual, height.residual;
      rows.R.topLeftCorner<2, 2>() = horizontal.R;
      rows.R(2, 2) = height.R(0, 0);
    }
    return all;
  }

  testing::TiltedDrive drive_;
  sim::PlanarMotion motion_;
  UpdateHost truth_;
};

TEST_F(Fixes, AreWhereTheAntennaIsAtAnyTimeBetweenTwoClones) {
  const auto update = load();
  for (const double t : {1.0, 1.01, 1.05, 1.1, 1.17, 1.2, 1.21, 1.35, 1.5, 1.6}) {
    const auto made = rows_of(*update, truth_, {fix(t)});
    ASSERT_EQ(made.size(), 1u) << t;
    EXPECT_LT(made[0].residual.cwiseAbs().maxCoeff(), 3e-5) << t;
    const int first = made[0].columns.blocks()[0].first;
    EXPECT_EQ((first - kImuSize) / kPoseSize, t <= 1.2 ? 0 : t <= 1.4 ? 1 : 2) << t;
  }
  EXPECT_TRUE(counts_of(*update).empty());
}

TEST_F(Fixes, HaveTheDerivativesOfCentralDifferencesByAllBlocks) {
  const auto update = load(", sigma_drift_m: 0.5, sigma_height_drift_m: 2");
  rows_of(*update, truth_, {fix(1.27)});  // from now on it linearises at the estimate
  const auto residual = [&](const VectorXd& d) -> VectorXd {
    UpdateHost moved = truth_;
    moved.plus(d);
    return rows_of(*update, moved, {fix(1.27)})[0].residual;
  };
  const Rows factor = rows_of(*update, truth_, {fix(1.27)})[0];
  EXPECT_EQ(factor.columns.size(), 12 + 3 + 3 + 4);
  const auto size = truth_.P.rows();
  EXPECT_EQ(testing::jacobian_mismatch(-UpdateHost::spread(factor.columns, factor.H, size),
                                       testing::central_difference(residual, VectorXd::Zero(size)),
                                       {}, 1e-6),
            "");
}

TEST_F(Fixes, TellNothingOfATurnAndAShiftOfEverythingAlsoWhereFirstEstimatesAreOthers) {
  const auto update = load();
  rows_of(*update, truth_, {fix(1.1)});
  std::mt19937_64 rng(4);
  UpdateHost moved = truth_;
  moved.plus(0.05 * testing::gaussian(static_cast<int>(truth_.P.rows()), rng));
  moved.numbers({1}).tail<3>() = kOrigin;  // which is taken at the estimate
  const Rows factor = rows_of(*update, moved, {fix(1.27)})[0];
  const Eigen::MatrixXd H = UpdateHost::spread(factor.columns, factor.H, truth_.P.rows());
  const Rows before = rows_of(*update, truth_, {fix(1.27)})[0];
  EXPECT_GT((factor.H - before.H).cwiseAbs().maxCoeff(), 1e-3) << "the estimate counts for nothing";
  VectorXd turn = VectorXd::Zero(H.cols()), shift = turn;
  for (const CloneState& clone : truth_.clones) {
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
  const auto made = rows_of(*update, truth_, {fix(1.1), fix(1.3)});
  ASSERT_EQ(made.size(), 2u);
  const CloneState imu = at(1.1, 0);
  const Vector3d first = imu.p_IinG + imu.R_GtoI.transpose() * kLever;
  // The origin of E is the first fix, the declared position of it zero.
  const Vector3d expected = gnss::R_GtoE(kYaw) * -first;
  EXPECT_LT((made[0].residual - expected).norm(), 1e-4);
  EXPECT_LT((made[1].residual - expected).norm(), 1e-4);
  EXPECT_LT(made[0].H.col(15).norm(), 1e-4) << "of its origin no yaw is seen";
  EXPECT_GT(made[1].H.col(15).norm(), 0.01);
  // With the alignment that was found the residuals are zero.
  UpdateHost solved = truth_;
  solved.numbers({1}) << kYaw, first;
  EXPECT_LT(rows_of(*update, solved, {fix(1.4)})[0].residual.norm(), 1e-4);
}

TEST_F(Fixes, HaveTheCovarianceOfTheMessageOrElseTheConfiguredOne) {
  const auto update = load(", sigma_m: 3, sigma_scale: 2");
  GnssSample without = fix(1.3);
  without.covariance_ENU_m2 = {};
  const auto made = rows_of(*update, truth_, {fix(1.25), without});
  ASSERT_EQ(made.size(), 2u);
  Matrix3d expected;
  expected << 0.16, 0.04, 0., 0.04, 0.36, 0., 0., 0., 1.;
  EXPECT_TRUE(made[0].R.isApprox(expected, 1e-4));
  EXPECT_TRUE(made[1].R.isApprox(36. * Matrix3d::Identity(), 1e-4));
}

TEST_F(Fixes, SayTheSameInTwoFactorsAsInOneWhereHeightsAreCorrelated) {
  const auto update = load();
  GnssSample correlated = fix(1.3);
  correlated.altitude_m += 2.;
  correlated.longitude_deg += 1e-5;
  const auto apart = rows_of(*update, truth_, {correlated})[0];
  correlated.covariance_ENU_m2 = {0.04, 0.01, 0.05, 0.01, 0.09, -0.06, 0.05, -0.06, 0.25};
  const auto made = rows_of(*update, truth_, {correlated})[0];
  Matrix3d C;
  C << 0.04, 0.01, 0.05, 0.01, 0.09, -0.06, 0.05, -0.06, 0.25;
  // Information and its vector, by all rows at once with the full covariance.
  EXPECT_TRUE((made.H.transpose() * made.R.inverse() * made.H)
                  .isApprox(apart.H.transpose() * C.inverse() * apart.H, 1e-4));
  EXPECT_TRUE((made.H.transpose() * made.R.inverse() * made.residual)
                  .isApprox(apart.H.transpose() * C.inverse() * apart.residual, 1e-4));
}

TEST_F(Fixes, AreTakenAtTheTimeOfTheirClock) {
  const auto update = load(", t_AtoI_s: -0.15");
  GnssSample late = fix(1.25);
  late.t_ns += 150'000'000;
  const auto made = rows_of(*update, truth_, {late});
  ASSERT_EQ(made.size(), 1u);
  EXPECT_LT(made[0].residual.cwiseAbs().maxCoeff(), 3e-5);
  ASSERT_EQ(truth_.streams.size(), 1u);
  EXPECT_EQ(truth_.streams[0].clocks.at(0).constant_s, -0.15);
}

/// The yaw moves a fix that is far from the origin: linearised at a place of the origin that nobody
/// knows, the first fix would tell of a yaw that it does not know.
TEST_F(Fixes, TellWhereAnOriginIsThatIsOnlyGivenOnTheEarth) {
  const auto update = testing::load_update(
      "{type: gnss, p_AinI_m: [0.2, -0.1, 0.5], yaw_EtoG_rad: 2.2, sigma_yaw_rad: 0.1, "
      "origin_deg: [48.14, 11.58], origin_altitude_m: 520}");
  UpdateHost unknown = truth_;
  unknown.start(*update);
  unknown.layout();
  unknown.set_priors();
  const Rows far = rows_of(*update, unknown, {fix(1.3)})[0];
  const auto known = load();  // the same of an origin that is known
  const Rows right = rows_of(*known, truth_, {fix(1.3)})[0];
  EXPECT_LT((far.H.rightCols<4>() - right.H.rightCols<4>()).topRows<2>().cwiseAbs().maxCoeff(),
            1e-3);
  EXPECT_GT(right.H.rightCols<4>().col(0).head<2>().norm(), 3.);
}

TEST_F(Fixes, LeaveOutBlocksThatAreHeld) {
  const auto update = testing::load_update(
      "{type: gnss, p_AinI_m: [0.2, -0.1, 0.5], sigma_p_AinI_m: [0, 0, 0], yaw_EtoG_rad: 2.2, "
      "sigma_yaw_rad: 0, p_EinG_m: [5, -3, 1], sigma_p_EinG_m: 0, origin_deg: [48.14, 11.58], "
      "origin_altitude_m: 520}");
  truth_.start(*update);
  truth_.layout();
  const auto made = rows_of(*update, truth_, {fix(1.3)});
  ASSERT_EQ(made.size(), 1u);
  EXPECT_EQ(made[0].columns.size(), 12);
  EXPECT_LT(made[0].residual.cwiseAbs().maxCoeff(), 3e-5);
}

TEST_F(Fixes, AreCountedWhenTheyAreLeftOut) {
  const auto update = load();
  GnssSample indefinite = fix(1.3), elsewhere = fix(1.31), broken = fix(1.32), nowhere = fix(1.33);
  indefinite.covariance_ENU_m2[1] = indefinite.covariance_ENU_m2[3] = 1.;
  elsewhere.latitude_deg += 3.;
  broken.altitude_m = std::nan("");
  nowhere.latitude_deg = nowhere.longitude_deg = 0.;
  EXPECT_EQ(rows_of(*update, truth_, {fix(0.99), fix(1.1), indefinite, elsewhere, broken, nowhere})
                .size(),
            1u);
  EXPECT_EQ(rows_of(*update, truth_, std::vector(20, fix(1.3))).size(), 7u);
  UpdateHost one = truth_;
  one.clones.erase(one.clones.begin(), one.clones.end() - 1);
  EXPECT_EQ(rows_of(*update, one, {fix(1.6)}).size(), 0u);
  EXPECT_EQ(counts_of(*update),
            (testing::Counts{{"fix that is older than the oldest clone", 2},
                             {"fix whose covariance is not positive definite", 1},
                             {"fix more than 100 km from the origin", 1},
                             {"fix with values that cannot be used", 2},
                             {"fix beyond 7 in an epoch", 13}}));
  const auto strict = testing::load_update(std::string(kKnown) + ", max_span_s: 0.1}");
  UpdateHost other = truth_;
  other.start(*strict);
  EXPECT_EQ(rows_of(*strict, truth_, {fix(1.3)}).size(), 0u);
  EXPECT_EQ(counts_of(*strict),
            (testing::Counts{{"fix between clones that are too far apart", 1}}));
}

TEST_F(Fixes, DoNotAllocate) {
  if (!testing::counts_allocations()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  const auto update = load(", sigma_drift_m: 0.5");
  const std::vector<GnssSample> fixes{fix(1.45), fix(1.5), fix(1.55)};
  rows_of(*update, truth_, {fix(1.3)});
  FactorSink sink(16, 80);
  const EpochData data = truth_.epoch(fixes);
  const FilterView view = truth_.view();
  const long before = testing::allocations();
  update->update(view, data, sink);
  EXPECT_EQ(testing::allocations() - before, 0);
  EXPECT_EQ(sink.residuals().size(), 6u);
}

std::string error_of(const std::string& parameters) {
  return testing::error_of([&] { testing::load_update("{type: gnss, " + parameters + "}"); });
}

TEST(GnssParameters, SayWhatContradictsWhat) {
  using ::testing::HasSubstr;
  EXPECT_THAT(error_of("p_AinI_m: [1, 2]"), HasSubstr("p_AinI_m: needs 3 numbers, not 2"));
  EXPECT_THAT(error_of("sigma_p_EinG_m: 0"),
              HasSubstr("origin_deg: is not given, but where it is in G"));
  EXPECT_THAT(error_of("origin_deg: [48, 11]"),
              HasSubstr("origin_deg: needs a yaw that is known: sigma_yaw_rad must be at most "
                        "alignment_sigma_rad"));
  EXPECT_THAT(error_of("sigma_yaw_rad: 0.1, origin_deg: [148, 11]"),
              HasSubstr("origin_deg: has a latitude beyond 90 degrees"));
  EXPECT_THAT(error_of("sigma_yaw_rad: 0.1, origin_deg: [48, 11, 500]"),
              HasSubstr("origin_deg: needs two numbers"));
  EXPECT_THAT(error_of("name: ''"), HasSubstr("name: must not be empty"));
}

}  // namespace
}  // namespace viwo

// Fixes: derivatives, interpolation between clones, what is left out, consistency in whole runs.
#include <cmath>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "allocations.hpp"
#include "filter_fixture.hpp"
#include "fix.hpp"
#include "message_of.hpp"
#include "plane_and_gnss_runs.hpp"
#include "registry.hpp"
#include "rejections.hpp"
#include "viwo/config/overrides.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/run/simulate.hpp"
#include "viwo/sim/planar_motion.hpp"
#include "viwo/testing/jacobian.hpp"

namespace viwo {
namespace {

using testing::counts_of;

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using namespace pose_reference;

constexpr std::int64_t kMs = 1'000'000;
const std::vector<std::string> kHalfAMinute{"sensors.simulator0.duration_s=30"};

TEST(BodyBetween, HasTheDerivativesOfCentralDifferencesAtRandomStates) {
  std::mt19937_64 rng(7);
  for (int trial = 0; trial < 50; ++trial) {
    const VectorXd n = testing::gaussian(30, rng);
    const ClonePose first{exp_so3(n.segment<3>(0)), n.segment<3>(3), n.segment<3>(6),
                          n.segment<3>(9)};
    const ClonePose last{exp_so3(0.3 * n.segment<3>(12)) * first.R_GtoI,
                         first.p_IinG + 0.3 * n.segment<3>(15), n.segment<3>(18), n.segment<3>(21)};
    const Lever lever{exp_so3(n.segment<3>(24)), n.segment<3>(27)};
    const double u = trial / 49.;
    BodyJacobian J;
    const BodyPose at = body_between(first, last, 0.2, u, lever, &J);
    const auto predict = [&](const VectorXd& d) -> VectorXd {
      ClonePose a = first, b = last;
      a.R_GtoI = exp_so3(-d.segment<3>(0)) * a.R_GtoI;
      a.p_IinG += d.segment<3>(3);
      b.R_GtoI = exp_so3(-d.segment<3>(6)) * b.R_GtoI;
      b.p_IinG += d.segment<3>(9);
      const BodyPose moved = body_between(a, b, 0.2, u, lever);
      VectorXd out(6);
      out << -log_so3(moved.R_GtoB * at.R_GtoB.transpose()), moved.p_BinG;
      return out;
    };
    EXPECT_EQ(testing::jacobian_mismatch(
                  J, testing::central_difference(predict, VectorXd::Zero(12)), {}, 1e-6),
              "");
  }
}

/// A drive over a tilted plane with a clone every 0.2 s, and where it truly is at any time.
class Drive : public ::testing::Test {
 protected:
  static constexpr double kPeriod = 0.2;

  Drive() : motion_("icr_sweep", {.ramp_s = 0.}) {
    for (int k = 0; k < 4; ++k) truth_.clones.push_back(at(1. + kPeriod * k, k));
    truth_.layout();
    truth_.P.setIdentity();
    truth_.P *= 1e-4;
  }

  CloneState at(double t_s, int slot) const {
    sim::PoseIntegrator pose(motion_);
    return drive_.clone(std::llround(t_s * 1e9), slot, pose.advance_to(t_s), motion_.twist(t_s));
  }

  /// B as W sees it: yaw of W in G 0.4, origin of W at [5, -3, 1] in G.
  PoseSample fix(double t_s) const {
    const CloneState imu = at(t_s, 0);
    const Matrix3d R_GtoW = exp_so3({0., 0., -0.4});
    const Matrix3d R_ItoB =
        exp_so3({0., 0., -1.2}) * exp_so3({0., 0.5, 0.}) * exp_so3({0.3, 0., 0.});
    const Vector3d p_BinG = imu.p_IinG + imu.R_GtoI.transpose() * Vector3d(0.2, -0.1, 0.5);
    const Vector3d p = R_GtoW * (p_BinG - Vector3d(5., -3., 1.));
    const Eigen::Quaterniond q(R_GtoW * (R_ItoB * imu.R_GtoI).transpose());
    return {imu.t_ns, {p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()}};
  }

  std::shared_ptr<Update> load(const std::string& more = "", const std::string& use = "pose") {
    const auto update =
        testing::load_update("{type: pose_reference, use: " + use +
                             ", p_BinI_m: [0.2, -0.1, 0.5], rpy_ItoB_rad: [0.3, 0.5, "
                             "-1.2], yaw_WtoG_rad: 0.4, p_WinG_m: [5, -3, 1]" +
                             more + "}");
    truth_.start(*update);
    return update;
  }

  static std::vector<ResidualFactor> factors(Update& update, const testing::SmallFilter& filter,
                                             const std::vector<PoseSample>& fixes) {
    FactorSink sink(16, 60);
    EpochData data = filter.epoch(fixes);
    data.end_ns = filter.clones.back().t_ns;
    update.update(filter.view(), data, sink);
    return {sink.residuals().begin(), sink.residuals().end()};
  }

  testing::TiltedDrive drive_;
  sim::PlanarMotion motion_;
  testing::SmallFilter truth_;
};

TEST_F(Drive, IsWhereTheFixSaysAtAnyTimeBetweenItsClones) {
  const auto update = load();
  // Straight lines between the clones would be 3 mm off in the middle.
  const Vector3d middle = 0.5 * (truth_.clones[0].p_IinG + truth_.clones[1].p_IinG);
  EXPECT_GT((at(1. + 0.5 * kPeriod, 0).p_IinG - middle).norm(), 5e-4);
  for (const double t : {1.0, 1.01, 1.05, 1.1, 1.17, 1.2, 1.21, 1.35, 1.5, 1.6}) {
    const auto made = factors(*update, truth_, {fix(t)});
    ASSERT_EQ(made.size(), 1u) << t;
    EXPECT_EQ(made[0].residual.size(), 6);
    EXPECT_LT(made[0].residual.cwiseAbs().maxCoeff(), 3e-5) << t;
    // Its two clones are those around it.
    const auto first = made[0].columns.blocks()[0].first;
    EXPECT_EQ((first - kImuSize) / kPoseSize, t <= 1.2 ? 0 : t <= 1.4 ? 1 : 2) << t;
  }
  EXPECT_TRUE(counts_of(*update).empty());
}

TEST_F(Drive, HasTheDerivativesOfItsResidualAtTheTruthAndOtherwiseAtFirstEstimates) {
  const auto update = load();
  const auto residual = [&](const VectorXd& d) -> VectorXd {
    testing::SmallFilter moved = truth_;
    moved.plus(d);
    return factors(*update, moved, {fix(1.27)})[0].residual;
  };
  const auto size = truth_.P.rows();
  const ResidualFactor at_truth = factors(*update, truth_, {fix(1.27)})[0];
  // Not exact: the residual of the interpolation turns the orientation's rows a little.
  EXPECT_EQ(testing::jacobian_mismatch(
                -testing::SmallFilter::spread(at_truth.columns, at_truth.H, size),
                testing::central_difference(residual, VectorXd::Zero(size)), {}, 1e-4),
            "");
  std::mt19937_64 rng(3);
  testing::SmallFilter moved = truth_;
  moved.plus(0.01 * testing::gaussian(static_cast<int>(size), rng));
  EXPECT_TRUE(factors(*update, moved, {fix(1.27)})[0].H == at_truth.H);
  moved.first_estimates();
  EXPECT_GT((factors(*update, moved, {fix(1.27)})[0].H - at_truth.H).cwiseAbs().maxCoeff(), 1e-3);
}

TEST_F(Drive, UsesPositionsAloneWithTheirOwnVerticalNoise) {
  const auto update = load(", sigma_position_m: 0.5, sigma_height_m: 2", "position");
  PoseSample only_position = fix(1.3);
  only_position.q_BtoW_xyzw = {0., 0., 0., 0.};  // GNSS has none
  const auto made = factors(*update, truth_, {only_position});
  ASSERT_EQ(made.size(), 1u);
  EXPECT_EQ(made[0].residual.size(), 3);
  EXPECT_LT(made[0].residual.cwiseAbs().maxCoeff(), 3e-5);
  EXPECT_TRUE(made[0].R.diagonal().isApprox(Vector3d(0.25, 0.25, 4.)));
}

TEST_F(Drive, CountsWhatItLeavesOut) {
  const auto update = load(", max_per_epoch: 3");
  PoseSample bad = fix(1.3);
  bad.q_BtoW_xyzw = {0.5, 0., 0., 0.5};
  EXPECT_EQ(factors(*update, truth_, {fix(0.99), bad, fix(1.1)}).size(),
            1u);  // 1.1 is late, not lost
  std::vector<PoseSample> many;
  for (int i = 1; i <= 8; ++i) many.push_back(fix(1.4 + 0.02 * i));
  EXPECT_EQ(factors(*update, truth_, many).size(), 3u);
  testing::SmallFilter one = truth_;
  one.clones.erase(one.clones.begin(), one.clones.end() - 1);
  EXPECT_EQ(factors(*update, one, {fix(1.6)}).size(), 0u);
  EXPECT_EQ(counts_of(*update), (testing::Counts{{"fix that is older than the oldest clone", 2},
                                                 {"fix whose quaternion has not unit norm", 1},
                                                 {"fix beyond max_per_epoch", 5}}));
  const auto strict = load(", max_span_s: 0.1");
  EXPECT_EQ(factors(*strict, truth_, {fix(1.3)}).size(), 0u);
  EXPECT_EQ(counts_of(*strict),
            (testing::Counts{{"fix between clones that are too far apart", 1}}));
}

TEST_F(Drive, DoesNotAllocate) {
  if (!testing::counts_allocations()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  const auto update = load();
  FactorSink sink(16, 60);
  const std::vector<PoseSample> fixes{fix(1.45), fix(1.5), fix(1.55)};
  const EpochData data = truth_.epoch(fixes);
  const FilterView view = truth_.view();
  const long before = testing::allocations();
  update->update(view, data, sink);
  EXPECT_EQ(testing::allocations() - before, 0);
  EXPECT_EQ(sink.residuals().size(), 3u);
}

/// Writes down the stamps of the poses it is given, ms.
class PoseListener final : public Update {
 public:
  void declare(Declarations& host) override {
    poses_ = host.stream({.type = &sample_type<PoseSample>()});
  }
  void update(const FilterView&, const EpochData& data, FactorSink&) override {
    auto& now = seen.emplace_back();
    for (const PoseSample& pose : data.samples<PoseSample>(poses_)) now.push_back(pose.t_ns / kMs);
  }
  std::vector<std::vector<std::int64_t>> seen;

 private:
  StreamId poses_;
};

TEST(EstimatorWithPoses, GivesEachPoseOnceLateOnesWithTheNextEpochAndCountsWhatItDrops) {
  const auto first = std::make_shared<PoseListener>(), second = std::make_shared<PoseListener>();
  Estimator estimator({}, {{"a", first, nullptr, "gnss0"}, {"b", second, nullptr, "mocap0"}});
  ImuPrior prior;
  prior.t_ns = 0;
  prior.P.setIdentity();
  estimator.start(prior);
  auto imu_to = [&, t = std::int64_t{0}](std::int64_t end_ms) mutable {
    for (; t <= end_ms; t += 10) estimator.add(ImuSample{t * kMs, {}, {0., 0., 9.81}});
    while (estimator.step()) {
    }
  };
  const auto pose = [&](std::int64_t t_ms, std::size_t stream = 0) {
    PoseSample sample;
    sample.t_ns = t_ms * kMs;
    estimator.add(stream, sample);
  };
  pose(100);
  pose(200);
  pose(200);    // again
  pose(260);    // belongs to the next epoch (they are 250 ms long)
  pose(90, 1);  // another sensor
  imu_to(270);
  pose(255);  // out of order
  imu_to(510);
  pose(300);  // late
  pose(400);
  PoseSample broken;
  broken.t_ns = 450 * kMs;
  broken.p_BinW_m[1] = std::nan("");
  estimator.add(0, broken);
  imu_to(760);
  using Stamps = std::vector<std::vector<std::int64_t>>;
  EXPECT_EQ(first->seen, (Stamps{{100, 200}, {260}, {300, 400}}));
  EXPECT_EQ(second->seen, (Stamps{{90}, {}, {}}));
  EXPECT_EQ(counts_of(estimator), (testing::Counts{{"poses: stamp not after the last", 2},
                                                   {"poses: value that is not finite", 1}}));
}

std::vector<std::string> with(std::vector<std::string> more) {
  more.insert(more.begin(), kHalfAMinute.begin(), kHalfAMinute.end());
  return more;
}

TEST(PoseReferenceRuns, AreConsistentWithFixesAndDoNotDrift) {
  const auto runs = testing::plane_and_gnss("wheels_plane_gnss", 8, kHalfAMinute);
  EXPECT_EQ(testing::inconsistency(runs), "");
  for (const auto& run : runs) {
    // Some 150 fixes of 5 cm, and a start that is 10 cm off: the last position is to a few cm.
    EXPECT_LT(run.errors.back().position_m.norm(), 0.06);
    EXPECT_LT(run.errors.back().position_sigma_m.maxCoeff(), 0.03);
  }
}

TEST(PoseReferenceRuns, AreConsistentWithMotionCapture) {
  EXPECT_EQ(testing::inconsistency(testing::plane_and_gnss(
                "wheels_plane_gnss", 8,
                with({"sensors.simulator0.pose_rate_hz=50", "updates.gnss.use=pose",
                      "sensors.simulator0.sigma_pose_position_m=0.002",
                      "updates.gnss.sigma_position_m=0.002"}))),
            "");
}

TEST(PoseReferenceRuns, ShowALeverArmThatIsWrong) {
  EXPECT_NE(testing::inconsistency(testing::plane_and_gnss(
                "wheels_plane_gnss", 8, with({"updates.gnss.p_BinI_m=[0.1, -0.05, 0.3]"}))),
            "");
}

TEST(PoseReferenceRuns, ShowFixesThatAreFourTimesAsNoisyAsTheFilterThinks) {
  EXPECT_NE(testing::inconsistency(testing::plane_and_gnss(
                "wheels_plane_gnss", 8,
                with({"updates.gnss.sigma_position_m=0.0125", "updates.gnss.gate_probability=0"}))),
            "");
}

TEST(PoseReferenceRuns, LeaveOutFixesThatAreOff) {
  const auto runs = testing::plane_and_gnss(
      "wheels_plane_gnss", 8, with({"sensors.simulator0.pose_outlier_probability=0.1"}));
  EXPECT_EQ(testing::inconsistency(runs), "");
  const UpdateCounts counts = testing::counts(runs, "gnss");
  const double rejected =
      static_cast<double>(counts.rejected) / static_cast<double>(counts.applied + counts.rejected);
  EXPECT_NEAR(rejected, 0.1, 0.03);
}

TEST(PoseReferenceRuns, DoNotChangeByFixesThatNobodyUses) {
  const auto unused = testing::plane_and_gnss("wheels_plane", 1, kHalfAMinute);
  const auto none =
      testing::plane_and_gnss("wheels_plane", 1, with({"sensors.simulator0.pose_rate_hz=0"}));
  const auto used = testing::plane_and_gnss("wheels_plane_gnss", 1, kHalfAMinute);
  EXPECT_EQ(unused[0].estimate.back().p_BinW, none[0].estimate.back().p_BinW);
  EXPECT_NE(unused[0].estimate.back().p_BinW, used[0].estimate.back().p_BinW);
  EXPECT_EQ(unused[0].reference.back().p_BinW, used[0].reference.back().p_BinW);
}

class PoseConfiguration : public ::testing::Test {
 protected:
  static config::Node run(const std::vector<std::string>& assignments) {
    return resolve_placeholders(load_run_configuration(
        std::string(VIWO_TEST_SOURCE_DIR) + "/configs/runs/viwo_gnss.yaml", assignments));
  }
  static RunSetup read(const config::Node& run) { return read_run(run, testing::registry(), 1); }
  static std::string error(const std::vector<std::string>& assignments) {
    return testing::error_of([&] { read(run(assignments)); });
  }
};

TEST_F(PoseConfiguration, TellsWhatIsWrongWithTheNameOfASensor) {
  EXPECT_THAT(error({"updates.gnss.sensor=simulator"}),
              ::testing::HasSubstr("updates.gnss.sensor: no sensor 'simulator' - did you mean "
                                   "'simulator0'?"));
  EXPECT_THAT(error({"updates.planar_motion.sensor=simulator0"}),
              ::testing::HasSubstr("updates.planar_motion.sensor: it takes nothing from a sensor "
                                   "that is named here"));
  EXPECT_THAT(error({"updates.mocap={type: pose_reference}"}),
              ::testing::HasSubstr("mocap needs the sensor that gives its poses (sensor: NAME)"));
  EXPECT_THAT(error({"updates.gnss.p_WinG_m=[1, 2]"}),
              ::testing::HasSubstr("needs 3 numbers, not 2"));
}

TEST_F(PoseConfiguration, OfALogGivesTheSameBitsAsTheSimulator) {
  const auto folder = std::filesystem::path(VIWO_TEST_BINARY_DIR) / "pose_reference_log";
  auto simulated = read(run({"sensors.simulator0.duration_s=5"}));
  write_log(simulated, folder);
  auto setup = read(run({"sensors.simulator0.duration_s=5"}));
  const auto data = collect(setup);
  ASSERT_EQ(data.recorded.of<PoseSample>("simulator0").size(), 25u);
  EXPECT_TRUE(data.reference.empty());
  const auto direct = run_filter(setup, data);

  config::Node from_log = run({"updates.gnss.sensor=gnss0"});
  const std::string path = folder.string();
  from_log.set(
      "sensors",
      config::parse("{imu0: {type: asl_imu, path: " + path +
                        "/imu0}, wheels0: {type: asl_encoders, path: " + path +
                        "/wheels0}, state0: {type: asl_state, path: " + path +
                        "/state_groundtruth_estimate0}, truth0: {type: asl_calibration, "
                        "path: " +
                        path + "/calibration_groundtruth0}, gnss0: {type: asl_pose, path: " + path +
                        "/poses0}}",
                    "sensors"));
  auto log_setup = read(from_log);
  const auto again = run_filter(log_setup, collect(log_setup));
  ASSERT_EQ(again.estimate.size(), direct.estimate.size());
  EXPECT_EQ(again.estimate.back().p_BinW, direct.estimate.back().p_BinW);
  // Turned off, the sensor is still no reference, which would be a second one.
  config::Node off = from_log;
  config::set_path(off, "updates.gnss.enabled", config::Node::scalar_of("false"));
  auto off_setup = read(off);
  EXPECT_GT(collect(off_setup).states().size(), 40u);
}

}  // namespace
}  // namespace viwo

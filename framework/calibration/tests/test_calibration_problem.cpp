// Residuals of the batch calibration: derivatives by all unknowns, signs of extrinsics and clock.
#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "calibration_problem.hpp"
#include "message_of.hpp"
#include "motion_reference.hpp"
#include "simulated.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/heading_jumps.hpp"
#include "viwo/math/se2.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/testing/jacobian.hpp"

namespace viwo {
namespace {

using namespace calibration;
using testing::central_difference;
using testing::jacobian_mismatch;

CalibrationRecording recording(const std::vector<std::string>& assignments = {},
                               ReferenceKind kind = ReferenceKind::kPoses) {
  CalibrationRecording recording;
  recording.setup = read_run(testing::simulated("icr_sweep", assignments), testing::registry());
  recording.data = collect(recording.setup);
  recording.motion = motion_reference({"gyro", {}}, recording.setup, recording.data, kind);
  return recording;
}

/// A swerve robot with wheels and IMU that turns as it drives.
CalibrationRecording with_gyro() {
  CalibrationRecording recording;
  recording.setup =
      read_run(config::parse(testing::swerve_with_camera(0), "run.yaml"), testing::registry());
  recording.data = collect(recording.setup);
  recording.motion = motion_reference({"gyro", {{"distance_m", "3"}, {"turn_deg", "-450"}}},
                                      recording.setup, recording.data, ReferenceKind::kGyro);
  return recording;
}

/// Indices of residuals that are of one kind, or that are not.
std::vector<int> rows_of(const RecordingProblem& problem, ResidualKind kind, bool is = true) {
  std::vector<int> rows;
  for (std::size_t i = 0; i < problem.kinds().size(); ++i) {
    if ((problem.kinds()[i] == kind) == is) rows.push_back(static_cast<int>(i));
  }
  return rows;
}

TEST(MotionOfBody, IsTheConjugationByTheExtrinsics) {
  const Eigen::Vector3d g(0.7, 0.3, -0.4);
  const PlanarExtrinsics e(0.05, -0.02, 0.3);
  const Eigen::Vector3d E(e[2], e[0], e[1]);
  const Eigen::Vector3d E_inverse = between(E, Eigen::Vector3d::Zero());
  const MotionOfBody motion = motion_of_body(g, e);
  EXPECT_LT((motion.h - compose(E, compose(g, E_inverse))).norm(), 1e-14);
  const Eigen::MatrixXd by_g = central_difference(
      [&](const Eigen::VectorXd& x) -> Eigen::VectorXd { return motion_of_body(x, e).h; }, g);
  const Eigen::MatrixXd by_e = central_difference(
      [&](const Eigen::VectorXd& x) -> Eigen::VectorXd { return motion_of_body(g, x).h; }, e);
  EXPECT_EQ(jacobian_mismatch(motion.by_g, by_g, {}), "");
  EXPECT_EQ(jacobian_mismatch(motion.by_extrinsics, by_e, {"x", "y", "yaw"}), "");
}

/// Derivatives of all residuals but those of the parity, which are another thing.
void expect_central_differences(RecordingProblem& problem, const CalibrationRecording& recording,
                                double tolerance) {
  const std::vector<int> rows = rows_of(problem, ResidualKind::kParity, false);
  Eigen::VectorXd x(21);
  x << recording.setup.model->nominal(), 0.02, -0.01, 0.05, 0.004, 0.01;
  const auto at = [&](const Eigen::VectorXd& values) {
    return CalibrationPoint{values.head<16>(), values.segment<3>(16), values[19], values[20]};
  };
  RecordingResiduals residuals;
  problem.evaluate(at(x), true, residuals);
  const Eigen::MatrixXd numeric = central_difference(
      [&](const Eigen::VectorXd& moved) -> Eigen::VectorXd {
        RecordingResiduals there;
        problem.evaluate(at(moved), false, there);
        return there.r(rows);
      },
      x, 1e-6);
  std::vector<std::string> names;
  for (const auto& spec : recording.setup.model->description().intrinsics) {
    names.push_back(spec.name);
  }
  names.insert(names.end(), {"x_OinB", "y_OinB", "yaw_OinB", "clock", "bias"});
  EXPECT_EQ(jacobian_mismatch(residuals.J(rows, Eigen::all), numeric, names, tolerance), "");
}

TEST(RecordingProblem, HasThePoseJacobianOfCentralDifferences) {
  const auto simulated = recording({"sensors.simulator0.true_intrinsics_scale=1"});
  CalibrationOptions options;
  options.segments = Segments::kLength;
  options.segment_s = 2.;
  options.estimate_extrinsics = true;
  options.prior_sigma_clock_offset_s = 0.01;
  for (const bool weighted : {false, true}) {
    auto copy = simulated;
    copy.setup.preintegration.twist.noise_weighted = weighted;
    RecordingProblem problem(copy, options);
    // The weights of the weighted fit are held, and the clock moves in whole nanoseconds.
    expect_central_differences(problem, copy, weighted ? 2e-2 : 2e-3);
  }
}

TEST(RecordingProblem, HasTheJacobianOfTurnAndDistanceOfCentralDifferences) {
  const CalibrationRecording recording = with_gyro();
  CalibrationOptions options;
  options.prior_sigma_clock_offset_s = 0.01;
  options.segment_s = 1.;
  for (const auto segments : {Segments::kLength, Segments::kTrajectory}) {
    options.segments = segments;
    RecordingProblem problem(recording, options);
    EXPECT_EQ(rows_of(problem, ResidualKind::kDistance).size(), 1u);
    EXPECT_EQ(rows_of(problem, ResidualKind::kTurn).size(), 1u);
    EXPECT_GT(rows_of(problem, ResidualKind::kYaw).size(), 5u);
    expect_central_differences(problem, recording, 2e-3);
  }
}

TEST(RecordingProblem, HasTheParityGradientOfItsInformation) {
  const auto simulated = recording({"sensors.simulator0.true_intrinsics_scale=1"});
  CalibrationOptions without_clock;
  without_clock.prior_sigma_clock_offset_s = 0.;  // its margin leaves out the ends
  RecordingProblem problem(simulated, without_clock);
  CalibrationPoint at;
  at.x_WI = simulated.setup.model->nominal();
  RecordingResiduals residuals;
  problem.evaluate(at, true, residuals);
  PreintegrationOptions options = simulated.setup.preintegration;
  options.parity = true;
  Preintegrator preintegrator(simulated.setup.model, options);
  PreintegratedPose pose;
  const auto samples = simulated.data.wheels();
  preintegrator.integrate(samples, samples.front().begin_ns, samples.back().end_ns, pose);
  const std::vector<int> rows = rows_of(problem, ResidualKind::kParity);
  const Eigen::MatrixXd J = residuals.J(rows, Eigen::all).leftCols(16);
  const Eigen::VectorXd gradient = J.transpose() * residuals.r(rows);
  // The margin at both ends leaves out a few samples of a robot at rest or in steady motion.
  EXPECT_LT((J.transpose() * J - pose.parity.Lambda).norm(), 1e-3 * pose.parity.Lambda.norm());
  EXPECT_LT((gradient - pose.parity.eta).norm(), 2e-2 * pose.parity.eta.norm());
}

TEST(RecordingProblem, IsZeroForTheTruthOfANoiseFreeRobotWithAClockOffset) {
  // t_reference = t_wheel + offset: the simulator's time offset, estimated with the same sign.
  const auto simulated =
      recording({"sensors.simulator0.noise=false", "sensors.simulator0.time_offset_s=0.02"});
  CalibrationOptions options;
  options.segments = Segments::kLength;
  options.segment_s = 2.;
  options.prior_sigma_clock_offset_s = 0.05;
  RecordingProblem problem(simulated, options);
  CalibrationPoint at;
  at.x_WI = simulated.setup.model->nominal();
  RecordingResiduals right, wrong;
  at.clock_offset_s = 0.02;
  problem.evaluate(at, false, right);
  at.clock_offset_s = -0.02;
  problem.evaluate(at, false, wrong);
  const std::vector<int> rows = rows_of(problem, ResidualKind::kParity, false);
  EXPECT_LT(right.r(rows).norm(), 0.05);
  EXPECT_GT(wrong.r(rows).norm(), 1.);
}

TEST(RecordingProblem, EndsSegmentsWhereTheFewPosesWereTaken) {
  // Three poses a second, which straight lines are no way between, by another clock.
  auto simulated = recording(
      {"sensors.simulator0.noise=false", "sensors.simulator0.time_offset_s=0.02",
       "sensors.simulator0.reference_rate_hz=3", "odometry.reference_time_offset_s=0.02"});
  CalibrationOptions options;
  options.segments = Segments::kLength;
  options.segment_s = 0.8;
  CalibrationPoint at;
  at.x_WI = simulated.setup.model->nominal();
  RecordingResiduals residuals;
  RecordingProblem problem(simulated, options);
  problem.evaluate(at, false, residuals);
  const auto rows = [](const RecordingProblem& of) {
    return rows_of(of, ResidualKind::kParity, false);
  };
  EXPECT_GT(problem.motions().size(), 20u);
  EXPECT_LT(residuals.r(rows(problem)).norm(), 0.05);
  // A hole is within one segment, a length below the interval means from pose to pose.
  auto& poses = simulated.motion.poses;
  poses.erase(poses.begin() + 20, poses.begin() + 30);
  RecordingProblem holed(simulated, options);
  holed.evaluate(at, false, residuals);
  EXPECT_LT(holed.motions().size(), problem.motions().size());
  EXPECT_LT(residuals.r(rows(holed)).norm(), 0.05);
  options.segment_s = 0.1;
  EXPECT_EQ(RecordingProblem(simulated, options).motions().size(), poses.size() - 3);
}

TEST(TurningAxis, PointsUpHoweverTheImuIsMountedAndDespiteABias) {
  const Eigen::Vector3d up = Eigen::Vector3d(0.3, -0.9, 0.2).normalized();
  for (const double tilt : {0., 0.3}) {
    // What the accelerometer feels may be tilted by a drive in circles: the turn is not.
    const Eigen::Vector3d force = 9.8 * (up + tilt * up.unitOrthogonal()).normalized();
    std::vector<ImuSample> imu(200);
    for (std::size_t i = 0; i < imu.size(); ++i) {
      const Eigen::Vector3d rate =
          std::sin(0.1 * static_cast<double>(i)) * up + Eigen::Vector3d(0.1, 0.05, -0.2);
      imu[i].t_ns = static_cast<std::int64_t>(i) * 10'000'000;
      Eigen::Map<Eigen::Vector3d>(imu[i].gyro_rad_per_s.data()) = rate;
      Eigen::Map<Eigen::Vector3d>(imu[i].accel_m_per_s2.data()) = force;
    }
    EXPECT_LT((turning_axis(imu) - up).norm(), 1e-9) << tilt;
  }
}

TEST(YawOfHeadings, CountsTurnsThatWrap) {
  std::vector<HeadingSample> headings(200);
  for (std::size_t i = 0; i < headings.size(); ++i) {
    headings[i] = {static_cast<std::int64_t>(i) * 10'000'000,
                   wrap_angle(0.1 * static_cast<double>(i))};
  }
  CalibrationRecording recording = with_gyro();
  recording.motion.poses = yaw_of_headings(headings);
  CalibrationOptions options;
  options.segments = Segments::kWhole;
  const RecordingProblem problem(recording, options);
  ASSERT_EQ(problem.motions().size(), 1u);
  EXPECT_NEAR(problem.motions()[0][0], 10. * problem.duration_s(), 0.05);
}

/// A driver sets it to zero before the match; what turned meanwhile is not known.
TEST(RecordingProblem, LeavesOutWhereAHeadingIsSetToAnotherValue) {
  const auto with_holes = [](const auto& set) {
    CalibrationRecording recording = with_gyro();
    std::vector<HeadingSample> headings;
    for (const StampedPose& pose : recording.motion.poses) {
      headings.push_back({pose.t_ns, yaw(pose)});
      set(headings.back());
    }
    recording.data.recorded.set("simulator0", std::vector<ImuSample>());
    recording.data.recorded.set("simulator0", headings);
    recording.motion =
        motion_reference({"headings", {}}, recording.setup, recording.data, ReferenceKind::kGyro);
    CalibrationOptions options;
    options.segments = Segments::kLength;
    options.segment_s = 1.;
    return RecordingProblem(recording, options).n_with_holes();
  };
  EXPECT_EQ(with_holes([](HeadingSample&) {}), 0);
  const auto later = [](double by_rad) {
    return [by_rad](HeadingSample& heading) {
      if (heading.t_ns > 4'500'000'000) heading.yaw_rad += by_rad;
    };
  };
  EXPECT_EQ(with_holes(later(-2.)), 1);
  EXPECT_EQ(with_holes(later(0.05)), 0) << "as a base turns in ten milliseconds";
}

TEST(HeadingJumps, AreToldAfterAPauseAndNotOfStampsThatComeInPairs) {
  std::vector<HeadingSample> headings;
  for (int i = 0; i < 300; ++i) {
    const std::int64_t pause_ns = i < 100 ? 0 : 5'000'000'000;
    headings.push_back({20'000'000LL * i + pause_ns, 0.02 * i - (i < 100 ? 0. : 1.)});
  }
  EXPECT_EQ(heading_jumps(headings), std::vector<std::size_t>{100});
  for (std::size_t i = 1; i < 300; i += 2) headings[i].t_ns = headings[i - 1].t_ns + 1'000'000;
  for (std::size_t i = 100; i < 300; ++i) headings[i].yaw_rad += 1.;
  EXPECT_TRUE(heading_jumps(headings).empty());
}

/// A tenth of a second is a hole of an IMU at 200 Hz, not of one at 8 Hz.
TEST(MotionReferenceOfAGyro, HasGapsByItsOwnRate) {
  CalibrationRecording recording = with_gyro();
  EXPECT_EQ(recording.motion.max_gap_s, 0.1);
  const auto imu = recording.data.imu();
  std::vector<ImuSample> slow;
  for (std::size_t i = 0; i < imu.size(); i += 25) slow.push_back(imu[i]);
  recording.data.recorded.set("simulator0", slow);
  const MotionReference motion =
      motion_reference({"gyro", {}}, recording.setup, recording.data, ReferenceKind::kGyro);
  EXPECT_NEAR(motion.max_gap_s, 2.5 * 0.125, 1e-6);
}

/// Poses of a prism, or of a receiver: one orientation all the time tells no turns.
TEST(MotionReferenceOfPoses, HasOrientations) {
  CalibrationRecording driven = recording();
  const Recording label{"drive", {}};
  EXPECT_EQ(motion_reference(label, driven.setup, driven.data, ReferenceKind::kAuto).kind,
            ReferenceKind::kPoses);
  for (StampedPose& pose : driven.data.reference) pose.q_BtoW.setIdentity();
  EXPECT_THAT(testing::error_of([&] {
                motion_reference(label, driven.setup, driven.data, ReferenceKind::kAuto);
              }),
              ::testing::HasSubstr("positions alone tell no turns"));
  // Who goes straight on does not turn, whatever wheels say that are still to be calibrated.
  for (std::size_t i = 0; i < driven.data.reference.size(); ++i) {
    driven.data.reference[i].p_BinW = {0.01 * static_cast<double>(i), 0., 0.};
  }
  EXPECT_EQ(motion_reference(label, driven.setup, driven.data, ReferenceKind::kAuto).kind,
            ReferenceKind::kPoses);
  for (std::size_t i = driven.data.reference.size() / 2; i < driven.data.reference.size(); ++i) {
    driven.data.reference[i].p_BinW.x() =
        driven.data.reference[driven.data.reference.size() - 1 - i].p_BinW.x();
  }
  EXPECT_THAT(testing::error_of([&] {
                motion_reference(label, driven.setup, driven.data, ReferenceKind::kAuto);
              }),
              ::testing::HasSubstr("positions alone tell no turns"));
}

TEST(YawOfGyro, IsTheIntegralOfTheTurn) {
  const CalibrationRecording recording = with_gyro();
  const auto states = recording.data.states();
  ASSERT_GT(states.size(), 10u);
  const auto turned = [](const auto& q) { return yaw(to_quaternion(q)); };
  const double truth =
      wrap_angle(turned(states.back().q_ItoG_xyzw) - turned(states[0].q_ItoG_xyzw));
  const auto begin = interpolate(recording.motion.poses, states[0].t_ns, 1.);
  const auto end = interpolate(recording.motion.poses, states.back().t_ns, 1.);
  ASSERT_TRUE(begin && end);
  EXPECT_NEAR(wrap_angle(yaw(*end) - yaw(*begin) - truth), 0., 0.02);
}

}  // namespace
}  // namespace viwo

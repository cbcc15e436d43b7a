// Residuals of the batch calibration: derivatives by all unknowns, signs of extrinsics and clock.
#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "calibration_problem.hpp"
#include "simulated.hpp"
#include "viwo/math/se2.hpp"
#include "viwo/testing/jacobian.hpp"

namespace viwo {
namespace {

using namespace calibration;
using testing::central_difference;
using testing::jacobian_mismatch;

CalibrationRecording recording(const std::vector<std::string>& assignments = {}) {
  CalibrationRecording recording;
  recording.setup = read_run(testing::simulated("icr_sweep", assignments), testing::registry());
  recording.data = collect(recording.setup);
  return recording;
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

TEST(RecordingProblem, HasThePoseJacobianOfCentralDifferences) {
  const auto simulated = recording({"sensors.simulator0.true_intrinsics_scale=1"});
  CalibrationOptions options;
  options.segment_s = 2.;
  options.estimate_extrinsics = true;
  options.clock_offset_sigma_s = 0.01;
  for (const bool weighted : {false, true}) {
    auto copy = simulated;
    copy.setup.preintegration.twist.noise_weighted = weighted;
    RecordingProblem problem(copy, options);
    CalibrationPoint at;
    at.x_WI = copy.setup.model->nominal();
    at.extrinsics = {0.02, -0.01, 0.05};
    at.clock_offset_s = 0.004;
    RecordingResiduals residuals;
    problem.evaluate(at, true, residuals);
    const Eigen::MatrixXd J = residuals.J_pose;
    Eigen::VectorXd x(20);
    x << at.x_WI, at.extrinsics, at.clock_offset_s;
    const Eigen::MatrixXd numeric = central_difference(
        [&](const Eigen::VectorXd& moved) -> Eigen::VectorXd {
          CalibrationPoint point;
          point.x_WI = moved.head<16>();
          point.extrinsics = moved.segment<3>(16);
          point.clock_offset_s = moved[19];
          RecordingResiduals there;
          problem.evaluate(point, false, there);
          return there.pose;
        },
        x, 1e-6);
    std::vector<std::string> names;
    for (const auto& spec : copy.setup.model->description().intrinsics) names.push_back(spec.name);
    names.insert(names.end(), {"x_OinB", "y_OinB", "yaw_OinB", "clock"});
    // The weights of the weighted fit are held, and the clock moves in whole nanoseconds.
    EXPECT_EQ(jacobian_mismatch(J, numeric, names, weighted ? 2e-2 : 2e-3), "");
  }
}

TEST(RecordingProblem, HasTheParityGradientOfItsInformation) {
  const auto simulated = recording({"sensors.simulator0.true_intrinsics_scale=1"});
  RecordingProblem problem(simulated, {});
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
  const Eigen::MatrixXd J = residuals.J_parity.leftCols(16);
  const Eigen::VectorXd gradient = J.transpose() * residuals.parity;
  // The margin at both ends leaves out a few samples of a robot at rest or in steady motion.
  EXPECT_LT((J.transpose() * J - pose.parity.Lambda).norm(), 1e-3 * pose.parity.Lambda.norm());
  EXPECT_LT((gradient - pose.parity.eta).norm(), 2e-2 * pose.parity.eta.norm());
}

TEST(RecordingProblem, IsZeroForTheTruthOfANoiseFreeRobotWithAClockOffset) {
  // t_reference = t_wheel + offset: the simulator's time offset, estimated with the same sign.
  const auto simulated =
      recording({"sensors.simulator0.noise=false", "sensors.simulator0.time_offset_s=0.02"});
  CalibrationOptions options;
  options.segment_s = 2.;
  options.clock_offset_sigma_s = 0.05;
  RecordingProblem problem(simulated, options);
  CalibrationPoint at;
  at.x_WI = simulated.setup.model->nominal();
  RecordingResiduals right, wrong;
  at.clock_offset_s = 0.02;
  problem.evaluate(at, false, right);
  at.clock_offset_s = -0.02;
  problem.evaluate(at, false, wrong);
  EXPECT_LT(right.pose.norm(), 0.05);
  EXPECT_GT(wrong.pose.norm(), 1.);
}

}  // namespace
}  // namespace viwo

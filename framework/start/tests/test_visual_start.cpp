// The start from cameras and IMU in motion: right, consistent with its covariance, and refused
// where the measurements do not tell.
#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "synthetic_flight.hpp"
#include "viwo/camera/camera_chain.hpp"
#include "viwo/math/chi2.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/start/visual_start.hpp"

namespace viwo::visual {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::Flight;
using testing::flight_cameras;
using testing::FlightOptions;

/// Tilt (about two axes across the vertical), velocity, biases; G is turned so that its yaw is that
/// of the estimate.
struct FlightError {
  VectorXd error{11};
  MatrixXd P;
  double nees() const { return error.dot(P.llt().solve(error)); }
};
FlightError error_of(const Flight& flight, const ImuPrior& prior) {
  const double t = flight.seconds(prior.t_ns);
  const Matrix3d R_GtoI = flight.R_ItoG(t).transpose();
  const Vector3d z = prior.state.R_GtoI.col(2), true_z = R_GtoI.col(2);
  const Vector3d axis = z.cross(true_z);
  const Vector3d turn = axis * (axis.norm() > 0. ? std::asin(axis.norm()) / axis.norm() : 1.);
  const Matrix3d R = exp_so3(turn) * prior.state.R_GtoI;  // the truth, in the G of the estimate
  const Vector3d v_IinG = R.transpose() * R_GtoI * flight.velocity(t);
  const Vector3d a = z.unitOrthogonal(), b = z.cross(a);
  MatrixXd S = MatrixXd::Zero(11, kImuSize);
  S.block<1, 3>(0, kThetaColumn) = a.transpose();
  S.block<1, 3>(1, kThetaColumn) = b.transpose();
  S.block<9, 9>(2, kVelocityColumn).setIdentity();
  FlightError result;
  result.error << -a.dot(turn), -b.dot(turn), v_IinG - prior.state.v_IinG,
      flight.gyro_bias - prior.state.gyro_bias, flight.accel_bias - prior.state.accel_bias;
  result.P = S * prior.P * S.transpose();
  return result;
}

VisualStartOptions with_cameras(int n) {
  VisualStartOptions options = flight_cameras(n);
  options.sigma_yaw_rad = 1e-5;  // a matter of definition, of which there is no error
  return options;
}

TEST(VisualStart, IsExactForMeasurementsWithoutNoise) {
  for (const int n_cameras : {1, 2}) {
    const VisualStartOptions options = with_cameras(n_cameras);
    const Flight flight(options, {.sigma_px = 0., .noise = 0., .biases = 0., .calibration = 0.}, 1);
    const auto attempt = start_from_images(flight.imu, flight.tracks, options);
    ASSERT_TRUE(attempt.prior) << attempt.obstacle;
    const FlightError error = error_of(flight, *attempt.prior);
    // Readings are linear in between, to 1e-5 m/s^2 and 1e-5 rad/s here.
    EXPECT_LT(error.error.cwiseAbs().maxCoeff(), 2e-3) << error.error.transpose();
    EXPECT_EQ(attempt.prior->state.p_IinG, Vector3d::Zero());
    EXPECT_EQ(attempt.prior->t_ns, flight.tracks.back().t_ns + 4'000'000);
  }
}

/// Cameras that are known better to each other than to the IMU.
VisualStartOptions chained(VisualStartOptions options, double relative) {
  std::vector<CameraView> cameras;
  for (std::size_t c = 0; c < options.cameras.size(); ++c) {
    CameraPrior& prior = options.cameras[c];
    if (relative < 1.) prior.sigma_extrinsics << 0.01, 0.01, 0.01, 0.01, 0.01, 0.01;
    cameras.push_back(prior.camera);
    const BlockSpec extrinsics = camera_blocks(c, prior).front();
    for (const BlockEntry& entry : extrinsics.entries) {
      options.correlations.entries.push_back(entry.name);
    }
  }
  options.correlations.matrix = chain_correlations(relative, cameras);
  return options;
}

/// Mean NEES over flights, and how many of them started.
struct Consistency {
  double nees = 0.;
  int starts = 0;
  /// Within two-sided bounds of 99.9 %.
  bool holds() const {
    const double dof = 11. * starts;
    return nees * starts > chi2_quantile(0.0005, dof) && nees * starts < chi2_quantile(0.9995, dof);
  }
};
constexpr int kFlights = 60;
/// With `cameras`, which the start is `told` of.
Consistency fly(const VisualStartOptions& cameras, const FlightOptions& flown,
                double covariance_scale, const VisualStartOptions& told) {
  Consistency result;
  for (int seed = 0; seed < kFlights; ++seed) {
    const Flight flight(cameras, flown, static_cast<std::uint64_t>(seed));
    const auto attempt = start_from_images(flight.imu, flight.tracks, told);
    if (!attempt.prior) continue;
    FlightError error = error_of(flight, *attempt.prior);
    error.P *= covariance_scale;
    result.nees += error.nees();
    ++result.starts;
  }
  result.nees /= result.starts;
  return result;
}
Consistency fly(int n_cameras, const FlightOptions& flown, double covariance_scale = 1.,
                double relative = 1.) {
  const VisualStartOptions options = chained(with_cameras(n_cameras), relative);
  return fly(options, flown, covariance_scale, options);
}

TEST(VisualStart, IsConsistentWithItsCovarianceWithOneCamera) {
  const Consistency found = fly(1, {.duration_s = 2.3});
  EXPECT_TRUE(found.holds()) << found.nees << " of 11";
  EXPECT_GT(found.starts, kFlights * 9 / 10);
}

TEST(VisualStart, IsConsistentWithItsCovarianceWithTwoCameras) {
  const Consistency found = fly(2, {.duration_s = 1.3});
  EXPECT_TRUE(found.holds()) << found.nees << " of 11";
  EXPECT_GT(found.starts, kFlights * 9 / 10);
}

TEST(VisualStart, IsConsistentWithCamerasThatAreKnownToEachOther) {
  const FlightOptions flown{.duration_s = 1.3, .relative = 0.1};
  const Consistency found = fly(2, flown, 1., 0.1);
  EXPECT_TRUE(found.holds()) << found.nees << " of 11";
  EXPECT_GT(found.starts, kFlights * 9 / 10);
  EXPECT_FALSE(fly(2, {.duration_s = 1.3}, 1., 0.1).holds()) << "cameras that are not";
}

TEST(VisualStart, IsConsistentThroughARollingShutterThatIsKnown) {
  VisualStartOptions rolling = chained(with_cameras(1), 1.);
  CameraView& camera = rolling.cameras.front().camera;
  camera.line_delay_s = 3e-5;
  const FlightOptions flown{.duration_s = 2.3};
  const Consistency known = fly(rolling, flown, 1., rolling);
  EXPECT_TRUE(known.holds()) << known.nees << " of 11";
  EXPECT_GT(known.starts, kFlights * 9 / 10);
  VisualStartOptions told = rolling;
  told.cameras.front().camera.line_delay_s = 0.;
  told.cameras.front().camera.t_CtoI_s += camera.middle_s();
  const Consistency not_known = fly(rolling, flown, 1., told);
  EXPECT_FALSE(not_known.holds()) << not_known.nees << " of 11";
  EXPECT_GT(not_known.starts, kFlights / 2);
}

TEST(VisualStart, ConsistencyCheckSeesCovariancesAndCalibrationsThatAreWrong) {
  EXPECT_FALSE(fly(1, {}, 0.7).holds());
  EXPECT_FALSE(fly(1, {}, 1.4).holds());
  EXPECT_FALSE(fly(1, {.calibration = 3.}).holds());
}

TEST(VisualStart, LeavesOutPointsThatAreWrong) {
  // One of fifty sights: every fifth track has one.
  const Consistency found = fly(1, {.outliers = 0.02});
  EXPECT_GT(found.starts, kFlights * 9 / 10);
  EXPECT_TRUE(found.holds()) << found.nees << " of 11";
}

std::string_view obstacle(int n_cameras, const FlightOptions& flown, std::uint64_t seed = 3) {
  const VisualStartOptions options = with_cameras(n_cameras);
  const Flight flight(options, flown, seed);
  const auto attempt = start_from_images(flight.imu, flight.tracks, options);
  EXPECT_NE(attempt.prior.has_value(), !attempt.obstacle.empty());
  return attempt.obstacle;
}

TEST(VisualStart, WaitsForAWindowOfImages) {
  EXPECT_EQ(obstacle(1, {.duration_s = 1.}), "fewer than 6 images within start_window_s");
  EXPECT_EQ(start_from_images({}, {}, with_cameras(1)).obstacle,
            "fewer than 6 images within start_window_s");
}

constexpr std::string_view kUncertain =
    "images and accelerometer do not tell velocity and scale well enough";

TEST(VisualStart, RefusesAMotionThatDoesNotTellTheScale) {
  EXPECT_EQ(obstacle(1, {.amplitude_m = 0.}), "the images show too little parallax");
  // Straight on at a constant speed: as well twice as fast, past points twice as far away.
  const FlightOptions straight{.amplitude_m = 0., .turn_rad = 0., .cruise_m_per_s = {0., 1., 0.}};
  EXPECT_EQ(obstacle(1, straight), kUncertain);
  EXPECT_EQ(obstacle(2, straight), "") << "two cameras know how far points are away";
}

TEST(VisualStart, RefusesWhatContradictsItself) {
  const VisualStartOptions options = with_cameras(1);
  const Flight flight(options, {}, 3), other(options, {}, 4);
  EXPECT_FALSE(start_from_images(other.imu, flight.tracks, options).prior);
  std::vector<ImuSample> imu = flight.imu;
  for (ImuSample& sample : imu) {
    for (double& force : sample.accel_m_per_s2) force = -force;
  }
  EXPECT_FALSE(start_from_images(imu, flight.tracks, options).prior);
  auto tracks = flight.tracks;  // every image has names of its own for the points
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    std::rotate(tracks[i].points.begin(), tracks[i].points.begin() + static_cast<int>(i),
                tracks[i].points.end());
    for (std::size_t k = 0; k < tracks[i].points.size(); ++k) {
      tracks[i].points[k].id = static_cast<std::int64_t>(k);
    }
  }
  EXPECT_FALSE(start_from_images(flight.imu, tracks, options).prior);
}

TEST(VisualStart, RefusesAHoleInTheImu) {
  const VisualStartOptions options = with_cameras(1);
  const Flight flight(options, {}, 3);
  std::vector<ImuSample> imu = flight.imu;
  imu.erase(imu.begin() + 150, imu.begin() + 165);
  EXPECT_EQ(start_from_images(imu, flight.tracks, options).obstacle,
            "a hole in the IMU of more than 0.05 s");
}

TEST(VisualStart, HasItsOwnYawAndOrigin) {
  VisualStartOptions options = flight_cameras(2);
  options.sigma_yaw_rad = 0.02;
  options.sigma_position_m = 0.03;
  const Flight flight(options, {}, 5);
  const auto prior = start_from_images(flight.imu, flight.tracks, options).prior;
  ASSERT_TRUE(prior);
  const Vector3d z = prior->state.R_GtoI.col(2);
  EXPECT_NEAR(std::sqrt(z.dot(prior->P.topLeftCorner<3, 3>() * z)), 0.02, 1e-4);
  EXPECT_NEAR(std::sqrt(prior->P(kPositionColumn, kPositionColumn)), 0.03, 1e-4);
  // The x axis of G, the vertical and the x axis of I lie in one plane.
  EXPECT_NEAR(prior->state.R_GtoI.col(0).dot(z.cross(Vector3d::UnitX())), 0., 1e-12);
  EXPECT_LT((prior->P - prior->P.transpose()).norm(), 1e-12);
  EXPECT_EQ(prior->P.llt().info(), Eigen::Success);
}

}  // namespace
}  // namespace viwo::visual

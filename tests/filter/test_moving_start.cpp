// The start while moving: consistent with its covariance in simulation, and refused when the
// measurements do not allow it.
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "viwo/math/chi2.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/sim/body_trajectory.hpp"
#include "viwo/sim/encoder_simulator.hpp"
#include "viwo/sim/imu_simulator.hpp"
#include "viwo/start/moving_start.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  VectorXd vector(Eigen::Index size) {
    return VectorXd::NullaryExpr(size, [this] { return normal_(engine_); });
  }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

/// Three omni wheels: every planar twist, A constant, the radii are the intrinsics.
class OmniBase final : public KinematicModel {
 public:
  void describe(ModelDescription& out) const override {
    out.n_drive = out.n_rows = 3;
    out.constant_A = true;
    for (int i = 0; i < 3; ++i) {
      out.intrinsics.push_back({"r_" + std::to_string(i + 1), "m", 0.05, 0.0005, false, {i, 1}});
      out.noises.push_back({NoiseKind::kDrive, i, 0.01, {i, 1}});
    }
  }
  Status rows(const EncoderSample& y, const Intrinsics& x_WI, bool /*A_is_current*/,
              RowSystem& out) const override {
    for (int i = 0; i < 3; ++i) {
      const double angle = 0.3 + 2. * M_PI / 3. * i;  // of the wheel seen from O
      out.A.row(i) << -std::sin(angle), std::cos(angle), 0.2;
      out.b[i] = x_WI[i] * y.drive_rad_per_s[static_cast<std::size_t>(i)];
    }
    return Status::kOk;
  }
  void intrinsic_derivatives(const EncoderSample& /*y*/, const Intrinsics& x_WI,
                             const RowSystem& /*rows*/, const RowVector& b, const Twist& /*xi*/,
                             const RowVector& /*e*/, IntrinsicDerivatives& out) const override {
    for (int i = 0; i < 3; ++i) out.J(i, i) = b[i] / x_WI[i];
  }
  void noise_derivatives(const EncoderSample& /*y*/, const Intrinsics& x_WI,
                         const RowSystem& /*rows*/, const RowVector& /*b*/, const Twist& /*xi*/,
                         const RowVector& /*e*/, NoiseDerivatives& out) const override {
    for (int i = 0; i < 3; ++i) out.J(i, i) = x_WI[i];
  }
  Status inverse(const Twist& xi, const Intrinsics& x_WI, const RowVector& slip,
                 EncoderSample& y) const override {
    RowSystem system;
    system.A.resize(3, 3);
    system.b.resize(3);
    rows(y, x_WI, false, system);
    const Vector3d b = system.A * xi + slip;
    for (int i = 0; i < 3; ++i) y.drive_rad_per_s[static_cast<std::size_t>(i)] = b[i] / x_WI[i];
    return Status::kOk;
  }
};

/// What the estimator is told.
MovingStartOptions make_options() {
  MovingStartOptions options;
  options.model = std::make_shared<const WheelModel>(std::make_shared<const OmniBase>());
  WheelsPrior& prior = options.wheels;
  prior.wheels.model = &options.model->model();
  prior.wheels.R_ItoO = exp_so3({0.1, -0.2, 0.7});
  prior.wheels.p_IinO << 0.15, -0.1, 0.2;
  prior.wheels.t_OtoI_s = 0.004;
  prior.wheels.x_WI = options.model->nominal();
  prior.sigma_extrinsics << 0.01, 0.01, 0.01, 0.03, 0.03, 0.03;
  prior.sigma_time_offset_s = 0.005;
  prior.sigma_intrinsics = options.model->prior_sigma();
  VectorXd sigma(prior.sigma_intrinsics.size() + 6);
  sigma << prior.sigma_intrinsics, prior.sigma_extrinsics;
  options.P_wheels = sigma.cwiseAbs2().asDiagonal();
  // The simulated wheels do not slip and the ground is flat; G is where the estimate says.
  options.sigma_velocity_m_per_s = 1e-4;
  options.sigma_yaw_rate_rad_per_s = 1e-4;
  options.sigma_tilt_rate_rad_per_s = 1e-4;
  options.sigma_yaw_rad = 1e-6;
  return options;
}

struct Drive {
  std::vector<ImuSample> imu;
  std::vector<EncoderSample> encoders;
  std::vector<sim::ImuBias> biases;
  sim::Mounting mounting;
};

constexpr std::int64_t kStartNs = 3'000'000'000;

/// Measurements of a base whose calibration and biases are off by draws from the priors, times
/// `error_scale`.
Drive simulate(const sim::BodyTrajectory& trajectory, const MovingStartOptions& options,
               std::uint64_t seed, double duration_s, double error_scale = 1., bool noise = true) {
  Random random(seed);
  const WheelsPrior& prior = options.wheels;
  const VectorXd draw = error_scale * random.vector(7);
  Drive drive;
  drive.mounting.R_ItoO =
      exp_so3(-prior.sigma_extrinsics.head<3>().cwiseProduct(draw.head<3>())) * prior.wheels.R_ItoO;
  drive.mounting.p_IinO =
      prior.wheels.p_IinO + prior.sigma_extrinsics.tail<3>().cwiseProduct(draw.segment<3>(3));
  sim::ImuSimulation imu;
  imu.duration_s = duration_s;
  imu.start_ns = kStartNs;
  imu.noise = noise;
  imu.densities = options.noise;
  imu.gyro_bias = error_scale * options.sigma_gyro_bias_rad_per_s * random.vector(3);
  imu.accel_bias = error_scale * options.sigma_accel_bias_m_per_s2 * random.vector(3);
  sim::SimulatedImu simulated = sim::simulate_imu(trajectory, drive.mounting, imu, seed);
  drive.imu = std::move(simulated.samples);
  drive.biases = std::move(simulated.biases);
  sim::EncoderSimulation wheels;
  wheels.duration_s = duration_s;
  wheels.start_ns = kStartNs;
  wheels.noise = noise;
  wheels.time_offset_s = prior.wheels.t_OtoI_s + prior.sigma_time_offset_s * draw[6];
  drive.encoders = sim::simulate_encoders(
      options.model->model(),
      sim::perturbed_intrinsics(options.model->description(), error_scale, seed),
      [&](double t_s) { return trajectory.twist(t_s); }, "test", wheels, seed);
  return drive;
}

sim::BodyTrajectory trajectory_of(const char* motion, const sim::Ground& ground = {},
                                  double ramp_s = 1.) {
  sim::MotionOptions options;
  options.ramp_s = ramp_s;
  return sim::BodyTrajectory::drive(sim::PlanarMotion(motion, options), ground, -0.3, 6.5);
}

/// Error of tilt (2), velocity (3), gyro bias (3), accelerometer bias (3), and its covariance.
constexpr int kDof = 11;
struct StartError {
  VectorXd error{kDof};
  MatrixXd P;
};

StartError start_error(const sim::BodyTrajectory& trajectory, const Drive& drive,
                       const ImuPrior& prior) {
  const double t_s = seconds_between(kStartNs, prior.t_ns);
  const sim::BodyMotion truth = trajectory.imu(t_s, drive.mounting);
  const Vector3d z = prior.state.R_GtoI.col(2);
  const Vector3d true_z = truth.R_BtoG.transpose().col(2);
  // The yaw of G is a matter of definition: the smallest turn that makes the vertical the true one.
  const Vector3d axis = z.cross(true_z);
  const Vector3d dtheta = -axis * (axis.norm() > 0. ? std::asin(axis.norm()) / axis.norm() : 1.);
  const Matrix3d R_GtoI = exp_so3(-dtheta) * prior.state.R_GtoI;
  const Vector3d v_IinI = truth.R_BtoG.transpose() * truth.v_BinG;
  const auto sample = static_cast<std::size_t>(std::lround(t_s * 200.));
  const Vector3d a = z.unitOrthogonal(), b = z.cross(a);
  MatrixXd S = MatrixXd::Zero(kDof, kImuSize);
  S.block<1, 3>(0, kThetaColumn) = a.transpose();
  S.block<1, 3>(1, kThetaColumn) = b.transpose();
  S.block<3, 3>(2, kVelocityColumn).setIdentity();
  S.block<3, 3>(5, kGyroBiasColumn).setIdentity();
  S.block<3, 3>(8, kAccelBiasColumn).setIdentity();
  StartError result;
  result.error << a.dot(dtheta), b.dot(dtheta), R_GtoI.transpose() * v_IinI - prior.state.v_IinG,
      drive.biases[sample].gyro - prior.state.gyro_bias,
      drive.biases[sample].accel - prior.state.accel_bias;
  result.P = S * prior.P * S.transpose();
  return result;
}

double nees(const VectorXd& error, const MatrixXd& P) { return error.dot(P.llt().solve(error)); }

constexpr int kRuns = 200;

/// Whether the mean of `kRuns` chi-square numbers is within two-sided 99.9 % bounds.
bool consistent(double mean, int dof) {
  const double sum = mean * kRuns, total = dof * static_cast<double>(kRuns);
  return sum > chi2_quantile(0.0005, total) && sum < chi2_quantile(0.9995, total);
}

struct MeanNees {
  double all = 0., tilt = 0., velocity = 0., gyro_bias = 0.;
  int started = 0;
};

/// `correlation` multiplies the covariance of the tilt with the rest.
MeanNees monte_carlo(const sim::BodyTrajectory& trajectory, const MovingStartOptions& truth,
                     const MovingStartOptions& believed, double correlation = 1.) {
  MeanNees mean;
  for (int run = 0; run < kRuns; ++run) {
    const auto seed = static_cast<std::uint64_t>(100 + run);
    const Drive drive = simulate(trajectory, truth, seed, 1.3 + 0.02 * run);
    const auto prior = start_from_motion(drive.imu, drive.encoders, believed).prior;
    if (!prior) continue;
    StartError start = start_error(trajectory, drive, *prior);
    start.P.topRightCorner<2, kDof - 2>() *= correlation;
    start.P.bottomLeftCorner<kDof - 2, 2>() *= correlation;
    mean.all += nees(start.error, start.P);
    mean.tilt += nees(start.error.head<2>(), start.P.topLeftCorner<2, 2>());
    mean.velocity += nees(start.error.segment<3>(2), start.P.block<3, 3>(2, 2));
    mean.gyro_bias += nees(start.error.segment<3>(5), start.P.block<3, 3>(5, 5));
    ++mean.started;
  }
  for (double* sum : {&mean.all, &mean.tilt, &mean.velocity, &mean.gyro_bias}) {
    *sum /= mean.started;
  }
  return mean;
}

TEST(MovingStart, IsConsistentWithItsCovariance) {
  const MovingStartOptions options = make_options();
  const MeanNees mean = monte_carlo(trajectory_of("icr_sweep"), options, options);
  EXPECT_GT(mean.started, kRuns * 99 / 100);
  EXPECT_TRUE(consistent(mean.all, kDof)) << mean.all;
  EXPECT_TRUE(consistent(mean.tilt, 2)) << mean.tilt;
  EXPECT_TRUE(consistent(mean.velocity, 3)) << mean.velocity;
  EXPECT_TRUE(consistent(mean.gyro_bias, 3)) << mean.gyro_bias;
}

TEST(MovingStart, ConsistencyCheckSeesAWrongSignOfTheCorrelation) {
  const MovingStartOptions options = make_options();
  EXPECT_FALSE(
      consistent(monte_carlo(trajectory_of("icr_sweep"), options, options, -1.).all, kDof));
}

TEST(MovingStart, ConsistencyCheckSeesAWrongSignOfTheLeverArm) {
  const MovingStartOptions options = make_options();
  MovingStartOptions wrong = options;
  wrong.wheels.wheels.p_IinO *= -1.;
  EXPECT_FALSE(consistent(monte_carlo(trajectory_of("icr_sweep"), options, wrong).velocity, 3));
}

TEST(MovingStart, IsNotTooSureOnUnevenGround) {
  MovingStartOptions options = make_options();
  options.sigma_tilt_rate_rad_per_s = MovingStartOptions().sigma_tilt_rate_rad_per_s;
  const auto trajectory = trajectory_of("icr_sweep", sim::Ground::uneven(0.02, 3.));
  const MeanNees mean = monte_carlo(trajectory, options, options);
  EXPECT_GT(mean.started, kRuns * 95 / 100);
  // The tilt rate is no Gaussian number of that sigma, so there are no exact bounds.
  EXPECT_LT(mean.all, 1.3 * kDof);
  EXPECT_GT(mean.all, 0.6 * kDof);
  // The flat ground that this is not would be claimed in vain.
  EXPECT_GT(monte_carlo(trajectory, options, make_options()).gyro_bias, 30.);
}

TEST(MovingStart, WorksAtRest) {
  const MovingStartOptions options = make_options();
  const MeanNees mean = monte_carlo(trajectory_of("stationary"), options, options);
  EXPECT_GT(mean.started, kRuns * 99 / 100);
  EXPECT_TRUE(consistent(mean.all, kDof)) << mean.all;
  EXPECT_TRUE(consistent(mean.tilt, 2)) << mean.tilt;
}

TEST(MovingStart, IsExactWithoutNoiseAndErrors) {
  const MovingStartOptions options = make_options();
  for (const char* motion : {"icr_sweep", "circle", "straight", "spin", "stationary"}) {
    const auto trajectory = trajectory_of(motion, {}, 0.);
    const Drive drive = simulate(trajectory, options, 1, 3., 0., false);
    const auto prior = start_from_motion(drive.imu, drive.encoders, options).prior;
    ASSERT_TRUE(prior) << motion;
    const StartError start = start_error(trajectory, drive, *prior);
    // Means over 0.1 s for velocities, trapezoids between samples.
    EXPECT_LT(start.error.head<2>().norm(), 1e-4) << motion;
    EXPECT_LT(start.error.segment<3>(2).norm(), 5e-4) << motion;
    EXPECT_LT(start.error.segment<3>(5).norm(), 1e-4) << motion;
    EXPECT_LT(start.error.tail<3>().norm(), 1e-12) << motion;
    EXPECT_EQ(prior->state.p_IinG, Vector3d::Zero());
    EXPECT_NEAR(prior->state.R_GtoI.determinant(), 1., 1e-12);
    EXPECT_LT((prior->P - prior->P.transpose()).norm(), 1e-12);
    EXPECT_GT(prior->P.llt().matrixL().toDenseMatrix().diagonal().minCoeff(), 0.);
  }
}

class MovingStartRefusal : public ::testing::Test {
 protected:
  /// What is in the way of a start; empty when there is one.
  std::string_view obstacle() const {
    const StartAttempt attempt = start_from_motion(drive_.imu, drive_.encoders, options_);
    EXPECT_NE(attempt.prior.has_value(), !attempt.obstacle.empty());
    return attempt.obstacle;
  }
  bool starts() const { return obstacle().empty(); }

  MovingStartOptions options_ = make_options();
  Drive drive_ = simulate(trajectory_of("circle"), options_, 7, 3.);
};

TEST_F(MovingStartRefusal, WaitsForAWholeWindow) {
  EXPECT_TRUE(starts());
  // A second, the clock's margin and half of the mean of a velocity at both ends.
  drive_.imu.resize(1 + 200 * 11 / 10);
  EXPECT_EQ(obstacle(), "fewer measurements than start_window_s asks for");
  drive_ = simulate(trajectory_of("circle"), options_, 7, 1.2);
  EXPECT_TRUE(starts());
  drive_.encoders.resize(105);
  EXPECT_FALSE(starts());
  drive_.encoders.clear();
  EXPECT_EQ(obstacle(), "no encoder samples");
  drive_.imu.clear();
  EXPECT_FALSE(starts());
}

TEST_F(MovingStartRefusal, SeesHolesInTheWindow) {
  const Drive whole = drive_;
  drive_.encoders.erase(drive_.encoders.begin() + 250, drive_.encoders.begin() + 256);
  EXPECT_EQ(obstacle(), "encoder samples are missing in the window, or contradict each other");
  drive_ = whole;
  drive_.encoders.erase(drive_.encoders.begin() + 100, drive_.encoders.begin() + 106);
  EXPECT_TRUE(starts()) << "long before";
  drive_ = whole;
  drive_.imu.erase(drive_.imu.begin() + 500, drive_.imu.begin() + 512);
  EXPECT_EQ(obstacle(), "a hole in the IMU of more than 0.05 s");
}

TEST_F(MovingStartRefusal, SeesGravityThatCannotBe) {
  for (ImuSample& sample : drive_.imu) sample.accel_m_per_s2[2] *= 1.05;
  EXPECT_EQ(obstacle(),
            "what the wheels leave of the specific force is not gravity within four sigma");
}

TEST_F(MovingStartRefusal, SeesWheelsThatTurnOtherwiseThanTheImu) {
  for (EncoderSample& sample : drive_.encoders) {
    for (double& rate : sample.drive_rad_per_s) rate *= 1.3;
  }
  EXPECT_EQ(obstacle(), "gyro and wheels turn otherwise by more than four sigma");
}

TEST_F(MovingStartRefusal, SeesWheelsThatSayNothing) {
  for (EncoderSample& sample : drive_.encoders) sample.drive_rad_per_s.fill(std::nan(""));
  EXPECT_EQ(obstacle(), "encoder samples are missing in the window, or contradict each other");
}

}  // namespace
}  // namespace viwo

// The simulated IMU against closed forms, strapdown integration and the statistics it was asked
// for.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "viwo/math/so3.hpp"
#include "viwo/sim/imu_simulator.hpp"

namespace viwo::sim {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d gyro(const ImuSample& sample) { return Vector3d(sample.gyro_rad_per_s.data()); }
Vector3d accel(const ImuSample& sample) { return Vector3d(sample.accel_m_per_s2.data()); }

ImuSimulation silent_imu(double duration_s, double rate_hz) {
  ImuSimulation options;
  options.duration_s = duration_s;
  options.rate_hz = rate_hz;
  options.noise = false;
  return options;
}

BodyTrajectory still(double end_s) {
  return BodyTrajectory::drive(PlanarMotion("stationary"), Ground(), -0.5, end_s);
}

TEST(ImuSimulator, AtRestItReadsGravityOnlyUpwards) {
  const Mounting tilted{rotation_from_euler(0., 0., M_PI / 6.), {1., 2., 3.}};
  for (const ImuSample& sample : simulate_imu(still(2.), tilted, silent_imu(1., 200.), 1).samples) {
    EXPECT_EQ(gyro(sample), Vector3d::Zero());
    // Rolled by 30 degrees to the right side down: up is half along its y axis.
    EXPECT_NEAR((accel(sample) - 9.81 * Vector3d(0., 0.5, std::sqrt(0.75))).norm(), 0., 1e-12);
  }
}

TEST(ImuSimulator, OnACircleItReadsTheCentripetalAcceleration) {
  const auto trajectory =
      BodyTrajectory::drive(PlanarMotion("circle", {0.5, 0.6, 0.}), Ground(), -0.5, 11.);
  const Mounting ahead{Matrix3d::Identity(), {0.4, 0., 0.}};
  for (const ImuSample& sample :
       simulate_imu(trajectory, ahead, silent_imu(10., 100.), 1).samples) {
    EXPECT_NEAR((gyro(sample) - Vector3d(0., 0., 0.6)).norm(), 0., 1e-7);
    const Vector3d expected(-0.4 * 0.36, 0.5 * 0.6, 9.81);
    EXPECT_NEAR((accel(sample) - expected).norm(), 0., 1e-6);
  }
}

TEST(ImuSimulator, StampsCoverTheDurationAndKeepTheirEpoch) {
  ImuSimulation options = silent_imu(1.0037, 200.);
  options.start_ns = 1'700'000'000'000'000'001;
  const auto samples = simulate_imu(still(2.), {}, options, 1).samples;
  EXPECT_EQ(samples.front().t_ns, options.start_ns);
  EXPECT_EQ(samples[1].t_ns, options.start_ns + 5'000'000);
  EXPECT_EQ(samples.back().t_ns, options.start_ns + 1'005'000'000);
  EXPECT_DOUBLE_EQ(imu_end_s(options), 1.005);
}

TEST(ImuSimulator, IntegratesBackToTheTrajectory) {
  const auto trajectory =
      BodyTrajectory::drive(PlanarMotion("icr_sweep"), Ground::uneven(0.05, 3.), -0.5, 21.);
  const Mounting mounting{rotation_from_euler(0.7, -0.4, 1.1), {0.3, -0.2, 0.5}};
  const auto samples = simulate_imu(trajectory, mounting, silent_imu(20., 1000.), 1).samples;
  const BodyMotion start = trajectory.imu(0., mounting);
  Matrix3d R_ItoG = start.R_BtoG;
  Vector3d p = start.p_BinG, v = start.v_BinG;
  for (std::size_t k = 1; k < samples.size(); ++k) {
    const double h = seconds_between(samples[k - 1].t_ns, samples[k].t_ns);
    const Matrix3d R_next = R_ItoG * exp_so3(0.5 * h * (gyro(samples[k - 1]) + gyro(samples[k])));
    const Vector3d a =
        0.5 * (R_ItoG * accel(samples[k - 1]) + R_next * accel(samples[k])) - Vector3d(0, 0, 9.81);
    p += h * v + 0.5 * h * h * a;
    v += h * a;
    R_ItoG = R_next;
  }
  const BodyMotion end = trajectory.imu(20., mounting);
  EXPECT_NEAR((p - end.p_BinG).norm(), 0., 2e-4);
  EXPECT_NEAR((v - end.v_BinG).norm(), 0., 2e-5);
  EXPECT_NEAR(log_so3(R_ItoG.transpose() * end.R_BtoG).norm(), 0., 1e-6);
}

struct Moments {
  double mean = 0.;
  double sigma = 0.;
};

Moments moments(const std::vector<double>& values) {
  Moments out;
  for (const double x : values) out.mean += x / static_cast<double>(values.size());
  for (const double x : values) {
    out.sigma += (x - out.mean) * (x - out.mean) / static_cast<double>(values.size());
  }
  out.sigma = std::sqrt(out.sigma);
  return out;
}

TEST(ImuSimulator, NoiseAndBiasWalkHaveTheDensitiesThatWereAskedFor) {
  ImuSimulation options;
  options.duration_s = 200.;
  options.densities = {1e-3, 2e-2, 3e-4, 4e-3};
  const SimulatedImu imu = simulate_imu(still(201.), {}, options, 7);
  std::vector<double> white_gyro, white_accel, walk_gyro, walk_accel;
  for (std::size_t k = 1; k < imu.samples.size(); ++k) {
    for (int i = 0; i < 3; ++i) {
      const double g = i == 2 ? 9.81 : 0.;
      white_gyro.push_back(gyro(imu.samples[k])[i] - imu.biases[k].gyro[i]);
      white_accel.push_back(accel(imu.samples[k])[i] - imu.biases[k].accel[i] - g);
      walk_gyro.push_back(imu.biases[k].gyro[i] - imu.biases[k - 1].gyro[i]);
      walk_accel.push_back(imu.biases[k].accel[i] - imu.biases[k - 1].accel[i]);
    }
  }
  const double root = std::sqrt(200.);
  const auto check = [](const std::vector<double>& values, double sigma) {
    const Moments found = moments(values);
    const double n = static_cast<double>(values.size());  // 120000
    EXPECT_NEAR(found.mean, 0., 4. * sigma / std::sqrt(n));
    EXPECT_NEAR(found.sigma, sigma, 4. * sigma / std::sqrt(2. * n));
  };
  check(white_gyro, 1e-3 * root);
  check(white_accel, 2e-2 * root);
  check(walk_gyro, 3e-4 / root);
  check(walk_accel, 4e-3 / root);
  EXPECT_EQ(imu.biases[0].gyro, Vector3d::Zero());
}

TEST(ImuSimulator, FirstBiasesAreGivenAndDrawn) {
  ImuSimulation options = silent_imu(0.1, 200.);
  options.gyro_bias = {0.1, 0.2, 0.3};
  options.accel_bias = {1., 2., 3.};
  options.sigma_gyro_bias_rad_per_s = 0.01;
  const SimulatedImu given = simulate_imu(still(1.), {}, options, 1);
  EXPECT_EQ(gyro(given.samples[3]), options.gyro_bias);
  EXPECT_NEAR((accel(given.samples[3]) - Vector3d(1., 2., 12.81)).norm(), 0., 1e-12);
  options.noise = true;
  const SimulatedImu a = simulate_imu(still(1.), {}, options, 1);
  const SimulatedImu b = simulate_imu(still(1.), {}, options, 2);
  EXPECT_NE(a.biases[0].gyro, b.biases[0].gyro);
  EXPECT_LT((a.biases[0].gyro - options.gyro_bias).norm(), 0.06);
  EXPECT_GT((a.biases[0].gyro - options.gyro_bias).norm(), 1e-4);
  EXPECT_EQ(a.biases[0].accel, options.accel_bias);
}

TEST(ImuSimulator, EachNoiseHasItsOwnStream) {
  ImuSimulation all;
  all.duration_s = 2.;
  const auto base = simulate_imu(still(3.), {}, all, 3);
  ImuSimulation no_gyro = all;
  no_gyro.densities.gyro_rad_per_s_sqrt_hz = 0.;
  no_gyro.densities.gyro_walk_rad_per_s2_sqrt_hz = 0.;
  const auto without = simulate_imu(still(3.), {}, no_gyro, 3);
  for (std::size_t k = 0; k < base.samples.size(); ++k) {
    EXPECT_EQ(base.samples[k].accel_m_per_s2, without.samples[k].accel_m_per_s2);
    EXPECT_NE(base.samples[k].gyro_rad_per_s, without.samples[k].gyro_rad_per_s);
  }
}

TEST(ImuSimulator, TrueStatesAreThePoseVelocityAndInterpolatedBiases) {
  const auto trajectory =
      BodyTrajectory::drive(PlanarMotion("circle"), Ground::uneven(0.05, 3.), -0.5, 4.);
  const Mounting mounting{rotation_from_euler(0.7, -0.4, 1.1), {0.3, -0.2, 0.5}};
  ImuSimulation options;
  options.duration_s = 3.;
  options.start_ns = 50;
  const SimulatedImu imu = simulate_imu(trajectory, mounting, options, 1);
  const StateSample state = true_state(trajectory, mounting, imu, 50, 50 + 2'001'250'000);
  const BodyMotion at = trajectory.imu(2.00125, mounting);
  const Eigen::Quaterniond q(state.q_ItoG_xyzw[3], state.q_ItoG_xyzw[0], state.q_ItoG_xyzw[1],
                             state.q_ItoG_xyzw[2]);
  EXPECT_NEAR((q.toRotationMatrix() - at.R_BtoG).norm(), 0., 1e-12);
  EXPECT_EQ(Vector3d(state.p_IinG_m.data()), at.p_BinG);
  EXPECT_EQ(Vector3d(state.v_IinG_m_per_s.data()), at.v_BinG);
  const Vector3d bias = 0.75 * imu.biases[400].gyro + 0.25 * imu.biases[401].gyro;
  EXPECT_NEAR((Vector3d(state.gyro_bias_rad_per_s.data()) - bias).norm(), 0., 1e-15);
  const StateSample first = true_state(trajectory, mounting, imu, 50, 50);
  EXPECT_EQ(Vector3d(first.accel_bias_m_per_s2.data()), imu.biases[0].accel);
}

}  // namespace
}  // namespace viwo::sim

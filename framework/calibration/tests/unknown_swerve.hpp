// A swerve robot of which nothing is known but where its wheels are, driven with a gyro.
#pragma once

#include <functional>
#include <random>

#include <gtest/gtest.h>

#include "motion_reference.hpp"
#include "simulated.hpp"
#include "viwo/calibration/calibrate.hpp"
#include "viwo/math/se2.hpp"

namespace viwo::testing {

using namespace calibration;

/// Sixty seconds of a figure eight, wheels and IMU. `robot`: what is true, `kinematics`: nominal.
inline CalibrationSetup gyro_setup(const std::string& robot, const std::string& kinematics,
                                   std::uint64_t seed, const std::string& motion = "figure_eight") {
  const std::string text =
      "sensors: {simulator0: {type: simulator, features: 0, duration_s: 60, motion: " + motion +
      ", sigma_gyro_bias_rad_per_s: 0.005, true_intrinsics_scale: 1, robot: {" + robot +
      "}}}\nkinematics: {" + kinematics + "}\nodometry: {twist: noise_weighted}\n";
  CalibrationSetup setup;
  setup.options.reference = ReferenceKind::kGyro;
  RunSetup run = read_run(config::parse(text, "run.yaml"), registry(), seed);
  RunData data = collect(run);
  const Recording label{motion, {}};
  MotionReference turn = motion_reference(label, run, data, ReferenceKind::kGyro);
  setup.recordings.push_back({label, std::move(run), std::move(data), std::move(turn)});
  return setup;
}

/// As if all wheels were larger than they are.
inline void change_wheels(CalibrationSetup& setup,
                          const std::function<void(EncoderSample&)>& change) {
  for (CalibrationRecording& recording : setup.recordings) {
    const auto wheels = recording.data.wheels();
    std::vector<EncoderSample> samples(wheels.begin(), wheels.end());
    for (EncoderSample& sample : samples) change(sample);
    recording.data.recorded.set(recording.data.wheels_name, samples);
  }
}

inline void scale_drives(CalibrationSetup& setup, double scale) {
  change_wheels(setup, [scale](EncoderSample& sample) {
    for (double& rate : sample.drive_rad_per_s) rate *= scale;
  });
}

/// The turns of a reference `factor` times as far.
inline void scale_turns(Trajectory& poses, double factor) {
  double before_rad = yaw(poses.front()), turned_rad = before_rad;
  for (StampedPose& pose : poses) {
    const double now_rad = yaw(pose);
    turned_rad += factor * wrap_angle(now_rad - before_rad);
    before_rad = now_rad;
    pose.q_BtoW = Eigen::AngleAxisd(turned_rad, Eigen::Vector3d::UnitZ());
  }
}

inline const std::string kPlaces =
    "type: four_wis_wid, x_m: [0.1125, -0.1125, -0.1125, 0.1125], "
    "y_m: [0.1125, 0.1125, -0.1125, -0.1125], prior_sigma_position_m: 0.001, ";

/// A robot whose zeros are anywhere, one drive of which turns backwards, and whose gear is off by
/// up to a tenth.
inline CalibrationSetup unknown_swerve(std::uint64_t seed,
                                       const std::string& motion = "figure_eight") {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double least, double most) {
    return least + (most - least) * std::ldexp(static_cast<double>(random() >> 11), -53);
  };
  std::array<double, 4> zero_rad{};
  for (double& zero : zero_rad) zero = uniform(-M_PI, M_PI);
  zero_rad[random() % 4] += M_PI;  // the same as a drive that turns backwards
  std::string zeros;
  for (const double zero : zero_rad) zeros += (zeros.empty() ? "" : ", ") + std::to_string(zero);
  const std::string radius = std::to_string(0.0255 * uniform(0.9, 1.1));
  return gyro_setup(kPlaces + "radius_m: " + radius + ", steer_offset_rad: [" + zeros +
                        "], prior_sigma_radius_m: 0.0001, prior_sigma_steer_offset_rad: 0.001",
                    kPlaces + "radius_m: 0.0255, prior_sigma_radius_m: 0.00255", seed, motion);
}

/// Errors of the zeros against that of the first wheel, which is held: rad.
inline Eigen::Vector3d zero_errors(const CalibrationSetup& setup, const Intrinsics& x) {
  const auto& truth = setup.recordings[0].data.calibration;
  const WheelModel& model = *setup.recordings[0].setup.model;
  Eigen::Vector4d error;
  for (int j = 0; j < 4; ++j) {
    const std::string name = "delta_o" + std::to_string(j + 1);
    error[j] = x[model.find(name)] - truth.at(name);
  }
  Eigen::Vector3d against_first;
  for (int j = 0; j < 3; ++j) against_first[j] = wrap_angle(error[j + 1] - error[0]);
  return against_first;
}

/// What the zeros are found by, in sigmas: the largest, and the sum of squares.
struct Found {
  double most_sigmas = 0., most_rad = 0., squares = 0.;
  int count = 0;
};

inline Found calibrate_unknown(std::uint64_t seeds) {
  Found found;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    CalibrationSetup setup = unknown_swerve(seed);
    setup.options.find_steering_zeros = true;
    const CalibrationResult result = calibrate(setup);
    EXPECT_TRUE(result.is_trusted()) << seed << ": " << ::testing::PrintToString(result.doubts);
    const Eigen::Vector3d errors = zero_errors(setup, result.all.x_WI);
    for (int j = 0; j < 3; ++j) {
      const auto name = "delta_o" + std::to_string(j + 2);
      const double sigma = result.all.sigma[setup.recordings[0].setup.model->find(name)];
      EXPECT_LT(std::abs(errors[j]), 0.005) << name << " seed " << seed;
      found.most_rad = std::max(found.most_rad, std::abs(errors[j]));
      found.most_sigmas = std::max(found.most_sigmas, std::abs(errors[j]) / sigma);
      found.squares += errors[j] * errors[j] / (sigma * sigma);
      ++found.count;
    }
  }
  return found;
}

}  // namespace viwo::testing

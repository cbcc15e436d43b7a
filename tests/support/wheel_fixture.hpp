// Kinematic models from the plugins of this build, and encoder samples that fit a given twist.
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "registry.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/wheel/wheel_model.hpp"

namespace viwo::testing {

/// The model of a section such as "{type: four_wis_wid, ...}".
inline std::shared_ptr<const WheelModel> load_model(const std::string& yaml) {
  config::Errors errors;
  const auto loaded =
      registry().make_kinematics(config::parse(yaml, "test"), "kinematics", 1, errors);
  errors.throw_if_any();
  return std::make_shared<const WheelModel>(loaded.object);
}

/// The robot of the paper, with nothing symmetric: unequal radii, offsets, shifted wheels.
inline std::string swerve(const std::string& type, const std::string& more = "") {
  return "{type: " + type +
         ", radius_m: [0.0254, 0.0256, 0.0255, 0.0252], x_m: [0.1125, -0.111, -0.1135, 0.113], "
         "y_m: [0.1115, 0.1125, -0.1131, -0.112], steer_offset_rad: [0.01, -0.02, 0.015, 0.005]" +
         more + "}";
}

inline std::string differential(const std::string& more = "") {
  return "{type: differential, radius_left_m: 0.05, radius_right_m: 0.0505, baseline_m: 0.3" +
         more + "}";
}

/// Encoder sample of a slip-free robot with twist xi; `sample` holds the one before.
inline void follow(const WheelModel& model, const Twist& xi, EncoderSample& sample) {
  const RowVector no_slip = RowVector::Zero(model.n_rows());
  if (model.model().inverse(xi, model.nominal(), no_slip, sample) != Status::kOk) {
    throw std::runtime_error("the model cannot follow this twist");
  }
}

/// Samples of `twist(t)` at `rate_hz`, cells of one period around each stamp.
inline std::vector<EncoderSample> sample_motion(const WheelModel& model,
                                                const std::function<Twist(double)>& twist,
                                                double duration_s, double rate_hz) {
  const auto period_ns = static_cast<std::int64_t>(std::llround(1e9 / rate_hz));
  const auto count = static_cast<std::int64_t>(std::llround(duration_s * rate_hz));
  std::vector<EncoderSample> samples;
  EncoderSample sample;
  for (std::int64_t i = 0; i < count; ++i) {
    sample.begin_ns = i * period_ns;
    sample.end_ns = (i + 1) * period_ns;
    sample.t_ns = sample.begin_ns + period_ns / 2;
    follow(model, twist(1e-9 * static_cast<double>(sample.t_ns)), sample);
    samples.push_back(sample);
  }
  return samples;
}

/// White noise of the model's own sigmas: slip as the wheels show it, then noise on the channels.
/// Slip is across the heading that the wheel takes because of it, hence the repetitions. Returns
/// the slip of each row (b - A xi) in `slip_out`.
inline EncoderSample with_noise(const WheelModel& model, const Twist& xi,
                                const EncoderSample& clean, double scale, std::mt19937_64& rng,
                                RowVector* slip_out = nullptr) {
  std::normal_distribution<double> gauss;
  const auto& noises = model.description().noises;
  std::vector<double> slip_speed;
  for (const NoiseSpec& noise : noises) {
    slip_speed.push_back(noise.kind == NoiseKind::kSlip ? scale * noise.sigma * gauss(rng) : 0.);
  }
  RowSystem rows;
  rows.A.setZero(model.n_rows(), 3);
  rows.b.setZero(model.n_rows());
  NoiseDerivatives by_n;
  by_n.J.setZero(model.n_rows(), model.n_noises());
  by_n.DtE.setZero(3, model.n_noises());
  const RowVector none = RowVector::Zero(model.n_rows());
  EncoderSample noisy = clean;
  RowVector slip = none;
  for (int repetition = 0; repetition < 4; ++repetition) {
    model.model().rows(noisy, model.nominal(), false, rows);
    model.model().noise_derivatives(noisy, model.nominal(), rows, rows.b, xi, none, by_n);
    slip = none;
    for (std::size_t k = 0; k < noises.size(); ++k) {
      if (slip_speed[k] != 0.) slip += slip_speed[k] * by_n.J.col(static_cast<int>(k));
    }
    noisy = clean;
    model.model().inverse(xi, model.nominal(), slip, noisy);
  }
  if (slip_out != nullptr) *slip_out = slip;
  for (const NoiseSpec& noise : noises) {
    const auto channel = static_cast<std::size_t>(noise.channel);
    const double n = scale * noise.sigma;
    if (noise.kind == NoiseKind::kDrive) noisy.drive_rad_per_s[channel] += n * gauss(rng);
    if (noise.kind == NoiseKind::kSteer) noisy.steer_rad[channel] += n * gauss(rng);
  }
  return noisy;
}

}  // namespace viwo::testing

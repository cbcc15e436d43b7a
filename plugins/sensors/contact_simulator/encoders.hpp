// What the encoders of a base read: counts, play between drive encoder and wheel, noise (model.md).
#pragma once

#include <array>
#include <cmath>

#include "contact_solver.hpp"
#include "viwo/sim/random.hpp"

namespace viwo::contact {

struct EncoderErrors {
  double drive_resolution_rad = 0.;
  double steer_resolution_rad = 0.;
  double drive_play_rad = 0.;  ///< full width
  double sigma_drive_rad_per_s = 0.;
  double sigma_steer_rad = 0.;
};

/// Reads step by step.
class Encoders {
 public:
  Encoders(const EncoderErrors& errors, std::uint64_t seed)
      : errors_(errors),
        drive_noise_(seed, sim::Stream::kDriveNoise),
        steer_noise_(seed, sim::Stream::kSteerNoise) {}

  /// The reading of a cell of `dt_s` around this state; its stamps are the caller's.
  EncoderSample read(const Base& base, const ContactState& state, double dt_s) {
    EncoderSample y;
    y.n_drive = base.n_drive;
    y.n_steer = static_cast<int>(base.steerings.size());
    for (std::size_t j = 0; j < static_cast<std::size_t>(y.n_drive); ++j) {
      const double noise = errors_.sigma_drive_rad_per_s * drive_noise_.gaussian();
      y.drive_rad_per_s[j] = count(j, state.wheels[j], dt_s) + noise;
    }
    for (std::size_t k = 0; k < static_cast<std::size_t>(y.n_steer); ++k) {
      const double noise = errors_.sigma_steer_rad * steer_noise_.gaussian();
      y.steer_rad[k] = rounded(state.steer_rad[k] + noise, errors_.steer_resolution_rad);
    }
    return y;
  }

 private:
  struct Counter {
    double wheel_rad = 0.;  ///< how far the wheel has turned
    double play_rad = 0.;   ///< how far the encoder is ahead of it
    double last_rad = 0.;   ///< counted until now
  };

  static double rounded(double value, double step) {
    return step > 0. ? step * std::round(value / step) : value;
  }

  /// Mean rate of what is counted within the cell; nothing is lost from one cell to the next.
  double count(std::size_t wheel, const WheelState& state, double dt_s) {
    if (errors_.drive_resolution_rad <= 0. && errors_.drive_play_rad <= 0.) {
      return state.rate_rad_per_s;
    }
    Counter& counter = counters_[wheel];
    counter.wheel_rad += dt_s * state.rate_rad_per_s;
    // The side on which teeth touch is that of the torque.
    const double pull_n = state.force_n.dot(direction(state.angle_rad));
    if (std::abs(pull_n) > kTouchingN) {
      counter.play_rad = std::copysign(0.5 * errors_.drive_play_rad, pull_n);  // (CP-12)
    }
    const double now_rad =
        rounded(counter.wheel_rad + counter.play_rad, errors_.drive_resolution_rad);
    const double rate = (now_rad - counter.last_rad) / dt_s;
    counter.last_rad = now_rad;
    return rate;
  }

  /// A pull of less leaves the teeth where they are, N.
  static constexpr double kTouchingN = 0.2;

  EncoderErrors errors_;
  sim::RandomStream drive_noise_, steer_noise_;
  std::array<Counter, kMaxDrives> counters_;
};

}  // namespace viwo::contact

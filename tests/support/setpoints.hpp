// What a program would have commanded where encoders read something.
#pragma once

#include <array>
#include <cmath>

#include "viwo/api/measurement.hpp"

namespace viwo::testing {

/// Four steered wheels on the corners of a square, `half_m` from its middle in x and in y, the
/// first at the front left, then counterclockwise: their sample becomes that of a twist without
/// noise.
inline void make_setpoints(EncoderSample& sample, double half_m, double radius_m) {
  const std::array<double, 4> x_m{half_m, -half_m, -half_m, half_m};
  const std::array<double, 4> y_m{half_m, half_m, -half_m, -half_m};
  double vx = 0., vy = 0., moments = 0.;
  for (std::size_t i = 0; i < 4; ++i) {
    const double speed = radius_m * sample.drive_rad_per_s[i];
    const double along_x = speed * std::cos(sample.steer_rad[i]);
    const double along_y = speed * std::sin(sample.steer_rad[i]);
    vx += along_x / 4.;
    vy += along_y / 4.;
    moments += x_m[i] * along_y - y_m[i] * along_x;
  }
  const double w = moments / (8. * half_m * half_m);
  for (std::size_t i = 0; i < 4; ++i) {
    const double along_x = vx - w * y_m[i], along_y = vy + w * x_m[i];
    sample.drive_rad_per_s[i] = std::hypot(along_x, along_y) / radius_m;
    sample.steer_rad[i] = std::atan2(along_y, along_x);
  }
}

}  // namespace viwo::testing

// Readings of encoders, for the tests of joints.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "viwo/log/joints.hpp"

namespace viwo::log {

using Numbers = std::vector<double>;

inline EncoderReading reading_of(double t_s, const Numbers& drive, const Numbers& steer = {}) {
  EncoderReading out;
  out.t_ns = std::llround(1e9 * t_s);
  out.n_drive = static_cast<int>(drive.size());
  out.n_steer = static_cast<int>(steer.size());
  std::copy(drive.begin(), drive.end(), out.drive.begin());
  std::copy(steer.begin(), steer.end(), out.steer_rad.begin());
  return out;
}

inline EncoderReading converted(JointMap& map, EncoderReading reading) {
  EXPECT_STREQ(map.convert(reading), nullptr);
  return reading;
}

}  // namespace viwo::log

// Counters as they are: coarse, and read twice.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "inspected.hpp"

namespace viwo::inspect {
namespace {

/// Of 90 counts a turn: one sample before a rest is a count or none, and no speed.
TEST(InspectCounters, ACoarseOneThatRestsHasLostNothing) {
  std::array<double, kMaxDrives> angle{};
  std::array<std::int64_t, kMaxDrives> count{};
  const Inspection found = with_wheels(swerve(), [&](EncoderSample& s) {
    constexpr double kCount_rad = 2. * std::numbers::pi / 90.;
    const double t_s = 1e-9 * static_cast<double>(s.t_ns);
    const double slow = std::clamp(std::abs(t_s - 15.) - 3., 0., 1.);  // a rest of six seconds
    const double dt_s = seconds_between(s.begin_ns, s.end_ns);
    for (std::size_t i = 0; i < 4; ++i) {
      angle[i] += slow * s.drive_rad_per_s[i] * dt_s;
      const auto now = std::llround(std::floor(angle[i] / kCount_rad));
      s.drive_rad_per_s[i] = kCount_rad * static_cast<double>(now - count[i]) / dt_s;
      count[i] = now;
    }
  });
  EXPECT_EQ(finding_of(found, "wheels0", "zeros").what, "");
}

/// A driver may publish one motor as two joints, front and rear.
TEST(InspectCounters, TwoThatAreOneContradictEachOtherByNothing) {
  const Inspection found = with_wheels(four_drives(), [](EncoderSample& s) {
    s.drive_rad_per_s[2] = s.drive_rad_per_s[0];
    s.drive_rad_per_s[3] = s.drive_rad_per_s[1];
  });
  EXPECT_EQ(finding_of(found, "wheels0", "intrinsics").what, "");
}

}  // namespace
}  // namespace viwo::inspect

// Wheels that turn as a gyro does, but for a while.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace viwo {

inline constexpr double kTurnWindow_s = 0.5;

/// Mean rates of a window, rad/s.
struct TurnWindow {
  std::int64_t begin_ns = 0;
  double gyro = 0., wheels = 0.;
  double speed_m_per_s = 0.;  ///< of the wheels

  void operator+=(const TurnWindow& other) {
    gyro += other.gyro, wheels += other.wheels, speed_m_per_s += other.speed_m_per_s;
  }
  void operator/=(double n) { gyro /= n, wheels /= n, speed_m_per_s /= n; }
};

/// A wheel that slipped, was blocked or lifted, or whose encoder stood still.
struct Slip {
  std::int64_t from_ns = 0;
  double length_s = 0.;
  double turn_rad = 0.;  ///< of the gyro more than of the wheels

  /// A base that skids does so by some degrees where the ground changes.
  bool is_fault() const;
  /// "turns otherwise than imu0 for 3 s from t = 25 s on, by 0.7 rad in all, ...". `more`: what is
  /// to be said of the wheels meanwhile.
  std::string text(const std::string& gyro, std::int64_t zero_ns, const std::string& more) const;
};

/// Windows follow each other, but for holes. A factor up to 1.5 and a bias are no slip, nor is what
/// lasts for more than a third of the time, or of fewer than 40 windows.
std::optional<Slip> find_slip(std::span<const TurnWindow> windows);

/// Rates that have little in common.
struct Disagreement {
  double part = 0.;              ///< of the windows in which the base moves
  double median_rad_per_s = 0.;  ///< of what they differ by in those
};

/// What is no slip, as it lasts for more than a third of the time, and no lag. `tolerance`: by what
/// part the wheels may turn otherwise for all that is known of them.
std::optional<Disagreement> find_disagreement(std::span<const TurnWindow> windows,
                                              double tolerance);

/// The median of what the rates differ by, rad/s, factor and bias apart.
double usual_difference(std::span<const TurnWindow> windows);

}  // namespace viwo

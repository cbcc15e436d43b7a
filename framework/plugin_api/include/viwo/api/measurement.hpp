// Measurements: what sensors yield. Plain data of fixed size; times are integer nanoseconds so that
// a log plays back to the same bits.
#pragma once

#include <array>
#include <cstdint>
#include <variant>

namespace viwo {

/// Most drive (steering) channels of one encoder sample.
inline constexpr int kMaxDrives = 8;
inline constexpr int kMaxSteers = 8;

/// Seconds between two stamps.
inline double seconds_between(std::int64_t from_ns, std::int64_t to_ns) {
  return static_cast<double>(to_ns - from_ns) * 1e-9;
}

/// One reading of all wheel encoders of a base.
///
/// The sample stands for the time [begin_ns, end_ns]: the reading is the value at `t_ns`, the
/// middle of what was observed, and in the absence of other samples it holds over the whole cell.
/// Cells of one sensor are in time order and do not overlap; a hole between two cells is a gap in
/// the data. Sensors that sample rates at an instant use cells between the mid-points of their
/// stamps; sensors that count angles use the cell between two stamps and the mean rate over it,
/// which is exact.
struct EncoderSample {
  std::int64_t t_ns = 0;                             ///< stamp in the wheel clock
  std::int64_t begin_ns = 0;                         ///< start of the cell, <= t_ns
  std::int64_t end_ns = 0;                           ///< end of the cell, >= t_ns
  int n_drive = 0;                                   ///< channels used in drive_rad_per_s
  int n_steer = 0;                                   ///< channels used in steer_rad
  std::array<double, kMaxDrives> drive_rad_per_s{};  ///< wheel rotation rates, forward positive
  std::array<double, kMaxSteers> steer_rad{};  ///< steering angles, counter-clockwise positive
};

/// A pose from a reference system (motion capture, simulator truth): body B in world W.
struct PoseSample {
  std::int64_t t_ns = 0;                              ///< stamp in the clock of the reference
  std::array<double, 3> p_BinW_m{};                   ///< position of B's origin in W
  std::array<double, 4> q_BtoW_xyzw{0., 0., 0., 1.};  ///< Hamilton quaternion, unit norm
};

/// One timestamped datum of any sensor.
using Measurement = std::variant<EncoderSample, PoseSample>;

inline std::int64_t stamp_ns(const Measurement& measurement) {
  return std::visit([](const auto& sample) { return sample.t_ns; }, measurement);
}

}  // namespace viwo

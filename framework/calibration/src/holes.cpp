#include "holes.hpp"

#include <algorithm>
#include <cstddef>
#include <span>

#include "recording_name.hpp"
#include "viwo/math/heading_jumps.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/wheel/drive_ranges.hpp"

namespace viwo::calibration {
namespace {

/// Where samples are missing, more than now and then one, and the wheels turn before or after.
std::vector<Hole> holes_of(std::span<const EncoderSample> wheels) {
  constexpr double kLeast_s = 0.2, kLeastCells = 2., kTurns_rad_per_s = 0.1;
  std::vector<Hole> holes;
  for (std::size_t i = 1; i < wheels.size(); ++i) {
    const EncoderSample &before = wheels[i - 1], &after = wheels[i];
    const Hole hole{before.end_ns, after.begin_ns};
    const double cell_s = seconds_between(before.begin_ns, before.end_ns);
    if (hole.length_s() <= std::max(kLeast_s, kLeastCells * cell_s)) continue;
    if (std::max(fastest_of(before), fastest_of(after)) > kTurns_rad_per_s) holes.push_back(hole);
  }
  return holes;
}

}  // namespace

std::vector<Hole> holes_of(const CalibrationRecording& recording) {
  const auto wheels = recording.data.wheels();
  const MotionReference& motion = recording.motion;
  std::vector<Hole> holes = holes_of(wheels);
  if (!holes.empty() && (motion.distance_m || motion.turn_rad)) {
    const double at_s = seconds_between(wheels.front().begin_ns, holes.front().begin_ns);
    fail(recording.label,
         ": distance_m and turn_deg are of a whole drive, and the wheels turned unseen for " +
             significant(holes.front().length_s(), 2) + " s, " + significant(at_s, 4) +
             " s after the begin");
  }
  if (motion.kind != ReferenceKind::kGyro) return holes;
  const std::int64_t offset_ns = to_ns(motion.offset_s);
  if (recording.data.imu().empty()) {  // it integrates for itself, but for where it is set
    const auto headings = recording.data.headings();
    for (const std::size_t i : heading_jumps(headings)) {
      holes.push_back({headings[i - 1].t_ns - offset_ns, headings[i].t_ns - offset_ns});
    }
    return holes;
  }
  for (std::size_t i = 1; i < motion.poses.size(); ++i) {
    const Hole hole{motion.poses[i - 1].t_ns - offset_ns, motion.poses[i].t_ns - offset_ns};
    if (hole.length_s() > motion.max_gap_s) holes.push_back(hole);
  }
  return holes;
}

}  // namespace viwo::calibration

#include "viwo/run/calibration_track.hpp"

#include <algorithm>

namespace viwo {

bool is_estimated(const RunResult& run, const CalibrationTrack& track) {
  return !run.updates.empty() && !track.sigma.empty() && track.sigma.front() > 0. &&
         track.sigma.back() > 0.;
}

void widen(CalibrationFile& file, const std::vector<CalibrationTrack>& tracks) {
  for (auto* entries : {&file.intrinsics, &file.mount, &file.clock, &file.cameras}) {
    for (CalibrationEntry& entry : *entries) {
      const auto track = std::ranges::find(tracks, entry.name, &CalibrationTrack::name);
      if (track != tracks.end()) entry.sigma *= track->scatter;
    }
  }
}

}  // namespace viwo

// Encoder samples from readings as they come: a cell ends where its newest reading is, so that no
// sample has to wait for the reading after it.
#pragma once

#include <optional>

#include "viwo/log/cells.hpp"

namespace viwo::ros1 {

class LiveCells {
 public:
  /// `drive_is_angle`: readings hold multi-turn angles [rad] instead of rates [rad/s].
  LiveCells(bool drive_is_angle, double max_gap_s)
      : drive_is_angle_(drive_is_angle), max_gap_s_(max_gap_s) {}

  /// The cell between the reading before and this one, whose stamp must be later. Nothing for the
  /// first one, and for the first one behind a gap.
  std::optional<EncoderSample> add(const log::EncoderReading& reading);

 private:
  bool drive_is_angle_;
  double max_gap_s_;
  std::optional<log::EncoderReading> last_;
};

}  // namespace viwo::ros1

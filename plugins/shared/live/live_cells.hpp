// Encoder samples from readings as they come: a cell ends where its newest reading is, so that no
// sample has to wait for the reading after it.
#pragma once

#include <cstdint>
#include <optional>

#include "viwo/log/cells.hpp"

namespace viwo::live {

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

/// The cells that log::samples_from() makes of the same readings, as soon as they can be told: of
/// rates when the reading after them is there. Where it differs is a gap between rates, into which
/// the cells at its sides reach by half of the spacing before it, not of the median of a whole log.
class LogCells {
 public:
  LogCells(bool drive_is_angle, double max_gap_s)
      : drive_is_angle_(drive_is_angle), max_gap_s_(max_gap_s) {}

  /// A cell that is known by this reading, whose stamp must be later than that before.
  std::optional<EncoderSample> add(const log::EncoderReading& reading);
  /// The last one.
  std::optional<EncoderSample> finish();

 private:
  bool drive_is_angle_;
  double max_gap_s_;
  std::optional<log::EncoderReading> last_;  ///< of angles
  std::optional<EncoderSample> open_;        ///< of rates: the cell whose end is not known
  std::int64_t spacing_ns_ = 0;
};

}  // namespace viwo::live

#include "live_cells.hpp"

#include <array>
#include <cstddef>
#include <utility>

namespace viwo::ros1 {

std::optional<EncoderSample> LiveCells::add(const log::EncoderReading& reading) {
  const auto before = std::exchange(last_, reading);
  if (!before) return std::nullopt;
  const std::array pair{*before, reading};
  const auto cells = log::cells_from_angles(pair, max_gap_s_);
  if (cells.empty()) return std::nullopt;
  EncoderSample cell = cells.front();  // (LIV-1), (LIV-3)
  if (!drive_is_angle_) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(cell.n_drive); ++i) {
      cell.drive_rad_per_s[i] = 0.5 * (before->drive[i] + reading.drive[i]);  // (LIV-2)
    }
  }
  return cell;
}

}  // namespace viwo::ros1

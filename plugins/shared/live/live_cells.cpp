#include "live_cells.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

namespace viwo::live {

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

std::optional<EncoderSample> LogCells::add(const log::EncoderReading& reading) {
  if (drive_is_angle_) {
    const auto before = std::exchange(last_, reading);
    if (!before) return std::nullopt;
    const auto cells = log::cells_from_angles(std::array{*before, reading}, max_gap_s_);
    return cells.empty() ? std::nullopt : std::optional(cells.front());
  }
  // Of one reading: it begins and ends at its stamp.
  EncoderSample next = log::samples_from(std::array{reading}, false, max_gap_s_, 1).front();
  auto known = std::exchange(open_, std::nullopt);
  if (known) {
    const std::int64_t spacing_ns = next.t_ns - known->t_ns;
    const std::int64_t middle_ns = known->t_ns + spacing_ns / 2;
    known->end_ns = next.begin_ns = middle_ns;
    if (seconds_between(known->t_ns, next.t_ns) > max_gap_s_ && spacing_ns_ > 0) {
      known->end_ns = std::min(middle_ns, known->t_ns + spacing_ns_ / 2);
      next.begin_ns = std::max(middle_ns, next.t_ns - spacing_ns_ / 2);
    } else {
      spacing_ns_ = spacing_ns;
    }
  }
  open_ = next;
  return known;
}

std::optional<EncoderSample> LogCells::finish() { return std::exchange(open_, std::nullopt); }

}  // namespace viwo::live

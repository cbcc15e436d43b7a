#include "viwo/log/cells.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "viwo/math/median.hpp"
#include "viwo/math/significant.hpp"

namespace viwo::log {
namespace {

std::int64_t median_spacing_ns(const std::vector<EncoderSample>& samples) {
  std::vector<std::int64_t> spacings;
  spacings.reserve(samples.size() - 1);
  for (std::size_t i = 1; i < samples.size(); ++i) {
    spacings.push_back(samples[i].t_ns - samples[i - 1].t_ns);
  }
  return upper_median(spacings);
}

EncoderSample cell_between(const EncoderReading& a, const EncoderReading& b) {
  EncoderSample cell;
  cell.begin_ns = a.t_ns;
  cell.end_ns = b.t_ns;
  cell.t_ns = a.t_ns + (b.t_ns - a.t_ns) / 2;
  cell.n_drive = a.n_drive;
  cell.n_steer = a.n_steer;
  const double dt = seconds_between(a.t_ns, b.t_ns);
  for (std::size_t i = 0; i < static_cast<std::size_t>(a.n_drive); ++i) {
    cell.drive_rad_per_s[i] = (b.drive[i] - a.drive[i]) / dt;
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(a.n_steer); ++i) {
    cell.steer_rad[i] =
        a.steer_rad[i] + 0.5 * std::remainder(b.steer_rad[i] - a.steer_rad[i], 2. * M_PI);
  }
  return cell;
}

}  // namespace

void make_cells(std::vector<EncoderSample>& rates, double max_gap_s) {
  if (rates.empty()) return;
  rates.front().begin_ns = rates.front().t_ns;
  rates.back().end_ns = rates.back().t_ns;
  if (rates.size() == 1) return;
  const std::int64_t reach_ns = median_spacing_ns(rates) / 2;
  for (std::size_t i = 1; i < rates.size(); ++i) {
    EncoderSample& left = rates[i - 1];
    EncoderSample& right = rates[i];
    const std::int64_t middle_ns = left.t_ns + (right.t_ns - left.t_ns) / 2;
    left.end_ns = middle_ns;
    right.begin_ns = middle_ns;
    if (seconds_between(left.t_ns, right.t_ns) > max_gap_s) {
      left.end_ns = std::min(middle_ns, left.t_ns + reach_ns);
      right.begin_ns = std::max(middle_ns, right.t_ns - reach_ns);
    }
  }
}

std::vector<EncoderSample> cells_from_angles(std::span<const EncoderReading> angles,
                                             double max_gap_s, int stride) {
  if (stride < 1) throw std::invalid_argument("stride must be at least 1");
  std::vector<EncoderSample> cells;
  cells.reserve(angles.size() / static_cast<std::size_t>(stride));
  std::size_t begin = 0;
  for (std::size_t i = 1; i < angles.size(); ++i) {
    if (angles[i].is_start || seconds_between(angles[i - 1].t_ns, angles[i].t_ns) > max_gap_s) {
      begin = i;
    } else if (i - begin == static_cast<std::size_t>(stride)) {
      cells.push_back(cell_between(angles[begin], angles[i]));
      begin = i;
    }
  }
  return cells;
}

std::vector<EncoderSample> samples_from(std::span<const EncoderReading> readings,
                                        bool drive_is_angle, double max_gap_s, int stride) {
  if (drive_is_angle) return cells_from_angles(readings, max_gap_s, stride);
  std::vector<EncoderSample> samples;
  samples.reserve(readings.size());
  for (const EncoderReading& reading : readings) {
    EncoderSample& sample = samples.emplace_back();
    sample.t_ns = reading.t_ns;
    sample.n_drive = reading.n_drive;
    sample.n_steer = reading.n_steer;
    sample.drive_rad_per_s = reading.drive;
    sample.steer_rad = reading.steer_rad;
  }
  make_cells(samples, max_gap_s);
  return samples;
}

std::string spacing_text(std::span<const EncoderReading> readings, double max_gap_s) {
  if (readings.size() < 2) return "";
  const double spacing_s = seconds_between(readings.front().t_ns, readings.back().t_ns) /
                           static_cast<double>(readings.size() - 1);
  if (spacing_s < max_gap_s) return "";
  return ": they are " + significant(spacing_s, 3) + " s apart, and max_gap_s is " +
         significant(max_gap_s, 3);
}

}  // namespace viwo::log

#include "viwo/log/cells.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "viwo/math/median.hpp"
#include "viwo/math/significant.hpp"

namespace viwo::log {
namespace {

/// Of at least two.
template <class Stamped>
std::int64_t median_spacing_ns(std::span<const Stamped> all) {
  std::vector<std::int64_t> spacings;
  spacings.reserve(all.size() - 1);
  for (std::size_t i = 1; i < all.size(); ++i) spacings.push_back(all[i].t_ns - all[i - 1].t_ns);
  return upper_median(spacings);
}

double most_drive(const EncoderReading& reading) {
  double most = 0.;
  for (std::size_t i = 0; i < static_cast<std::size_t>(reading.n_drive); ++i) {
    most = std::max(most, std::abs(reading.drive[i]));
  }
  return most;
}

/// Whether the wheels stood between two readings, of which what is between was not written.
bool is_rest(const EncoderReading& a, const EncoderReading& b, bool drive_is_angle) {
  constexpr double kStill_rad = 0.5, kSetsOff_rad_per_s = 2.;
  if (!drive_is_angle) return most_drive(a) == 0. && most_drive(b) < kSetsOff_rad_per_s;
  if (b.is_start) return false;
  EncoderReading turned = b;
  for (std::size_t i = 0; i < static_cast<std::size_t>(a.n_drive); ++i) {
    turned.drive[i] -= a.drive[i];
  }
  return most_drive(turned) < kStill_rad;
}

/// Readings between the two, at about `spacing_ns`, that say what stands.
void hold(const EncoderReading& a, const EncoderReading& b, bool drive_is_angle,
          std::int64_t spacing_ns, std::vector<EncoderReading>& out) {
  constexpr std::int64_t kMost = 20'000;
  const std::int64_t gap_ns = b.t_ns - a.t_ns;
  const std::int64_t n = std::clamp<std::int64_t>(gap_ns / spacing_ns, 1, kMost);
  for (std::int64_t k = 1; k < n; ++k) {
    EncoderReading between = a;
    const double part = static_cast<double>(k) / static_cast<double>(n);
    between.t_ns = a.t_ns + std::llround(part * static_cast<double>(gap_ns));
    between.is_start = false;
    for (std::size_t i = 0; drive_is_angle && i < static_cast<std::size_t>(a.n_drive); ++i) {
      between.drive[i] += part * (b.drive[i] - a.drive[i]);
    }
    out.push_back(between);
  }
}

std::vector<EncoderReading> with_rests(std::span<const EncoderReading> written, bool drive_is_angle,
                                       double max_gap_s) {
  if (written.size() < 2) return {written.begin(), written.end()};
  const std::int64_t spacing_ns = median_spacing_ns(written);
  std::vector<EncoderReading> out;
  out.reserve(written.size());
  out.push_back(written.front());
  // A short table is not to need any memory. A rest beyond is a gap.
  constexpr std::size_t kMostOfAny = 200'000, kForEach = 20;
  const std::size_t most = kMostOfAny + kForEach * written.size();
  for (std::size_t i = 1; i < written.size(); ++i) {
    const EncoderReading &a = written[i - 1], &b = written[i];
    if (seconds_between(a.t_ns, b.t_ns) > max_gap_s && is_rest(a, b, drive_is_angle) &&
        out.size() < most) {
      hold(a, b, drive_is_angle, spacing_ns, out);
    }
    out.push_back(b);
  }
  return out;
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
  const std::int64_t reach_ns = median_spacing_ns(std::span<const EncoderSample>(rates)) / 2;
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

std::vector<EncoderSample> samples_from(std::span<const EncoderReading> written,
                                        bool drive_is_angle, double max_gap_s, int stride) {
  const std::vector<EncoderReading> readings = with_rests(written, drive_is_angle, max_gap_s);
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

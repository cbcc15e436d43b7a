#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "checks.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/plausibility/channel_change.hpp"
#include "viwo/series/rate_grid.hpp"

namespace viwo::inspect {

using series::RateGrid;
using series::Recording;
using series::Span;
using series::turns_of;
using series::Wheels;
using series::YawRates;

namespace {

/// Part of the variance of the gyro's rate that the wheels leave.
struct Left {
  double part = 1.;
  double gyro = 0.;  ///< variance, (rad/s)^2
};

Left left_by(const RateGrid& gyro, const RateGrid& wheels) {
  double n = 0., a = 0., aa = 0., d = 0., dd = 0.;
  for (std::size_t i = 0; i < std::min(gyro.size(), wheels.size()); ++i) {
    if (!gyro.has(i) || !wheels.has(i)) continue;
    const double rate = gyro[i].z(), off = rate - wheels[i].z();
    n += 1., a += rate, aa += rate * rate, d += off, dd += off * off;
  }
  if (n < 2.) return {};
  const double variance = aa / n - a * a / (n * n);
  return {variance > 0. ? (dd / n - d * d / (n * n)) / variance : 1., variance};
}

/// What wheels cannot say among themselves: with more than three rows, whole sides alone.
std::vector<ChannelChange> changes_by_gyro(const Wheels& wheels) {
  std::vector<ChannelChange> changes = {{}};
  if (wheels.model->n_rows() <= 3) changes = channel_changes(wheels.model->description());
  const auto sides = side_changes(wheels.model, wheels.prior.wheels.x_WI);
  changes.insert(changes.end(), sides.begin(), sides.end());
  return changes;
}

/// Each change undone, by what is left of the gyro's rate: as the parity residual says it of wheels
/// that can contradict each other.
bool check_order(const Recording& recording, const Wheels& wheels, const RateGrid& gyro,
                 const std::string& label, Findings& out) {
  const Span span = span_of(recording);
  struct Tried {
    ChannelChange change;
    Left left;
  };
  std::vector<Tried> all;
  for (const ChannelChange& change : changes_by_gyro(wheels)) {
    Wheels changed = wheels;
    for (EncoderSample& sample : changed.samples) change.undo(sample);
    all.push_back({change, left_by(gyro, RateGrid(span.begin_ns, span.end_ns, turns_of(changed)))});
  }
  const auto best = std::min_element(all.begin(), all.end(), [](const Tried& a, const Tried& b) {
    return a.left.part < b.left.part;
  });
  const Left none = all.front().left, least = best->left;
  constexpr double kLeastRate = 0.05;
  if (best == all.begin() || none.gyro < kLeastRate * kLeastRate) return false;
  const bool is_clear = std::all_of(all.begin(), all.end(), [&](const Tried& other) {
    return &other == &*best || other.left.part > 3. * least.part;
  });
  if (!is_clear || least.part > 0.1 * none.part || least.part > 0.1) return false;
  // What turns the rate round may be the gyro's sign as well: that is told with all its causes.
  const auto opposite = about(turns_of(wheels), -Eigen::Vector3d::UnitZ());
  if (left_by(gyro, RateGrid(span.begin_ns, span.end_ns, opposite)).part < 3. * least.part) {
    return false;
  }
  const ModelDescription& description = wheels.model->description();
  out.push_back({label,
                 Severity::kFault,
                 "order",
                 best->change.text() + " (of the variance of the gyro's rate they leave " +
                     significant(100. * none.part, 3) + " %, and " +
                     significant(100. * least.part, 2) + " % without that)",
                 {{"left as it is", none.part, ""}, {"left without it", least.part, ""}},
                 best->change.remedies(wheels.sensor, static_cast<std::size_t>(description.n_drive),
                                       static_cast<std::size_t>(description.n_steer))});
  return true;
}

}  // namespace

void check_yaw_order(const Recording& recording, Findings& out) {
  const Span span = span_of(recording);
  for (const Wheels& wheels : recording.wheels) {
    if (wheels.samples.empty() || !wheels.unusable.empty()) continue;
    for (const YawRates& rates : yaw_rates_of(recording, wheels.prior)) {
      const RateGrid gyro(span.begin_ns, span.end_ns, rates.turns);
      if (check_order(recording, wheels, gyro, recording.label<EncoderSample>(wheels.sensor),
                      out)) {
        break;
      }
    }
  }
}

}  // namespace viwo::inspect

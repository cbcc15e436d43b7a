#include <algorithm>
#include <string>
#include <vector>

#include "checks.hpp"
#include "viwo/plausibility/yaw_order.hpp"
#include "viwo/series/rate_grid.hpp"

namespace viwo::inspect {

using series::RateGrid;
using series::Recording;
using series::Span;
using series::turns_of;
using series::Wheels;
using series::YawRates;

namespace {

YawDifference between(const RateGrid& gyro, const RateGrid& wheels) {
  YawDifference difference;
  for (std::size_t i = 0; i < std::min(gyro.size(), wheels.size()); ++i) {
    if (gyro.has(i) && wheels.has(i)) difference.add(gyro[i].z(), wheels[i].z());
  }
  return difference;
}

/// Each change undone, by what is left of the gyro's rate: as the parity residual says it of wheels
/// that can contradict each other.
bool check_order(const Recording& recording, const Wheels& wheels, const RateGrid& gyro,
                 const std::string& label, Findings& out) {
  const Span span = span_of(recording);
  const auto changes = changes_by_gyro(wheels.model, wheels.prior.wheels.x_WI);
  std::vector<YawDifference> undone;
  for (const ChannelChange& change : changes) {
    Wheels changed = wheels;
    for (EncoderSample& sample : changed.samples) change.undo(sample);
    undone.push_back(between(gyro, RateGrid(span.begin_ns, span.end_ns, turns_of(changed))));
  }
  const auto opposite = about(turns_of(wheels), -Eigen::Vector3d::UnitZ());
  const std::size_t best =
      clear_change(undone, between(gyro, RateGrid(span.begin_ns, span.end_ns, opposite)));
  if (best == 0) return false;
  out.push_back(
      {label,
       Severity::kFault,
       "order",
       text_of(changes[best], undone.front(), undone[best]),
       {{"left as it is", undone.front().part(), ""}, {"left without it", undone[best].part(), ""}},
       changes[best].remedies(wheels.sensor, wheels.model->description())});
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

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "viwo/plausibility/change_trial.hpp"
#include "viwo/plausibility/yaw_order.hpp"
#include "viwo/series/rate_grid.hpp"
#include "viwo/series/wheel_calibration.hpp"
#include "viwo/wheel_checks/wheel_checks.hpp"

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

/// By the rate of the gyro, each change undone; none where there is no gyro.
std::vector<YawDifference> differences(const Recording& recording, const Wheels& wheels,
                                       const RateGrid& gyro,
                                       const std::vector<ChannelChange>& changes) {
  const Span span = span_of(recording);
  std::vector<YawDifference> undone;
  for (const ChannelChange& change : changes) {
    Wheels changed = wheels;
    for (EncoderSample& sample : changed.samples) change.undo(sample);
    undone.push_back(between(gyro, RateGrid(span.begin_ns, span.end_ns, turns_of(changed))));
  }
  return undone;
}

/// Each change undone, by what is left of the gyro's rate: as the parity residual says it of wheels
/// that can contradict each other.
bool check_by_gyro(const Recording& recording, const Wheels& wheels, const RateGrid& gyro,
                   const std::string& label, Findings& out) {
  const Span span = span_of(recording);
  const auto changes = changes_by_gyro(wheels.model, wheels.prior.wheels.x_WI);
  const std::vector<YawDifference> undone = differences(recording, wheels, gyro, changes);
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

/// Those that the gyro's rate does not speak against: an order of a base that is turned by half a
/// turn fits as well, and turns the other way.
std::vector<ChannelChange> with_gyro(const Recording& recording, const Wheels& wheels,
                                     const RateGrid& gyro,
                                     const std::vector<ChannelChange>& changes) {
  constexpr double kClear = 0.1;
  const std::vector<YawDifference> undone = differences(recording, wheels, gyro, changes);
  const double least = std::ranges::min_element(undone, {}, &YawDifference::part)->part();
  std::vector<ChannelChange> left;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    if (undone[i].part() <= std::max(kClear, 3. * least)) left.push_back(changes[i]);
  }
  return left;
}

/// Which change, undone, stops the wheels from contradicting each other.
void check_by_parity(const Recording& recording, const Wheels& wheels, const std::string& label,
                     Findings& out) {
  const ModelDescription& description = wheels.model->description();
  std::vector<ChannelChange> tried = channel_changes(description);
  const std::vector<ChannelChange> orders = order_changes(description);
  tried.insert(tried.end(), orders.begin(), orders.end());
  ChangeTrial trial(wheels.model, wheels.prior.wheels.x_WI, std::move(tried));
  constexpr std::size_t kMost = 500;
  for (const EncoderSample& sample : moving_samples(wheels, kMost)) trial.add(sample);
  std::vector<ChannelChange> changes = trial.explaining();
  if (changes.empty()) return;
  const Span span = span_of(recording);
  for (const YawRates& rates : yaw_rates_of(recording, wheels.prior)) {
    if (changes.size() == 1) break;
    const RateGrid gyro(span.begin_ns, span.end_ns, rates.turns);
    changes = with_gyro(recording, wheels, gyro, changes);
  }
  // One thing that was done is likelier than several.
  if (!std::ranges::all_of(changes, &ChannelChange::moves_many)) {
    std::erase_if(changes, [](const ChannelChange& change) { return change.moves_many(); });
  }
  Finding finding{label, Severity::kFault, "order", text_of(changes)};
  if (changes.size() == 1) finding.remedies = changes[0].remedies(wheels.sensor, description);
  out.push_back(std::move(finding));
}

}  // namespace

void check_order(const Recording& recording, Findings& out) {
  const Span span = span_of(recording);
  for (const Wheels& wheels : recording.wheels) {
    if (wheels.samples.empty() || !wheels.unusable.empty()) continue;
    const std::string label = recording.label<EncoderSample>(wheels.sensor);
    const bool is_told = std::ranges::any_of(
        recording.implausible,
        [&](const viwo::Finding& found) { return found.key == label + " steering"; });
    if (!is_told) check_by_parity(recording, wheels, label, out);
    for (const YawRates& rates : yaw_rates_of(recording, wheels.prior)) {
      const RateGrid gyro(span.begin_ns, span.end_ns, rates.turns);
      if (check_by_gyro(recording, wheels, gyro, label, out)) break;
    }
  }
}

}  // namespace viwo::inspect

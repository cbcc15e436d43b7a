#include "calibration_scatter.hpp"

#include <cmath>

#include "viwo/math/arrays.hpp"
#include "viwo/math/chi2.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

/// What lasts, lasts for seconds.
constexpr double kLook_s = 5.;
/// Part of the variance that a stretch has to take away: rounding is less.
constexpr double kLeastLoss = 0.01;
constexpr double kChance = 1e-5;

/// An entry of a rotation: of its turn from where it was declared.
double value_of(const BlockSpec& spec, const BlockView& view, int entry) {
  const int behind = entry - 3 * spec.rotations;
  if (behind >= 0) return view.numbers()[behind];
  const int i = entry / 3;
  const BlockView::Rotation declared(spec.value.data() + 9 * static_cast<std::ptrdiff_t>(i));
  return log_so3(view.rotation(i) * declared.transpose())[entry % 3];
}

}  // namespace

CalibrationScatter::CalibrationScatter(const StateBlocks& blocks) {
  std::size_t n = 0;
  for (const BlockSpec& spec : blocks.specs()) n += spec.entries.size();
  entries_.resize(n);
}

bool CalibrationScatter::epoch(const Filter& filter) {
  const bool is_due = seconds_between(looked_ns_, filter.t_ns()) >= kLook_s;
  if (!is_new_ && !is_due) return false;
  look(filter);
  looked_ns_ = filter.t_ns();
  is_new_ = false;
  return true;
}

void CalibrationScatter::look(const Filter& filter) {
  const StateBlocks& blocks = filter.blocks();
  auto entry = entries_.begin();
  for (std::size_t b = 0; b < blocks.specs().size(); ++b) {
    const BlockSpec& spec = blocks.specs()[b];
    const BlockView& view = blocks.views()[b];
    const bool is_constant = spec.process == Process::kConstant && view.column() >= 0;
    for (int i = 0; i < static_cast<int>(spec.entries.size()); ++i, ++entry) {
      if (!is_constant) continue;
      const int column = view.column() + i;
      look(*entry, value_of(spec, view, i), filter.covariance()(column, column));
    }
  }
}

void CalibrationScatter::look(Entry& entry, double value, double variance) const {
  if (!is_new_) {
    const double lost = entry.variance - variance;
    if (!(lost > kLeastLoss * entry.variance)) return;  // the stretch goes on
    if (entry.is_settled) {
      const double moved = value - entry.value;
      entry.squares += moved * moved / lost;
      ++entry.stretches;
    }
  }
  entry.is_settled = !is_new_;
  entry.value = value;
  entry.variance = variance;
}

std::vector<double> CalibrationScatter::factors() const {
  std::vector<double> factors;
  for (const Entry& entry : entries_) {
    const int n = entry.stretches;
    const bool is_beyond_chance = n > 0 && entry.squares > chi2_quantile(1. - kChance, n);
    factors.push_back(is_beyond_chance ? std::sqrt(entry.squares / n) : 1.);
  }
  return factors;
}

}  // namespace viwo

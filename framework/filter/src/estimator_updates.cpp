// How the estimator deals with its updates: calls them, applies their factors, and goes on without
// those that fail.
#include <algorithm>

#include "viwo/filter/estimator.hpp"
#include "viwo/plugin_host/plugin_info.hpp"

namespace viwo {
namespace {

/// Text of what `call`, into an update, threw; nothing if it returned. What a model threw, and
/// input that the user has to mend, passes.
template <class Call>
std::optional<std::string> text_of_thrown(Call&& call) {
  try {
    call();
    return std::nullopt;
  } catch (const PluginFailure&) {
    throw;
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return "threw something that is not a std::exception";
  }
}

/// residual -= H dx: the factor as it would be at an estimate that has moved by dx since.
void take_off(const Eigen::VectorXd& dx, ResidualFactor& factor) {
  int start = 0;
  for (const ColumnRange& block : factor.columns.blocks()) {
    factor.residual.noalias() -=
        factor.H.middleCols(start, block.count).lazyProduct(dx.segment(block.first, block.count));
    start += block.count;
  }
}

/// eta -= Lambda dx, likewise.
void take_off(const Eigen::VectorXd& dx, InformationFactor& factor) {
  int col = 0;
  for (const ColumnRange& block : factor.columns.blocks()) {
    for (int i = 0; i < block.count; ++i, ++col) {
      const double step = dx[block.first + i];
      for (int row = 0; row < factor.columns.size(); ++row) {
        factor.eta[row] -= step * factor.Lambda(std::max(row, col), std::min(row, col));
      }
    }
  }
}

}  // namespace

void Estimator::start_update(const UpdateEntry& entry, const UpdateSetup& setup) {
  if (const auto thrown = text_of_thrown([&] { entry.update->start(setup); })) {
    throw UpdateFailure(entry.name, *thrown);
  }
}

template <class Factor>
FactorResult Estimator::apply(const UpdateEntry& update, const Factor& factor) {
  if (observer_ != nullptr) observer_->on_factor(filter_, update, factor);
  for (ExcitationMonitor& monitor : monitors_) monitor.before(filter_, factor);
  const FactorResult result = filter_.apply(factor);
  if (result == FactorResult::kApplied) {
    for (ExcitationMonitor& monitor : monitors_) monitor.applied();
  }
  return result;
}

/// False when there is nothing to apply: the update is disabled, or failed.
bool Estimator::call_update(std::size_t index, const EpochData& data) {
  const UpdateEntry& entry = updates_[index];
  UpdateFailures& failures = failures_[index];
  sink_.clear();
  if (failures.disabled) return false;
  std::optional<std::string> thrown;
  try {
    thrown = text_of_thrown([&] { entry.update->update(filter_.view(entry.wheels), data, sink_); });
  } catch (const InputError& error) {
    thrown = error.what();
  }
  if (!thrown) return true;
  if (options_.frozen) throw UpdateFailure(entry.name, *thrown);
  if (++failures.count == 1) failures.cause = *thrown;
  failures.disabled = failures.count >= options_.max_update_failures;
  return false;
}

void Estimator::run_update(std::size_t index, const EpochData& data) {
  const UpdateEntry& entry = updates_[index];
  if (!call_update(index, data)) return;
  UpdateCounts& counts = counts_[index];
  counts.applied += sink_.applied();
  counts.rejected += sink_.rejected();
  bool has_moved = false;
  for (const ResidualFactor& factor : sink_.residuals()) {
    const ResidualFactor* next = &factor;
    if (has_moved || options_.frozen) {
      residual_factor_ = factor;
      if (has_moved) take_off(moved_, residual_factor_);
      if (options_.frozen) residual_factor_.residual.setZero();
      next = &residual_factor_;
    }
    const FactorResult result = apply(entry, *next);
    if (result == FactorResult::kGated && gated_[index].count++ == 0) {
      gated_[index].first_ns = filter_.t_ns();
    }
    const bool applied = result == FactorResult::kApplied;
    ++(applied ? counts.applied : counts.rejected);
    if (!applied) continue;
    if (!has_moved) moved_.setZero();
    has_moved = true;
    moved_ += filter_.correction();
  }
  if (const InformationFactor* information = sink_.information()) {
    if (has_moved || options_.frozen) {
      information_factor_ = *information;
      if (has_moved) take_off(moved_, information_factor_);
      if (options_.frozen) information_factor_.eta.setZero();
      information = &information_factor_;
    }
    if (apply(entry, *information) == FactorResult::kRejected) {
      reject((entry.name + ": information that is not finite or empty").c_str(), filter_.t_ns());
    }
  }
}

}  // namespace viwo

#include "path_recorder.hpp"

#include "viwo/filter/filter.hpp"

namespace viwo::smoother {

PathRecorder::PathRecorder(const Estimator& estimator) {
  const Filter& filter = estimator.filter();
  const auto specs = filter.blocks().specs();
  prior_.specs.assign(specs.begin(), specs.end());
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const int column = filter.blocks().view({static_cast<int>(i)}).column();
    prior_.first.push_back(column < 0 ? -1 : column - filter.blocks().first_column());
  }
  const int n = filter.blocks().columns();
  prior_.P = filter.covariance().bottomRightCorner(n, n);
  // Where the start is known it has begun.
  if (filter.initialized()) start_ = {filter.t_ns(), filter.imu(), filter.imu_covariance()};
}

void PathRecorder::on_start(const Filter& /*filter*/, const ImuPrior& prior) { start_ = prior; }

void PathRecorder::on_clone(const Filter& filter, const ImuMatrix& /*Phi*/) {
  const auto slot = static_cast<std::size_t>(filter.clones().back().slot);
  if (slot >= epoch_in_slot_.size()) epoch_in_slot_.resize(slot + 1);
  epoch_in_slot_[slot] = path_.epochs.size();
  path_.epochs.push_back({filter.t_ns(), filter.imu()});
}

void PathRecorder::on_epoch(const Filter& filter, const EpochData& /*data*/) {
  path_.epochs.back().state = filter.imu();
  for (const CloneState& clone : filter.clones()) {
    ImuState& state = path_.epochs[epoch_in_slot_[static_cast<std::size_t>(clone.slot)]].state;
    state.R_GtoI = clone.R_GtoI;
    state.p_IinG = clone.p_IinG;
  }
  blocks_.resize(prior_.specs.size());
  for (std::size_t i = 0; i < blocks_.size(); ++i) blocks_[i] = filter.blocks().value(i);
}

}  // namespace viwo::smoother

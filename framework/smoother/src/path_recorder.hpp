// What a run of the filter leaves for a smoother: where it began, its path, its blocks.
#pragma once

#include <vector>

#include "viwo/estimator/estimator.hpp"

namespace viwo::smoother {

/// What the filter knew of the blocks before it began.
struct BlockPrior {
  std::vector<BlockSpec> specs;
  std::vector<int> first;  ///< of each block, its first row in P; -1: all of it is held
  Eigen::MatrixXd P;       ///< of all columns of blocks, by their order in the state
};

class PathRecorder final : public EstimatorObserver {
 public:
  explicit PathRecorder(const Estimator& estimator);

  void on_start(const Filter& filter, const ImuPrior& prior) override;
  void on_clone(const Filter& filter, const ImuMatrix& Phi) override;
  void on_epoch(const Filter& filter, const EpochData& data) override;

  const ImuPrior& start() const { return start_; }
  const BlockPrior& prior() const { return prior_; }
  /// Each epoch as the filter saw it last, when it dropped the clone.
  const GivenPath& path() const { return path_; }
  /// Of each block, at the end.
  const std::vector<std::vector<double>>& blocks() const { return blocks_; }

 private:
  ImuPrior start_;
  BlockPrior prior_;
  GivenPath path_;
  std::vector<std::size_t> epoch_in_slot_;
  std::vector<std::vector<double>> blocks_;
};

}  // namespace viwo::smoother

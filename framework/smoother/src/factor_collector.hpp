// The factors of one pass of a frozen estimator along a given path, as normal equations.
// Equations: docs/math/smoother.md.
#pragma once

#include <vector>

#include "arrow_system.hpp"
#include "path_recorder.hpp"
#include "viwo/estimator/estimator.hpp"

namespace viwo::smoother {

/// One entry of a block that moves while the filter runs: it is another unknown in each epoch.
struct MovingEntry {
  int column = 0;  ///< of blocks
  double process_sigma = 0.;
  double time_constant_s = 0.;  ///< 0: a random walk
};

/// Of a block in a room: another unknown whenever it is added.
inline constexpr int kInRoom = kHeld + 1;

/// Which unknown each column of blocks in the state is, counted from the first one.
struct BlockColumns {
  std::vector<int> unknown;  ///< shared, kHeld, kInRoom, or of the recording from 0 on
  int own = 0;               ///< of these
  std::vector<MovingEntry> moving;
};

/// Unknowns of a state of the IMU; those of the start come first, then those of each epoch, then
/// blocks that only this recording has, then what moves, epoch by epoch.
class FactorCollector final : public EstimatorObserver {
 public:
  FactorCollector(const PathRecorder& run, const ImuState& start, std::size_t epochs,
                  const BlockColumns& columns, int n_shared);

  void on_propagated(const Filter& filter, const ImuTransition& transition) override;
  void on_clone(const Filter& filter, const ImuMatrix& Phi) override;
  void on_drop(const Filter& filter, BlockId block) override;
  void on_factor(const Filter& filter, const UpdateEntry& update,
                 const ResidualFactor& factor) override;
  void on_factor(const Filter& filter, const UpdateEntry& update,
                 const InformationFactor& factor) override;

  ArrowSystem& system() { return system_; }
  /// Where the factors were linearised.
  const GivenPath& path() const { return path_; }
  /// Rows of residual factors, and those that were weighed down.
  long rows() const { return rows_; }
  long weighed_down() const { return weighed_down_; }

 private:
  void tie_moving(const Filter& filter);
  void collect(const Filter& filter, const FactorColumns& columns);
  int unknown(const Filter& filter, int column);

  ArrowSystem system_;
  BlockColumns blocks_;
  int first_moving_;
  int next_in_room_;
  const Eigen::MatrixXd& prior_;
  GivenPath path_;
  std::vector<std::size_t> epoch_in_slot_;
  ImuTransition transition_;
  ImuState predicted_;
  std::vector<int> columns_;
  long rows_ = 0, weighed_down_ = 0;
};

}  // namespace viwo::smoother

// The blocks of a filter's state: where their errors stand, what is estimated, how they move.
// Knows nothing of what they mean.
#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/block.hpp"
#include "viwo/api/update.hpp"
#include "viwo/filter/covariance.hpp"

namespace viwo {

/// One number of the calibration as it stands.
struct BlockEstimate {
  double value = 0.;  ///< of a rotation: of its rotation vector
  double sigma = 0.;  ///< 0 for what is held
};

/// How entries of declared blocks hang together at the start.
struct PriorCorrelations {
  std::vector<std::string> entries;  ///< names; those that no block has do not matter
  Eigen::MatrixXd matrix = {};       ///< symmetric, of ones on its diagonal

  /// Entries that hang together with none of these.
  void append(const PriorCorrelations& other);
  /// Of entries with these names, in their order; those that are not known hang together with
  /// nothing.
  Eigen::MatrixXd among(std::span<const std::string> names) const;
};

/// Blocks that the monitor of excitation watches together.
struct BlockGroup {
  std::string name;
  std::vector<BlockId> blocks;  ///< their columns lie side by side
  BlockId mount;                ///< pose of the IMU in the frame that moves; index -1: none
};

/// What is wrong with a spec; "" for nothing.
std::string fault_of(const BlockSpec& spec);
std::string fault_of(const RoomSpec& spec);

/// Whether it is one rotation and three numbers.
bool is_pose(const BlockSpec& spec);

/// Columns: blocks that nobody watches, rooms, then the groups that are watched.
class StateBlocks {
 public:
  /// `blocks` and `rooms` without faults. Allocates all that is ever needed.
  StateBlocks(std::vector<BlockSpec> blocks, std::vector<RoomSpec> rooms, int first_column);
  StateBlocks(StateBlocks&&) = default;
  StateBlocks& operator=(StateBlocks&&) = default;
  StateBlocks(const StateBlocks&) = delete;
  StateBlocks& operator=(const StateBlocks&) = delete;

  /// Of the declared blocks, by BlockId::index.
  std::span<const BlockSpec> specs() const { return specs_; }
  /// All: the declared ones, then those of the rooms.
  std::span<const BlockView> views() const { return views_; }
  const BlockView& view(BlockId id) const { return views_[index(id)]; }
  /// A declared block as it stands, in the layout of BlockSpec::value.
  std::vector<double> value(std::size_t block) const;
  std::span<const BlockGroup> groups() const { return groups_; }
  int first_column() const { return first_column_; }
  int columns() const { return columns_; }
  /// Where the groups begin; all columns from there on are watched.
  int first_watched() const { return first_watched_; }

  /// The prior of all declared blocks: their sigmas, with these correlations. Rooms are empty.
  void set_prior(Covariance& covariance, const PriorCorrelations& correlations = {}) const;
  /// Estimates of the entries of a declared block, in their order.
  void estimates(BlockId id, const Covariance& covariance, std::vector<BlockEstimate>& out) const;

  /// Retracts all blocks; without first estimates those follow.
  void correct(const Eigen::VectorXd& dx, bool first_estimates);
  /// What random walks and Gauss-Markov processes do in `dt_s`.
  void propagate(double dt_s, Covariance& covariance);
  /// The name of a declared block that is not finite any more; "" for none.
  std::string not_finite() const;

  const std::vector<RoomSpec>& rooms() const { return rooms_; }
  /// The last one is used first.
  const std::vector<BlockId>& free_blocks(RoomId room) const {
    return free_[static_cast<std::size_t>(room.index)];
  }
  /// Whether a block of a room is in use.
  bool exists(BlockId id) const { return room_of(id) >= 0 && used_[index(id)]; }
  /// The room of a block; -1 for a declared one, or none.
  int room_of(BlockId id) const;
  void add(const AddedBlock& block);
  void drop(BlockId id);
  void rewrite(const BlockRewrite& block);

 private:
  static std::size_t index(BlockId id) { return static_cast<std::size_t>(id.index); }
  void place(std::size_t block, int& next);

  int first_column_;
  int columns_ = 0;
  int first_watched_ = 0;
  std::vector<BlockSpec> specs_;
  std::vector<RoomSpec> rooms_;
  std::vector<std::size_t> offset_;  ///< of the numbers of each block
  std::vector<double> value_, first_;
  std::vector<BlockView> views_;
  std::vector<BlockGroup> groups_;
  std::vector<int> room_;
  std::vector<bool> used_;
  std::vector<std::vector<BlockId>> free_;
  std::vector<std::size_t> moving_;  ///< blocks with a process
};

}  // namespace viwo

// The filter: inertial state, ring of clones, state blocks and their covariance. Knows nothing of
// what the blocks mean beyond where their errors stand in the state.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/update.hpp"
#include "viwo/filter/covariance.hpp"
#include "viwo/filter/held_directions.hpp"
#include "viwo/filter/shared_position.hpp"
#include "viwo/filter/state_blocks.hpp"

namespace viwo {

/// What keeps the place and the yaw of the world unseen while estimates move.
enum class Consistency : std::uint8_t {
  kTransform,       ///< the covariance goes with each correction of the poses (F-45)
  kFirstEstimates,  ///< Jacobians stay where a pose was when it was first used (F-6)
  kNone,            ///< nothing: a plain extended Kalman filter
};

struct FilterOptions {
  int clones = 11;  ///< kept between epochs; one more exists during an update
  Consistency consistency = Consistency::kTransform;
  ImuNoise imu_noise;
  double gravity_m_per_s2 = 9.81;
  PriorCorrelations correlations = {};  ///< of the entries of blocks
};

/// An inertial state to start from.
struct ImuPrior {
  std::int64_t t_ns = 0;
  ImuState state;  ///< first estimates are ignored
  ImuMatrix P = ImuMatrix::Zero();
};

class Filter {
 public:
  /// Allocates all that is ever needed. InputError for blocks and rooms that are none, with their
  /// names; std::invalid_argument for a number of clones that does not fit.
  explicit Filter(const FilterOptions& options, std::vector<BlockSpec> blocks = {},
                  std::vector<RoomSpec> rooms = {});

  void initialize(const ImuPrior& prior);
  bool initialized() const { return t_ns_ != kNever; }

  /// Moves the inertial state to the stamp of the last sample; the first one is at t_ns(). Returns
  /// the transition (identity, without noise, for no samples).
  ImuTransition propagate(std::span<const ImuSample> samples, std::span<const double> gaps_s = {});
  /// Another estimate, at which Jacobians are taken from now on, too.
  void set_imu(const ImuState& state);
  /// Something has moved the IMU's state that no noise explains: its covariance grows by what it
  /// may be off, `times` over (F-28).
  void loosen(double times);
  /// Appends the present pose; `sample` is the IMU reading at t_ns(). There must be room (drop the
  /// oldest clone first).
  void clone(const ImuSample& sample);
  void drop_oldest_clone();
  /// True when the oldest clone is to leave: as many exist as fit, or as the limit allows.
  bool window_full() const { return clones_.size() >= std::min(slots_.size(), window_limit_); }
  /// Makes the window shorter than there is room for; at least 2.
  void limit_window(std::size_t clones) { window_limit_ = std::max<std::size_t>(clones, 2); }

  /// Applies a factor and corrects the estimate. The errors stay those of the estimate at which the
  /// factor was linearised, so that others of the same linearisation can follow, until rebase().
  FactorResult apply(const ResidualFactor& factor);
  FactorResult apply(const InformationFactor& factor);
  /// The same for a factor that determines blocks that are new; they exist if it was applied. What
  /// it says of the others is left in `factor`.
  FactorResult apply(InformationFactor& factor, std::span<const AddedBlock> added);
  /// Errors become those of the corrected estimate, and Jacobians are taken there. What propagates,
  /// clones, drops or rewrites does so first.
  void rebase();
  /// Of blocks in rooms that exist.
  void drop(BlockId id);
  void rewrite(const BlockRewrite& block);
  /// What of the watched blocks the factors to come are to leave alone.
  HeldDirections& held() { return held_; }
  const HeldDirections& held() const { return held_; }
  /// What the last apply() corrected the estimate by; zero unless its factor was applied.
  const Eigen::VectorXd& correction() const { return dx_; }

  /// Whether an information matrix stopped being positive definite.
  bool covariance_failed() const { return covariance_failed_; }

  std::int64_t t_ns() const { return t_ns_; }
  const FilterOptions& options() const { return options_; }
  const ImuState& imu() const { return imu_; }
  std::span<const CloneState> clones() const { return clones_; }
  const StateBlocks& blocks() const { return blocks_; }
  /// Without what all poses have in common where that is large (F-41): imu_covariance() has it.
  const Eigen::MatrixXd& covariance() const { return covariance_.matrix(); }
  ImuMatrix imu_covariance() const;
  int size() const { return covariance_.size(); }
  /// Estimates of the entries of a declared block, in their order; appended to `out`.
  void estimates(BlockId id, std::vector<BlockEstimate>& out) const {
    blocks_.estimates(id, covariance_, out);
  }
  /// std::logic_error between apply() and rebase().
  FilterView view() const;

 private:
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();
  template <class Factor>
  FactorResult apply_factor(const Factor& factor);
  template <class Factor>
  void see_position(const Factor& factor);
  void correct();

  FilterOptions options_;
  std::int64_t t_ns_ = kNever;
  ImuState imu_;
  std::vector<CloneState> clones_;  // oldest first
  std::vector<bool> slots_;         // taken
  std::size_t window_limit_ = std::numeric_limits<std::size_t>::max();
  StateBlocks blocks_;
  Covariance covariance_;
  SharedPosition shared_position_;
  HeldDirections held_;
  Eigen::VectorXd dx_;
  std::vector<int> new_columns_;
  bool has_moved_ = false;  // since rebase()
  std::vector<ErrorMove> moves_;
  bool covariance_failed_ = false;
};

}  // namespace viwo

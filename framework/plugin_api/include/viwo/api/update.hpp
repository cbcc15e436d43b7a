// Update: says which states and samples it works with, then turns the measurements of an epoch into
// factors. A plugin describes what was measured; only the host touches the estimate and its
// covariance.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/export.hpp"
#include "viwo/api/filter_view.hpp"
#include "viwo/api/noise_scale.hpp"
#include "viwo/api/rejections.hpp"

namespace viwo {

inline constexpr int kMaxFactorRows = 24;
inline constexpr int kMaxFactorColumns = 84;
inline constexpr int kMaxFactorBlocks = 32;

/// Consecutive columns of the error state.
struct ColumnRange {
  int first = 0;
  int count = 0;
};

/// The columns that a factor's Jacobian has, block after block. Blocks must not overlap. Blocks
/// that are held (first < 0) must be left out.
class FactorColumns {
 public:
  void clear() { n_blocks_ = size_ = 0; }
  /// Returns where the block starts in the factor's own columns. std::out_of_range when too many.
  VIWO_API int add(int first, int count);
  std::span<const ColumnRange> blocks() const {
    return {blocks_.data(), static_cast<std::size_t>(n_blocks_)};
  }
  int size() const { return size_; }

 private:
  std::array<ColumnRange, kMaxFactorBlocks> blocks_{};
  int n_blocks_ = 0;
  int size_ = 0;
};

/// residual = measured - predicted = H dx + noise, Cov(noise) = R.
struct ResidualFactor {
  FactorColumns columns;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxFactorRows,
                kMaxFactorColumns>
      H;
  Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxFactorRows, 1> residual;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxFactorRows,
                kMaxFactorRows>
      R;
  /// A residual that is less likely than this counts as rejected. 0: no gate.
  double gate_probability = 0.;
  /// Such a factor is not dropped but weighed down, until its residual is just as likely as the
  /// gate (F-32): for what is always measured, if sometimes badly. The estimate cannot be locked
  /// out.
  bool heavy_tailed = false;
  /// The host takes R times what was found, and tells what it finds; null: R as it is. Of the
  /// plugin, which keeps it.
  NoiseScale* noise = nullptr;

  /// Sizes H (zero), residual and R (zero) for `rows` and the columns added so far.
  VIWO_API void set_rows(int rows);
};

/// Many measurements at once, by their normal equations: the cost of an error dx of the columns is
/// dx^T Lambda dx - 2 eta^T dx + constant, Lambda = sum H^T R^-1 H, eta = sum H^T R^-1 residual.
/// Gates are the plugin's.
struct InformationFactor {
  FactorColumns columns;
  Eigen::MatrixXd Lambda;  ///< only the lower triangle of the leading columns.size() is read
  Eigen::VectorXd eta;
};

/// A block that an update has added in the present call.
struct AddedBlock {
  BlockId id;
  std::array<double, kMaxRoomEntries> value{};
};

/// Where an update puts its factors. Storage belongs to the host and is used again: no allocation.
class VIWO_API FactorSink {
 public:
  FactorSink(int max_residual_factors, int max_state_size);

  /// An empty factor, std::out_of_range when there is no room for another one.
  ResidualFactor& add_residual();
  /// The one information factor of this epoch, no columns; Lambda and eta have room for all of
  /// the state and hold anything.
  InformationFactor& add_information();

  /// A new block with `value` (of RoomSpec::entries numbers), of which nothing is known but what
  /// the information factor of this call says: the host splits off the part that only the new block
  /// has (delayed initialisation), so that its columns are used as any others. What they tell
  /// together must determine it. Nothing when the room is full. ContractError for a room of another
  /// update.
  std::optional<BlockId> add_block(RoomId room, std::span<const double> value);

  /// Measurements that the plugin has put into an information factor, or gated out of it.
  void count(std::int64_t applied, std::int64_t rejected) {
    applied_ += applied;
    rejected_ += rejected;
  }

  void clear();
  std::span<const ResidualFactor> residuals() const { return {residuals_.data(), n_residuals_}; }
  const InformationFactor* information() const {
    return has_information_ ? &information_ : nullptr;
  }
  std::span<const AddedBlock> added() const { return added_; }
  std::int64_t applied() const { return applied_; }
  std::int64_t rejected() const { return rejected_; }

  /// The host's: free blocks of each room, in the order in which they are to be used; null for a
  /// room of another update.
  struct FreeBlocks {
    const std::vector<BlockId>* free = nullptr;
    int entries = 0;
    std::size_t taken = 0;
  };
  std::vector<FreeBlocks>& rooms() { return rooms_; }

 private:
  std::vector<ResidualFactor> residuals_;
  std::size_t n_residuals_ = 0;
  InformationFactor information_;
  bool has_information_ = false;
  std::vector<AddedBlock> added_;
  std::vector<FreeBlocks> rooms_;
  std::int64_t applied_ = 0;
  std::int64_t rejected_ = 0;
};

/// Writes a block of a room anew: its error becomes J times those of `columns` (which may be its
/// own), its value and first estimate are set. So a landmark gets another anchor.
struct BlockRewrite {
  BlockId id;
  FactorColumns columns;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxRoomEntries,
                kMaxFactorColumns>
      J;  ///< RoomSpec::entries x columns.size()
  std::array<double, kMaxRoomEntries> value{};
  std::array<double, kMaxRoomEntries> first_estimate{};
};

/// What an update does with the blocks of its rooms when its factors have been applied.
/// ContractError for a block that it has not added, or has dropped.
class VIWO_API BlockEdits {
 public:
  virtual ~BlockEdits();
  virtual void drop(BlockId id) = 0;
  virtual void rewrite(const BlockRewrite& block) = 0;
};

/// What of a stream an epoch is given.
enum class Given : std::uint8_t {
  kOnce,             ///< what came up to its end and was not given before, in time order
  kSinceOldestClone  ///< all from the oldest clone on, also behind the end of the epoch
};

/// A kind of samples that an update takes.
struct StreamSpec {
  const SampleType* type = nullptr;  ///< &sample_type<EncoderSample>()
  /// Which sensor gives them; "": that of the update's section (`sensor: NAME`), or else the only
  /// sensor of the run that yields them.
  std::string sensor = {};
  Given given = Given::kOnce;
  bool ends_epochs = false;  ///< each instant of a sample is the end of an epoch
  bool awaited = false;      ///< an epoch waits (for max_wait_s at most) until they reach its end
  bool optional = false;     ///< no sensor need give them
  /// How many samples one instant has: the images of a synchronised pair.
  int per_instant = 1;
  /// Numbers that stamps of each channel (SampleType::channel) need to be those of the IMU: a
  /// constant, s, and a block of one entry, s, or no block. None: they are.
  struct Clock {
    double constant_s = 0.;
    BlockId block;
    bool operator==(const Clock&) const = default;
  };
  std::vector<Clock> clocks = {};
};

/// Where an update says, once and before start(), what it works with. What is shared by name must
/// agree. Calls after declare() has returned are a ContractError, which turns the update off.
class VIWO_API Declarations {
 public:
  virtual ~Declarations();
  /// Cameras and wheels of the configuration.
  virtual Rig& rig() = 0;

  /// A block of the state. InputError for a spec that is none, or when another update has declared
  /// one of this name that differs.
  virtual BlockId block(const BlockSpec& spec) = 0;
  /// A block that another update declares, before or after this one.
  virtual BlockId block(std::string_view name) = 0;
  /// Room for blocks of its own.
  virtual RoomId room(const RoomSpec& spec) = 0;
  virtual StreamId stream(const StreamSpec& spec) = 0;
};

/// What an update is told once, before its first epoch.
struct UpdateSetup {
  int max_clones = 0;  ///< that exist during an update, the newest included
  int max_state_size = 0;
};

/// Calls are serialised by the host: declare() and start() once, then update() and settle() once
/// per epoch, in time order. Neither must allocate in the steady state.
class VIWO_API Update {
 public:
  virtual ~Update();
  /// Says what it works with. Throws InputError when the configuration lacks something (a camera,
  /// ...). May be called for an instance that is never started.
  virtual void declare(Declarations& host) = 0;
  /// Allocates.
  virtual void start(const UpdateSetup& setup);
  /// Adds factors to `sink`. The factors of one call are linearised at the same estimate and
  /// applied one after the other, residual factors first.
  virtual void update(const FilterView& filter, const EpochData& data, FactorSink& sink) = 0;
  /// The factors of update() have been applied: drops and rewrites blocks of its rooms, at the new
  /// estimates. Only called for updates that have a room.
  virtual void settle(const FilterView& filter, BlockEdits& edits);
  /// What was not used, and why; appended to `out`.
  virtual void rejections(std::vector<RejectionCount>& out) const;
  /// How large its noises were found to be; appended to `out`.
  virtual void noises(std::vector<NoiseFound>& out) const;
};

}  // namespace viwo

// State blocks: what a filter estimates beside the IMU's own state and its past poses. Updates
// declare them (update.hpp); the host knows their columns and covariance and nothing of what they
// mean.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/export.hpp"

namespace viwo {

/// What has to happen for an entry to be learned: for warnings of the host's monitor.
enum class Excitation : std::uint8_t {
  kPlanar,  ///< turns, with the direction of the motion changing
  kClock,   ///< a velocity or rate that changes
  kTilt     ///< roll or pitch
};

/// How a block moves while nothing is measured.
enum class Process : std::uint8_t {
  kConstant,
  kRandomWalk,   ///< process_sigma: in the entry's unit per sqrt(s)
  kGaussMarkov,  ///< back to the declared value with time_constant_s; process_sigma: when settled
};

/// One number of the error of a block.
struct BlockEntry {
  std::string name;   ///< in results, "r_1", "cam0.fx": unique in a filter
  std::string unit;   ///< "m", "rad", ...; "" for none
  double sigma = 0.;  ///< prior; 0: held, neither estimated nor uncertain
  double process_sigma = 0.;
  Excitation needs = Excitation::kPlanar;
  bool operator==(const BlockEntry&) const = default;
};

/// A block as it is declared. Its error is a list of entries: rotations first, three entries each
/// (R = Exp(-dtheta) R_hat), then numbers that add. So vectors, rotations, poses and products of
/// them are blocks.
struct VIWO_API BlockSpec {
  std::string name;  ///< "wheels.extrinsics": two declarations of one name are one block
  int rotations = 0;
  std::vector<BlockEntry> entries = {};
  std::vector<double> value =
      {};  ///< nine numbers per rotation, column by column; one per other entry
  Process process = Process::kConstant;
  double time_constant_s = 0.;  ///< of kGaussMarkov
  /// Blocks of one group are watched together by the monitor of excitation, which takes the block
  /// of the group that is a pose as that of the IMU in the frame that moves; "": not watched.
  std::string group = {};

  /// Entries `names` of a rotation [rad]. std::logic_error behind an entry that is none.
  BlockSpec& add_rotation(const std::array<std::string, 3>& names, const Eigen::Matrix3d& R,
                          const Eigen::Vector3d& sigma);
  /// An entry that adds.
  BlockSpec& add(std::string entry, std::string unit, double initial, double sigma,
                 Excitation needs = Excitation::kPlanar);
  bool operator==(const BlockSpec&) const = default;
};

/// Which block; given by the host when it is declared, or added.
struct BlockId {
  int index = -1;
  bool operator==(const BlockId&) const = default;
};

/// Room for blocks that come and go while the filter runs, all with the same number of entries that
/// add. Their entries stand in no result.
struct RoomSpec {
  std::string name;  ///< "landmarks"
  int blocks = 0;    ///< most that exist at a time
  int entries = 0;   ///< of each, at most kMaxRoomEntries
};
inline constexpr int kMaxRoomEntries = 9;

struct RoomId {
  int index = -1;
};

/// A block as it stands in the filter; valid during one call.
class BlockView {
 public:
  BlockView() = default;
  BlockView(int column, int size, int rotations, const double* value, const double* first_estimate)
      : column_(column),
        size_(size),
        rotations_(rotations),
        value_(value),
        first_estimate_(first_estimate) {}

  /// Of its first entry in the error state; -1: all of it is held. Held entries of a block that is
  /// not have columns without variance.
  int column() const { return column_; }
  int size() const { return size_; }  ///< entries

  using Rotation = Eigen::Map<const Eigen::Matrix3d>;
  using Numbers = Eigen::Map<const Eigen::VectorXd>;
  Rotation rotation(int i = 0) const { return Rotation(value_ + 9 * i); }
  /// The entries behind the rotations.
  Numbers numbers() const { return numbers_of(value_); }
  /// As it was declared or added: where Jacobians are taken (FEJ).
  Rotation first_rotation(int i = 0) const { return Rotation(first_estimate_ + 9 * i); }
  Numbers first_numbers() const { return numbers_of(first_estimate_); }

 private:
  Numbers numbers_of(const double* value) const {
    return {value + 9 * rotations_, size_ - 3 * rotations_};
  }

  int column_ = -1;
  int size_ = 0;
  int rotations_ = 0;
  const double* value_ = nullptr;
  const double* first_estimate_ = nullptr;
};

}  // namespace viwo

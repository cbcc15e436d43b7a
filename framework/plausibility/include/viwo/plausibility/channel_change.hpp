// What may have been done to the channels of encoders on their way to a log: one sign or scale, or
// two that are exchanged.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "viwo/api/kinematic_model.hpp"
#include "viwo/plausibility/finding.hpp"
#include "viwo/wheel/wheel_model.hpp"

namespace viwo {

struct ChannelChange {
  enum Kind : std::uint8_t {
    kNone,
    kDriveScale,  ///< of one drive: its sign, or twice or half the counts of a turn
    kDrivesExchanged,
    kSteerSign,
    kSteersExchanged,
    kSteerSigns,
    kWheelsExchanged,
    kSteersInDegrees,
    kSideScale,   ///< of all drives of a side: as kDriveScale
    kNoSteering,  ///< never done: what angles in degrees have to be told from
  };
  Kind kind = kNone;
  std::size_t a = 0, b = 0;  ///< channels
  std::uint32_t side = 0;    ///< drives of kSideScale, one bit each
  double scale = -1.;        ///< that undoes kDriveScale, kSideScale

  void undo(EncoderSample& sample) const;
  /// "drive_2 turns opposite to what the other wheels say: its sign"
  std::string text() const;
  /// What undoes it in the section of a sensor: signs as lists with -1 for what is reversed, an
  /// order as lists that say which channel of the model each channel of the log is, from 1.
  std::vector<Remedy> remedies(const std::string& sensor,
                               const ModelDescription& description) const;
};

/// Signs, orders and units, one change at a time; the first is none.
std::vector<ChannelChange> channel_changes(const ModelDescription& description);

/// One drive that tells half or twice of what its wheel turns.
std::vector<ChannelChange> gear_changes(const ModelDescription& description);

/// All drives of one side reversed, or telling half or twice: of those that turn the base to the
/// left when they turn alone, and of the others. Nothing where a side has one drive, which is among
/// the changes above.
std::vector<ChannelChange> side_changes(const std::shared_ptr<const WheelModel>& model,
                                        const Intrinsics& x_WI);

/// A list in YAML: `entry(i)` as texts.
template <class Entry>
std::string yaml_list(std::size_t n, const Entry& entry) {
  std::string text;
  for (std::size_t i = 0; i < n; ++i) text += (i > 0 ? ", " : "") + std::string(entry(i));
  return "[" + text + "]";
}

}  // namespace viwo

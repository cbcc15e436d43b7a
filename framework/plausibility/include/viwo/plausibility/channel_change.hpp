// What may have been done to the channels of encoders on their way to a log: one sign or scale, or
// another order.
#pragma once

#include <array>
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
    kDriveOrder,
    kSteerSign,
    kSteerOrder,
    kSteerSigns,
    kWheelOrder,
    kSteerUnit,   ///< of all steerings
    kSideScale,   ///< of all drives of a side: as kDriveScale
    kNoSteering,  ///< never done: what angles in degrees have to be told from
  };
  /// Channel i is what is read as channel order[i].
  using Order = std::array<std::size_t, kMaxDrives>;
  static_assert(kMaxDrives == kMaxSteers);

  Kind kind = kNone;
  std::size_t channel = 0;  ///< of kDriveScale, kSteerSign
  std::uint32_t side = 0;   ///< drives of kSideScale, one bit each
  double scale = -1.;       ///< that undoes kDriveScale, kSideScale, kSteerUnit
  Order order{};            ///< that undoes kDriveOrder, kSteerOrder, kWheelOrder

  void undo(EncoderSample& sample) const;
  /// Whether it is another order of more than two.
  bool moves_many() const;
  /// "drive_2 turns opposite to what the other wheels say: its sign"
  std::string text() const;
  /// What undoes it in the section of a sensor: signs as lists with -1 for what is reversed, an
  /// order as lists that say which channel of the model each channel of the log is, from 1.
  std::vector<Remedy> remedies(const std::string& sensor,
                               const ModelDescription& description) const;
};

/// All of them, as what explains something equally well.
std::string text_of(const std::vector<ChannelChange>& changes);

/// Signs, units, two that are exchanged, one drive that tells half or twice of what its wheel
/// turns: one change at a time; the first is none.
std::vector<ChannelChange> channel_changes(const ModelDescription& description);

/// All other orders of drives, of steerings and of whole wheels, of not more than five of a kind.
std::vector<ChannelChange> order_changes(const ModelDescription& description);

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

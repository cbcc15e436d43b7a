// Samples of one kind from one sensor, on their way to the updates: their order, what is late, what
// is dropped and counted.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viwo/api/rejections.hpp"
#include "viwo/estimator/declarations.hpp"
#include "viwo/filter/state_blocks.hpp"

namespace viwo {

class Stream {
 public:
  explicit Stream(SharedStream declared);

  const StreamSpec& spec() const { return declared_.spec; }
  /// Names of those who take the samples.
  const std::string& takers() const { return declared_.takers; }

  /// Takes a copy; what cannot be used is dropped and counted. `imu_ns`: newest stamp of the IMU,
  /// if there is one. std::invalid_argument for a sample of another kind.
  void add(SampleView sample, const StateBlocks& blocks, std::optional<std::int64_t> imu_ns,
           Rejections& rejections);
  /// No sample at or before it counts any more; those that have come are dropped and counted.
  void start_at(std::int64_t t_ns, const StateBlocks& blocks, Rejections& rejections);
  /// Drops, and counts, what no start looks at any more; `imu_ns` as in add().
  void forget_before_start(const StateBlocks& blocks, std::optional<std::int64_t> imu_ns,
                           Rejections& rejections);

  /// When an epoch ends for the first sample that waits, IMU clock; nothing for other streams.
  std::optional<std::int64_t> next_end_ns(const StateBlocks& blocks) const;
  /// How many of the samples that wait are of the instant `t_ns` of the IMU clock. Clocks of
  /// several channels do not agree to the nanosecond: kSameInstantNs.
  int waiting_at(std::int64_t t_ns, const StateBlocks& blocks) const;
  /// Whether samples are behind that instant, so that no more of it can come.
  bool is_past(std::int64_t t_ns) const { return newest_ns_ > t_ns + same_instant_ns(); }
  /// Whether samples reach that instant.
  bool reaches(std::int64_t t_ns, const StateBlocks& blocks) const;
  /// Largest stamp so far, IMU clock.
  std::int64_t newest_ns() const { return newest_ns_; }

  /// The epoch that ends at `t_ns` takes what has come up to then.
  void take(std::int64_t t_ns, const StateBlocks& blocks);
  /// What the epoch has: valid until forget().
  SampleSpan taken(Given given) const;
  /// All that is kept.
  SampleSpan all() const { return span(0, buffer_->size()); }
  /// Ends the epoch: what nobody will ask for any more.
  void forget(std::int64_t oldest_clone_ns, const StateBlocks& blocks);

 private:
  /// A sample, as far as its time goes.
  struct Arrival {
    SampleExtent extent;  ///< stamps
    int channel = 0;
    std::int64_t t_ns = 0;  ///< IMU clock, as it was known when it came
  };
  SampleSpan span(std::size_t first, std::size_t last) const;
  /// By how much the samples of one instant may differ.
  std::int64_t same_instant_ns() const {
    return spec().ends_epochs && spec().per_instant > 1 ? kSameInstantNs : 0;
  }
  std::optional<Arrival>* last_of(int channel);
  std::int64_t offset_ns(int channel, const StateBlocks& blocks) const;
  /// Time of a sample in the clock of the IMU.
  std::int64_t imu_time_ns(std::size_t i, const StateBlocks& blocks) const;
  bool is_of_taken_channel(std::size_t i) const;
  /// Why a sample that has values to be used comes at the wrong time; nullptr: it does not.
  const char* objection(const Arrival& arrival, const StateBlocks& blocks,
                        std::optional<std::int64_t> imu_ns);
  /// What came before there was an IMU, with stamps that are not of its clock: all that follow
  /// would be late.
  void forget_other_clock(std::int64_t imu_ns, Rejections& rejections);
  void reject(const char* what, std::int64_t t_ns, Rejections& rejections);

  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();

  SharedStream declared_;
  std::unique_ptr<SampleBuffer> buffer_;
  std::size_t taken_from_ = 0, taken_to_ = 0;  // of the epoch at hand
  std::optional<Arrival> last_;
  std::vector<std::optional<Arrival>> last_of_;  // by channel
  std::string reason_;                           // for rejections; its storage is used again
  // IMU clock:
  std::int64_t newest_ns_ = kNever;
  std::int64_t epoch_ns_ = kNever;    // end of the last one
  std::int64_t instant_ns_ = kNever;  // the last one that was taken
  std::int64_t start_ns_ = kNever;
};

}  // namespace viwo

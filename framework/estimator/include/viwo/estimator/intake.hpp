// What was measured and waits for a start, or for the epoch that it belongs to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "viwo/estimator/declarations.hpp"
#include "viwo/estimator/epoch_schedule.hpp"
#include "viwo/estimator/imu_buffer.hpp"
#include "viwo/estimator/start_search.hpp"
#include "viwo/estimator/stream.hpp"

namespace viwo {

/// `blocks` of its methods: the clocks as they are known now.
class Intake {
 public:
  Intake(const DeclarationTable& declared, const ImuLimits& limits);

  std::span<const Stream> streams() const { return streams_; }
  const Rejections& rejections() const { return rejections_; }

  void add(const ImuSample& sample) { imu_.add(sample, rejections_); }
  void add(std::size_t stream, SampleView sample, const StateBlocks& blocks);
  /// No further measurement will come.
  void finish();
  /// ImuBuffer::set_back_s().
  double set_back_s() const { return imu_.set_back_s(); }
  /// ImuBuffer::silent_s().
  double silent_s(std::int64_t t_ns) const { return imu_.silent_s(t_ns); }

  /// Lets a search look at all that there is.
  std::optional<ImuPrior> find_start(StartSearch& search, const StateBlocks& blocks);
  /// No sample at or before it counts any more.
  void start_at(std::int64_t t_ns, const StateBlocks& blocks);

  /// The end of the epoch that begins at `begin_ns`; nothing as long as there is something to wait
  /// for.
  std::optional<std::int64_t> next_epoch_ns(const ScheduleOptions& options, std::int64_t begin_ns,
                                            const StateBlocks& blocks) const;
  /// What an epoch has; valid until forget().
  EpochData take(std::int64_t begin_ns, std::int64_t end_ns, const StateBlocks& blocks);
  /// ImuBuffer::gaps_s() of the epoch.
  std::span<const double> gaps_s() const { return imu_.gaps_s(); }
  /// Ends the epoch: what nobody will ask for any more.
  void forget(std::int64_t end_ns, std::int64_t oldest_clone_ns, const StateBlocks& blocks);

 private:
  std::optional<std::int64_t> newest_imu_ns() const;

  std::vector<DeclarationTable::Taken> takers_;  ///< by StreamId::index
  std::vector<SampleSpan> taken_;                ///< likewise: what EpochData and StartData show
  std::vector<Stream> streams_;
  ImuBuffer imu_;
  Rejections rejections_;
  bool finished_ = false;
};

}  // namespace viwo

// Runs the updates of an epoch: calls them, applies their factors, lets them settle their blocks,
// and goes on without those that fail.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/rejections.hpp"
#include "viwo/api/update.hpp"
#include "viwo/estimator/declarations.hpp"
#include "viwo/estimator/excitation_monitor.hpp"
#include "viwo/filter/filter.hpp"

namespace viwo {

/// How often an update's factors, or the measurements in them, were applied and rejected.
struct UpdateCounts {
  std::int64_t applied = 0;
  std::int64_t rejected = 0;
};

/// How an update failed while the filter ran: what it threw was caught, its epochs were skipped.
struct UpdateFailures {
  std::int64_t count = 0;
  bool disabled = false;  ///< too many, or against the contract: it is not called any more
  std::string cause;      ///< what it threw first
};

/// An update that threw where that ends the run: at its start, or in an analysis (frozen) that
/// would be wrong without it. The estimator is unusable after it.
class UpdateFailure : public std::runtime_error {
 public:
  UpdateFailure(const std::string& update, const std::string& text)
      : std::runtime_error("update '" + update + "' failed: " + text) {}
};

/// Watches an estimator at work; called from step(), in this order.
class EstimatorObserver {
 public:
  virtual ~EstimatorObserver() = default;
  /// The filter begins.
  virtual void on_start(const Filter& /*filter*/, const ImuPrior& /*prior*/) {}
  /// The inertial state has moved by `transition`.
  virtual void on_propagated(const Filter& /*filter*/, const ImuTransition& /*transition*/) {}
  /// And its newest clone exists.
  virtual void on_clone(const Filter& /*filter*/, const ImuMatrix& /*Phi*/) {}
  /// Before a factor of an update is applied; with its residual also where that is taken as zero.
  virtual void on_factor(const Filter& /*filter*/, const UpdateEntry& /*update*/,
                         const ResidualFactor& /*factor*/) {}
  virtual void on_factor(const Filter& /*filter*/, const UpdateEntry& /*update*/,
                         const InformationFactor& /*factor*/) {}
  /// An update is about to drop a block of a room.
  virtual void on_drop(const Filter& /*filter*/, BlockId /*block*/) {}
  /// All updates of an epoch are done; before the oldest clone is dropped. `data` has the IMU, and
  /// the streams by StreamId::index.
  virtual void on_epoch(const Filter& /*filter*/, const EpochData& /*data*/) {}
};

struct RunnerOptions {
  /// Residuals are taken as zero: the estimate is only propagated, its covariance is that of a
  /// filter. For analyses along a motion that is known.
  bool frozen = false;
  /// Rooms of more than one block are always full: crowds (landmarks) can be done without.
  bool no_crowds = false;
  /// An update that has thrown this often is turned off; at least 1.
  int max_update_failures = 10;
};

class UpdateRunner {
 public:
  /// Starts the updates. InputError when one of them cannot work with this configuration,
  /// UpdateFailure for anything else that one throws.
  UpdateRunner(const RunnerOptions& options, std::vector<UpdateEntry> updates,
               const DeclarationTable& declared, const Filter& filter);

  void observe(EstimatorObserver* observer) { observer_ = observer; }
  EstimatorObserver* observer() const { return observer_; }

  /// One update of an epoch. `monitors` are told of its factors.
  void run(std::size_t index, const EpochData& data, Filter& filter,
           std::vector<ExcitationMonitor>& monitors);

  std::span<const UpdateEntry> updates() const { return updates_; }
  std::span<const UpdateCounts> counts() const { return counts_; }
  std::span<const UpdateFailures> failures() const { return failures_; }
  /// What updates did not use, with their names in front; appended to `out`.
  void rejections(std::vector<RejectionCount>& out) const;
  /// Noises that updates have found, "UPDATE.NAME"; appended to `out`.
  void noises(std::vector<NoiseFound>& out) const;

 private:
  struct Context;
  template <class Work>
  bool call(std::size_t index, Work&& work);
  bool open_rooms(std::size_t index, const StateBlocks& blocks);
  EpochData data_of(std::size_t index, const EpochData& data);
  void apply_residuals(const Context& context);
  void apply_information(const Context& context);
  template <class Factor>
  void tell(const Context& context, const Factor& factor);
  template <class Factor>
  FactorResult apply(const Context& context, Factor& factor);
  void settle(const Context& context);

  RunnerOptions options_;
  std::vector<UpdateEntry> updates_;
  std::vector<UpdateCounts> counts_;
  std::vector<UpdateFailures> failures_;
  /// What the host dropped of an update; counted without allocating.
  struct Dropped {
    std::int64_t count = 0;
    std::int64_t first_ns = 0;
    void add(std::int64_t t_ns) {
      if (count++ == 0) first_ns = t_ns;
    }
    void append_to(const char* reason, std::vector<RejectionCount>& out) const {
      if (count > 0) out.push_back({reason, count, stamp_text(first_ns)});
    }
  };
  std::vector<Dropped> gated_;        ///< residual factors, by the chi-square gate
  std::vector<Dropped> weakened_;     ///< the same with heavy tails
  std::vector<Rejections> rejected_;  ///< by the host: factors that are none
  std::vector<std::size_t> room_owners_;
  std::vector<std::size_t> stream_takers_;  ///< updates, by StreamId::index
  std::vector<SampleSpan> own_streams_;     ///< of the update at hand
  FactorSink sink_;
  // Factors of one call are linearised at one estimate: what those before them have corrected, and
  // room for a factor with that taken off.
  bool has_moved_ = false;
  Eigen::VectorXd moved_;
  ResidualFactor residual_factor_;
  InformationFactor information_factor_;
  EstimatorObserver* observer_ = nullptr;
};

}  // namespace viwo

// The host of the updates: takes measurements as they come, and at every image propagates, clones,
// lets each update emit its factors, applies them, and drops the oldest clone.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "viwo/api/update.hpp"
#include "viwo/filter/excitation_monitor.hpp"
#include "viwo/filter/filter.hpp"
#include "viwo/filter/start_attempt.hpp"

namespace viwo {

struct EstimatorOptions {
  FilterOptions filter;
  /// Begin with a window of three clones that grows by one every third epoch. Were the window full
  /// before the first tracks are used, the IMU alone would have carried a start that is a little
  /// wrong for more than a second, and tracks of near points would be linearised centimetres off.
  /// A start that is right is better off with the whole window: short ones lose yaw for good.
  bool growing_window = true;
  /// Without an image for this long an epoch is made without one.
  double max_epoch_s = 0.25;
  /// How long (in stamps) an epoch waits for encoder samples that reach its end.
  double max_wait_s = 0.2;
  /// Measurements come in the order of their arrival and not of their stamps: how long (in stamps)
  /// an epoch waits for the images of the other cameras, s. 0: in the order of their stamps.
  double max_image_wait_s = 0.;
  /// Longer spacings of the IMU are counted.
  double max_imu_gap_s = 0.05;
  /// Residuals are taken as zero: the estimate is only propagated, its covariance is that of a
  /// filter. For analyses along a motion that is known.
  bool frozen = false;
  /// An update that has thrown this often is turned off; at least 1.
  int max_update_failures = 10;
  MonitorOptions monitor;
};

/// An update as the estimator runs it. For kind kWheels: `wheels` is the index of its wheel set;
/// for kPoses: `poses` is the index of its stream of poses, as in add(). Streams are counted from
/// 0.
struct UpdateEntry {
  std::string name;
  std::shared_ptr<Update> update;
  int wheels = -1;
  int poses = -1;
};

/// How often an update's factors, or the measurements in them, were applied and rejected.
struct UpdateCounts {
  std::int64_t applied = 0;
  std::int64_t rejected = 0;
};

/// How an update failed while the filter ran: what it threw was caught, its epochs were skipped.
struct UpdateFailures {
  std::int64_t count = 0;
  bool disabled = false;  ///< too many: it is not called any more
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
  /// The inertial state has moved by `Phi` and its newest clone exists.
  virtual void on_clone(const Filter& /*filter*/, const ImuMatrix& /*Phi*/) {}
  /// Before a factor of an update is applied.
  virtual void on_factor(const Filter& /*filter*/, const UpdateEntry& /*update*/,
                         const ResidualFactor& /*factor*/) {}
  virtual void on_factor(const Filter& /*filter*/, const UpdateEntry& /*update*/,
                         const InformationFactor& /*factor*/) {}
  /// All updates of an epoch are done; before the oldest clone is dropped.
  virtual void on_epoch(const Filter& /*filter*/, const EpochData& /*data*/) {}
};

/// Finds a state to start from, given everything that was measured so far, or says why not yet.
/// Asked at most every 50 ms of the IMU's stamps, and once when no further measurement will come.
using Initializer = std::function<StartAttempt(
    std::span<const ImuSample> imu, std::span<const std::vector<EncoderSample>> encoders)>;

/// In how many attempts something was in the way of a start.
struct StartObstacle {
  std::string_view text;
  std::int64_t count = 0;
};

class Estimator {
 public:
  /// Starts the updates (InputError when one of them cannot work with this configuration,
  /// UpdateFailure for anything else that one throws).
  Estimator(const EstimatorOptions& options, std::vector<CameraPrior> cameras,
            std::vector<WheelsPrior> wheels, std::vector<UpdateEntry> updates);

  /// Where to start: a state, or a way to find one.
  void start(const ImuPrior& prior);
  void start(Initializer initializer) { initializer_ = std::move(initializer); }

  /// Whom to tell what happens; nullptr: nobody. It must outlive the calls of step().
  void observe(EstimatorObserver* observer) { observer_ = observer; }

  /// Measurements of one kind must come in time order; others are counted and dropped, as are
  /// values that are not finite, images and poses before the start, and images and encoder samples
  /// more than ten seconds ahead of the IMU.
  void add(const ImuSample& sample);
  void add(const FeatureSample& image);
  void add(const EncoderSample& sample, int wheels);
  void add(const PoseSample& pose, int stream);
  /// No further measurement will come: what waits for others is done without them.
  void finish() { finished_ = true; }

  /// Runs one epoch when the measurements suffice, else returns false. Throws what a kinematic
  /// model has thrown (PluginFailure): without its wheels there is nothing to go on with. What an
  /// update throws is counted in failures(), unless the estimator is frozen: then it is an
  /// UpdateFailure.
  bool step();
  /// Why the filter cannot go on (it has diverged); empty as long as it can.
  const std::string& failure() const { return failure_; }
  /// What every attempt to start has met so far, in the order of their first times.
  std::span<const StartObstacle> start_obstacles() const { return start_obstacles_; }

  const Filter& filter() const { return filter_; }
  std::span<const UpdateEntry> updates() const { return updates_; }
  std::span<const UpdateCounts> counts() const { return counts_; }
  std::span<const UpdateFailures> failures() const { return failures_; }
  std::vector<RejectionCount> rejections() const;
  std::int64_t epochs() const { return epochs_; }
  /// One for each wheel set of which something is estimated; none if they are turned off.
  std::span<const ExcitationMonitor> monitors() const { return monitors_; }

  /// Stages of an epoch: "propagate", the updates, "marginalise".
  std::vector<std::string> stage_names() const;
  /// CPU time of the thread that each stage of the last epoch took, ms.
  std::span<const double> stage_ms() const { return stage_ms_; }

 private:
  /// Poses of one sensor; nothing waits for them.
  struct PoseStream {
    void take(std::int64_t t_ns);     ///< those up to then
    std::vector<PoseSample> waiting;  // in time order
    std::vector<PoseSample> taken;    // of the present epoch
    std::int64_t last_ns = std::numeric_limits<std::int64_t>::min();
  };

  bool far_ahead(std::int64_t t_ns) const;
  std::optional<std::int64_t> next_epoch_ns() const;
  bool encoders_reach(std::int64_t t_ns) const;
  /// Whether no further image of an epoch's instant is to be expected.
  bool images_arrived(std::int64_t t_ns) const;
  void cut_imu(std::int64_t end_ns);
  void take_images(std::int64_t t_ns);
  void forget_used();
  /// Count what came for nothing up to then.
  void drop_images(std::int64_t t_ns);
  void drop_poses(PoseStream& stream, std::int64_t t_ns);
  /// Whether there is enough new since the last attempt to start, or nothing more to wait for.
  bool attempt_is_due();
  bool try_to_initialize();
  /// A base that waits for hours before it moves: what no start looks at any more.
  void forget_before_start();
  static void start_update(const UpdateEntry& entry, const UpdateSetup& setup);
  bool call_update(std::size_t index, const EpochData& data);
  void run_update(std::size_t index, const EpochData& data);
  template <class Factor>
  FactorResult apply(const UpdateEntry& update, const Factor& factor);
  void update_monitors();
  void reject(const char* reason, std::int64_t t_ns);

  EstimatorOptions options_;
  Filter filter_;
  std::vector<UpdateEntry> updates_;
  std::vector<UpdateCounts> counts_;
  /// Residual factors that the gate dropped, by update: how many, and the time of the first.
  struct Gated {
    std::int64_t count = 0;
    std::int64_t first_ns = 0;
  };
  std::vector<Gated> gated_;
  std::vector<UpdateFailures> failures_;
  FactorSink sink_;
  // Factors of one call are linearised at one estimate: what those before them have corrected, and
  // room for a factor with that taken off.
  Eigen::VectorXd moved_;
  ResidualFactor residual_factor_;
  InformationFactor information_factor_;
  Initializer initializer_;
  std::vector<StartObstacle> start_obstacles_;
  std::int64_t next_attempt_ns_ = std::numeric_limits<std::int64_t>::min();
  bool attempted_at_end_ = false;
  std::int64_t start_ns_ = std::numeric_limits<std::int64_t>::min();
  EstimatorObserver* observer_ = nullptr;
  std::vector<ExcitationMonitor> monitors_;
  std::vector<std::size_t> monitored_;  // wheel set of each

  std::vector<ImuSample> imu_;                        // from the last epoch on
  std::vector<std::vector<EncoderSample>> encoders_;  // from the oldest clone on, per wheel set
  std::vector<FeatureSample> waiting_;                // images, in time order; spare ones behind
  std::size_t n_waiting_ = 0;
  std::vector<FeatureSample> images_;  // of the present epoch; spare ones behind
  std::size_t n_images_ = 0;
  std::vector<PoseStream> poses_;
  std::vector<ImuSample> cut_;  // IMU of the present epoch, interpolated at its ends
  std::int64_t latest_ns_ = 0;  // largest stamp of IMU and images: wheels have their own clock
  bool finished_ = false;
  std::string failure_;
  std::int64_t epochs_ = 0;
  std::vector<double> stage_ms_;
  std::vector<RejectionCount> rejections_;
};

}  // namespace viwo

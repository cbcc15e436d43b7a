// The host of the updates: takes measurements as they come, and at every instant of a stream that
// ends epochs propagates, clones, lets each update emit its factors, applies them, and drops the
// oldest clone.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/update.hpp"
#include "viwo/estimator/contact.hpp"
#include "viwo/estimator/declarations.hpp"
#include "viwo/estimator/excitation_monitor.hpp"
#include "viwo/estimator/intake.hpp"
#include "viwo/estimator/start_search.hpp"
#include "viwo/estimator/update_runner.hpp"
#include "viwo/filter/filter.hpp"
#include "viwo/filter/health.hpp"

namespace viwo {

/// What is known from before where a filter begins anew.
struct Continuation {
  /// Block and its numbers, as in BlockSpec::value, instead of those that are declared. Priors are
  /// as declared, too.
  std::vector<std::pair<std::string, std::vector<double>>> blocks;
  /// Where the IMU was: a start that is found is turned about the vertical and moved there.
  struct Place {
    Eigen::Matrix3d R_GtoI = Eigen::Matrix3d::Identity();
    Eigen::Vector3d p_IinG = Eigen::Vector3d::Zero();
    std::int64_t t_ns = 0;  ///< when; by the start it may have gone on
    double speed_m_per_s = 0.;
  };
  std::optional<Place> place;
};

/// The state of the IMU at each epoch, as somebody knows it.
struct GivenPath {
  struct Epoch {
    std::int64_t t_ns = 0;
    ImuState state;
  };
  std::vector<Epoch> epochs;
};

struct EstimatorOptions {
  FilterOptions filter;
  ScheduleOptions schedule;
  RunnerOptions runner;
  MonitorOptions monitor;
  /// Begin with a window of three clones that grows by one every third epoch. Were the window full
  /// before the first tracks are used, the IMU alone would have carried a start that is a little
  /// wrong for more than a second, and tracks of near points would be linearised centimetres off.
  /// A start that is right is better off with the whole window: short ones lose yaw for good.
  bool growing_window = true;
  ImuLimits imu;
  HealthLimits health;
  Continuation continuation;
  /// The estimate of each epoch is the given one, moved to its time, with RunnerOptions::frozen:
  /// the covariance is that of a filter that is linearised there.
  std::shared_ptr<const GivenPath> along;
};

/// `prior`, turned about the vertical so that its R_GtoI is as near as it gets to that of `place`,
/// and from there.
ImuPrior moved_to(const Continuation::Place& place, ImuPrior prior);

/// A stream that somebody else than an update wants, for a start.
struct ExtraStream {
  StreamSpec spec;
  std::string taker;
};

class Estimator {
 public:
  /// Lets the updates declare what they work with, and starts them. InputError when one of them
  /// cannot work with this configuration or two of them contradict each other, UpdateFailure for
  /// anything else that one throws. `extra`: taken by nobody but the Initializer.
  Estimator(const EstimatorOptions& options, std::vector<UpdateEntry> updates,
            const std::vector<ExtraStream>& extra = {});

  /// Where to start: a state, or a way to find one.
  void start(const ImuPrior& prior);
  void start(Initializer initializer) { search_.set(std::move(initializer)); }

  /// Whom to tell what happens; nullptr: nobody. It must outlive the calls of step().
  void observe(EstimatorObserver* observer) { runner_.observe(observer); }

  /// What the updates take, each stream once: sensors are to give it to add().
  std::span<const Stream> streams() const { return intake_.streams(); }
  /// Which stream of StartData is the extra one number `i`.
  StreamId extra(std::size_t i) const { return {static_cast<int>(first_extra_ + i)}; }
  /// Measurements of one stream must come in time order; others are counted and dropped, as are
  /// values that cannot be used, what comes before the start, and what is more than ten seconds
  /// ahead of the IMU.
  void add(const ImuSample& sample) { intake_.add(sample); }
  void add(std::size_t stream, SampleView sample) { intake_.add(stream, sample, filter_.blocks()); }
  /// No further measurement will come: what waits for others is done without them.
  void finish() { intake_.finish(); }

  /// Runs one epoch when the measurements suffice, else returns false. Throws what a kinematic
  /// model has thrown (PluginFailure): without its wheels there is nothing to go on with. What an
  /// update throws is counted in failures(), unless the estimator is frozen: then it is an
  /// UpdateFailure.
  bool step();
  /// Why the filter cannot go on (it has diverged); empty as long as it can.
  const std::string& failure() const { return failure_; }
  std::span<const StartObstacle> start_obstacles() const { return search_.obstacles(); }

  const Filter& filter() const { return filter_; }
  std::span<const UpdateEntry> updates() const { return runner_.updates(); }
  std::span<const UpdateCounts> counts() const { return runner_.counts(); }
  std::span<const UpdateFailures> failures() const { return runner_.failures(); }
  std::vector<RejectionCount> rejections() const;
  /// Noises that updates have found, "UPDATE.NAME".
  std::vector<NoiseFound> noises() const;
  std::int64_t epochs() const { return epochs_; }
  /// One for each group of blocks of which something is estimated; none if they are turned off.
  std::span<const ExcitationMonitor> monitors() const { return monitors_; }
  /// How often, and when first, the estimate was loosened because all that is measured contradicted
  /// it.
  const Contact& contact() const { return contact_; }

  /// Stages of an epoch: "propagate", the updates, "marginalise".
  std::vector<std::string> stage_names() const;
  /// CPU time of the thread that each stage of the last epoch took, ms.
  std::span<const double> stage_ms() const { return stage_ms_; }

 private:
  Estimator(const EstimatorOptions& options, std::vector<UpdateEntry> updates, std::size_t n_extra,
            DeclarationTable declared);
  /// The last one of more than a second that was bridged.
  struct Silence {
    double duration_s = 0.;
    std::int64_t end_ns = std::numeric_limits<std::int64_t>::min();
    double in_all_s = 0.;  ///< with those before
  };

  bool find_start();
  void listen();
  std::string cause_of_failure() const;
  void propagate(const EpochData& data);
  void follow(const GivenPath& path, const ImuSample& sample);
  void watch(const EpochData& data);

  EstimatorOptions options_;
  DeclarationTable declared_;
  Filter filter_;
  UpdateRunner runner_;
  std::size_t first_extra_;
  StartSearch search_;
  Intake intake_;
  std::vector<ExcitationMonitor> monitors_;
  Contact contact_;
  std::string failure_;
  Silence silence_;
  std::int64_t start_ns_ = 0;
  std::int64_t epochs_ = 0;
  std::vector<double> stage_ms_;
};

}  // namespace viwo

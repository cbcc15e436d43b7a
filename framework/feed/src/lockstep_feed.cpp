// Live sensors that are played in step. What the estimator is given, and in which order, is what it
// would be given of the same measurements recorded: see RecordedFeed.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "in_order.hpp"
#include "live_samples.hpp"
#include "played_sensor.hpp"
#include "viwo/feed/estimate_sample.hpp"
#include "viwo/feed/feed.hpp"

namespace viwo {
namespace {

/// Poses of a reference that are kept: those of a recording would be, too.
constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

class LockstepFeed final : public Feed {
 public:
  LockstepFeed(const RunSetup& setup, const RunData& data, const FeedHooks& hooks,
               Plausibility& plausibility)
      : setup_(setup), hooks_(hooks), plausibility_(plausibility), samples_(setup, kAll) {
    for (const SensorStream& stream : data.live) {
      played_.push_back(std::make_unique<PlayedSensor>(setup, stream, data.streams, hooks));
    }
    streams_ = std::make_unique<ReadAhead>(setup, data.streams, plausibility);
  }
  ~LockstepFeed() override { stop(); }  // before those who wait for their images

  bool next(Estimator& estimator) override {
    const bool any = !instant_.empty() || read_instant();
    const auto instant_ns =
        any ? std::optional(stamp_ns(instant_.front().measurement)) : std::nullopt;
    if (streams_->give_before(instant_ns, estimator)) return true;
    // An interruption is for the run to say.
    if (!any) return hooks_.interrupted && hooks_.interrupted();
    const Given given = std::move(instant_.front());
    instant_.pop_front();
    give(given.from->stream().name, given.measurement.view(), estimator);
    return true;
  }

  void on_epoch(const Estimator& estimator, int piece,
                const std::vector<std::string>& warnings) override {
    const EstimateSample sample = estimate_sample(estimator.filter(), piece, warnings);
    for (const auto& played : played_) {
      const SensorStream& stream = played->stream();
      guarded(stream.info, "estimate", [&] { stream.sensor->estimate(sample); });
    }
  }

  FeedReport finish() override {
    FeedReport report;
    stop();
    streams_->finish(report);
    samples_.finish(report);
    for (const auto& played : played_) {
      if (!played->not_stopped().empty()) report.warnings.push_back(played->not_stopped());
      std::vector<RejectionCount> all;
      const SensorStream& stream = played->stream();
      guarded(stream.info, "rejections", [&] { stream.sensor->rejections(all); });
      for (RejectionCount& one : all) report.rejections.emplace_back(stream.name, std::move(one));
    }
    return report;
  }

 private:
  struct Given {
    PlayedSensor* from;
    Measurement measurement;
    Rank rank;
  };

  void stop() {
    for (const auto& played : played_) played->stop();
  }

  /// All that has the earliest stamp, in the order of ranks. False at the end.
  bool read_instant() {
    std::optional<std::int64_t> t_ns;
    for (const auto& played : played_) {
      const Measurement* const head = played->head();
      if (head != nullptr && (!t_ns || stamp_ns(*head) < *t_ns)) t_ns = stamp_ns(*head);
    }
    if (!t_ns) return false;
    for (const auto& played : played_) {
      for (Measurement* head = played->head(); head != nullptr && stamp_ns(*head) == *t_ns;
           head = played->head()) {
        const Rank rank = routes_of(played->stream().name, head->view().type()).rank;
        instant_.push_back({played.get(), std::move(*head), rank});
        played->pop();
      }
    }
    std::stable_sort(instant_.begin(), instant_.end(),
                     [](const Given& a, const Given& b) { return a.rank < b.rank; });
    return true;
  }

  const EstimatorRoutes& routes_of(const std::string& sensor, const SampleType& type) {
    for (const Known& known : known_) {
      if (*known.type == type && known.sensor == sensor) return known.routes;
    }
    known_.push_back({sensor, &type, {setup_, sensor, type}});
    return known_.back().routes;
  }

  void give(const std::string& sensor, SampleView sample, Estimator& estimator) {
    samples_.note(sensor, sample);
    const EstimatorRoutes& routes = routes_of(sensor, sample.type());
    if (routes.routes.empty()) return;
    plausibility_.add(sensor, sample);
    routes.give(sample, estimator);
  }

  struct Known {
    std::string sensor;
    const SampleType* type;
    EstimatorRoutes routes;
  };

  const RunSetup& setup_;
  const FeedHooks& hooks_;
  Plausibility& plausibility_;
  std::vector<std::unique_ptr<PlayedSensor>> played_;
  std::unique_ptr<ReadAhead> streams_;
  std::deque<Given> instant_;
  std::deque<Known> known_;
  LiveSamples samples_;
};

}  // namespace

std::unique_ptr<Feed> feed_in_step(const RunSetup& setup, const RunData& data,
                                   const FeedHooks& hooks, Plausibility& plausibility) {
  return std::make_unique<LockstepFeed>(setup, data, hooks, plausibility);
}

}  // namespace viwo

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "feed.hpp"
#include "stream.hpp"

namespace viwo {
namespace {

class RecordedFeed final : public Feed {
 public:
  RecordedFeed(const RunSetup& setup, const RunData& data, Plausibility& plausibility)
      : setup_(setup), data_(data), plausibility_(plausibility) {
    for (const Recorded::Track& track : data.recorded.tracks()) {
      Head head{&track, {}, 0, kFirst};
      setup.routes.dispatch(track.sensor, track.samples->type(), [&](const Route& route) {
        if (route.consumer != Consumer::kImu && route.consumer != Consumer::kStream) return;
        head.routes.push_back(route);
        head.rank = std::max(head.rank, rank_of(route));
      });
      if (!head.routes.empty()) heads_.push_back(std::move(head));
    }
    std::stable_sort(heads_.begin(), heads_.end(),
                     [](const Head& a, const Head& b) { return a.rank < b.rank; });
    for (const SensorStream& stream : data.streams) {
      streams_.push_back(std::make_unique<Prefetch>(stream));
    }
  }

  bool next(Estimator& estimator) override {
    Head* first = nullptr;
    for (Head& head : heads_) {
      if (head.is_at_end()) continue;
      if (first == nullptr || head.t_ns() < first->t_ns()) first = &head;
    }
    for (const auto& stream : streams_) {
      const Measurement* head = stream->head();
      if (head == nullptr || !is_first(*stream)) continue;
      // Behind what was recorded at the same stamp.
      if (first != nullptr && first->t_ns() <= stamp_ns(*head)) continue;
      give_streamed(*stream, estimator);
      return true;
    }
    if (first == nullptr) return false;
    const SampleView sample = first->track->samples->view(first->next++);
    plausibility_.add(first->track->sensor, sample);
    for (const Route& route : first->routes) give(route, sample, estimator);
    return true;
  }

  void finish(RunResult& result) override {
    result.reference = data_.reference;
    for (const auto& stream : streams_) {
      stream->stop();
      // Not part of the time of an epoch: it passes beside it.
      result.stages.emplace_back("sensor " + stream->name(), stage_time(stream->ms_per_stamp()));
      for (RejectionCount& rejection : stream->rejections()) {
        result.rejections.emplace_back(stream->name(), std::move(rejection));
      }
    }
  }

 private:
  /// Of what has one stamp: what nothing waits for, then the IMU, what epochs wait for, and what
  /// ends them.
  enum Rank { kFirst, kImu, kAwaited, kEndsEpochs };

  /// What a sensor gave of one kind, and how far it has been given on.
  struct Head {
    const Recorded::Track* track;
    std::vector<Route> routes;
    std::size_t next;
    Rank rank;
    bool is_at_end() const { return next == track->samples->size(); }
    std::int64_t t_ns() const { return track->samples->extent(next).t_ns; }
  };

  Rank rank_of(const Route& route) const {
    if (route.consumer == Consumer::kImu) return kImu;
    const StreamSpec& spec = setup_.filter->streams[route.stream].spec;
    return spec.ends_epochs ? kEndsEpochs : spec.awaited ? kAwaited : kFirst;
  }

  static void give(const Route& route, SampleView sample, Estimator& estimator) {
    if (route.consumer == Consumer::kImu) estimator.add(*sample.get_if<ImuSample>());
    if (route.consumer == Consumer::kStream) estimator.add(route.stream, sample);
  }

  /// Whether no other stream has an earlier stamp.
  bool is_first(Prefetch& stream) const {
    const std::int64_t t_ns = stamp_ns(*stream.head());
    return std::all_of(streams_.begin(), streams_.end(), [t_ns](const auto& other) {
      const Measurement* head = other->head();
      return head == nullptr || stamp_ns(*head) >= t_ns;
    });
  }

  void give_streamed(Prefetch& stream, Estimator& estimator) {
    const SampleView sample = stream.head()->view();
    plausibility_.add(stream.name(), sample);
    setup_.routes.dispatch(stream.name(), sample.type(),
                           [&](const Route& route) { give(route, sample, estimator); });
    stream.pop();
  }

  const RunSetup& setup_;
  const RunData& data_;
  Plausibility& plausibility_;
  std::vector<Head> heads_;  // by rank
  std::vector<std::unique_ptr<Prefetch>> streams_;
};

}  // namespace

std::unique_ptr<Feed> feed_recorded(const RunSetup& setup, const RunData& data,
                                    Plausibility& plausibility) {
  return std::make_unique<RecordedFeed>(setup, data, plausibility);
}

}  // namespace viwo

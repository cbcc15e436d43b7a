#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "in_order.hpp"
#include "viwo/feed/feed.hpp"

namespace viwo {
namespace {

class RecordedFeed final : public Feed {
 public:
  RecordedFeed(const RunSetup& setup, const RunData& data, Plausibility& plausibility)
      : data_(data), plausibility_(plausibility), streams_(setup, data.streams, plausibility) {
    for (const Recorded::Track& track : data.recorded.tracks()) {
      Head head{&track, {setup, track.sensor, track.samples->type()}, 0};
      if (!head.to.routes.empty()) heads_.push_back(std::move(head));
    }
    std::stable_sort(heads_.begin(), heads_.end(),
                     [](const Head& a, const Head& b) { return a.to.rank < b.to.rank; });
  }

  bool next(Estimator& estimator) override {
    Head* first = nullptr;
    for (Head& head : heads_) {
      if (head.is_at_end()) continue;
      if (first == nullptr || head.t_ns() < first->t_ns()) first = &head;
    }
    const auto first_ns = first == nullptr ? std::nullopt : std::optional(first->t_ns());
    if (streams_.give_before(first_ns, estimator)) return true;
    if (first == nullptr) return false;
    const SampleView sample = first->track->samples->view(first->next++);
    plausibility_.add(first->track->sensor, sample);
    first->to.give(sample, estimator);
    return true;
  }

  FeedReport finish() override {
    FeedReport report;
    report.reference = data_.reference;
    streams_.finish(report);
    return report;
  }

 private:
  /// What a sensor gave of one kind, and how far it has been given on.
  struct Head {
    const Recorded::Track* track;
    EstimatorRoutes to;
    std::size_t next;
    bool is_at_end() const { return next == track->samples->size(); }
    std::int64_t t_ns() const { return track->samples->extent(next).t_ns; }
  };

  const RunData& data_;
  Plausibility& plausibility_;
  std::vector<Head> heads_;  // by rank
  ReadAhead streams_;
};

}  // namespace

std::unique_ptr<Feed> feed_recorded(const RunSetup& setup, const RunData& data,
                                    Plausibility& plausibility) {
  return std::make_unique<RecordedFeed>(setup, data, plausibility);
}

}  // namespace viwo

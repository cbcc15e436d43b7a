#include "in_order.hpp"

#include <algorithm>
#include <utility>

namespace viwo {
namespace {

Rank rank_of(const RunSetup& setup, const Route& route) {
  if (route.consumer == Consumer::kImu) return Rank::kImu;
  const StreamSpec& spec = setup.filter->streams[route.stream].spec;
  return spec.ends_epochs ? Rank::kEndsEpochs : spec.awaited ? Rank::kAwaited : Rank::kFirst;
}

void give_to(const Route& route, SampleView sample, Estimator& estimator) {
  if (route.consumer == Consumer::kImu) estimator.add(*sample.get_if<ImuSample>());
  if (route.consumer == Consumer::kStream) estimator.add(route.stream, sample);
}

}  // namespace

EstimatorRoutes::EstimatorRoutes(const RunSetup& setup, const std::string& sensor,
                                 const SampleType& type) {
  setup.routes.dispatch(sensor, type, [&](const Route& route) {
    if (route.consumer != Consumer::kImu && route.consumer != Consumer::kStream) return;
    routes.push_back(route);
    rank = std::max(rank, rank_of(setup, route));
  });
}

void EstimatorRoutes::give(SampleView sample, Estimator& estimator) const {
  for (const Route& route : routes) give_to(route, sample, estimator);
}

ReadAhead::ReadAhead(const RunSetup& setup, const std::vector<SensorStream>& streams,
                     Plausibility& plausibility)
    : setup_(setup), plausibility_(plausibility) {
  for (const SensorStream& stream : streams) {
    streams_.push_back(std::make_unique<Prefetch>(stream));
  }
}

bool ReadAhead::give_before(std::optional<std::int64_t> other_ns, Estimator& estimator) {
  Prefetch* first = nullptr;
  for (const auto& stream : streams_) {
    const Measurement* const head = stream->head();
    if (head == nullptr) continue;
    if (first == nullptr || stamp_ns(*head) < stamp_ns(*first->head())) first = stream.get();
  }
  // Behind what was recorded at the same stamp.
  if (first == nullptr || (other_ns && *other_ns <= stamp_ns(*first->head()))) return false;
  const SampleView sample = first->head()->view();
  plausibility_.add(first->name(), sample);
  setup_.routes.dispatch(first->name(), sample.type(),
                         [&](const Route& route) { give_to(route, sample, estimator); });
  first->pop();
  return true;
}

void ReadAhead::finish(FeedReport& report) {
  for (const auto& stream : streams_) {
    stream->stop();
    // Not part of the time of an epoch: it passes beside it.
    report.stages.emplace_back("sensor " + stream->name(), stage_time(stream->ms_per_stamp()));
    for (RejectionCount& rejection : stream->rejections()) {
      report.rejections.emplace_back(stream->name(), std::move(rejection));
    }
  }
}

}  // namespace viwo

#include "monitor_record.hpp"

#include <algorithm>

namespace viwo {

void record_monitors(const Estimator& estimator, double t_s, MonitorTrack& track) {
  const auto monitors = estimator.monitors();
  const bool any_news = std::any_of(monitors.begin(), monitors.end(),
                                    [](const auto& monitor) { return monitor.has_news(); });
  if (!any_news) return;
  const bool first = track.t_s.empty();
  std::size_t row = 0;
  for (const ExcitationMonitor& monitor : monitors) {
    for (std::size_t i = 0; i < monitor.parameters().size(); ++i, ++row) {
      if (first) {
        track.parameters.push_back(monitor.parameters()[i]);
        track.sigma_ratio.emplace_back();
      }
      track.sigma_ratio[row].push_back(monitor.sigma_ratio()[i]);
    }
    for (const ExcitationWarning& warning : monitor.warnings()) {
      constexpr std::size_t kMostWarnings = 1000;
      if (warning.t_ns != estimator.filter().t_ns()) continue;
      if (track.warnings.size() == kMostWarnings) continue;
      track.warnings.push_back({t_s, warning.text, warning.parameters});
    }
  }
  track.t_s.push_back(t_s);
  track.held.push_back(estimator.filter().held().size());
}

}  // namespace viwo

#include "running_warnings.hpp"

namespace viwo::experiment {

void RunningWarnings::say(double now_s, const Findings& findings, const RunHooks& hooks) {
  if (!hooks.on_warning) return;
  for (const Finding& finding : findings) {
    if (said_.insert(finding.key).second) hooks.on_warning(now_s, finding.text);
  }
}

void RunningWarnings::epoch(const RunResult& result, const Estimator& estimator,
                            const RunHooks& hooks) {
  if (!hooks.on_warning) return;
  const auto say = [&](const std::string& key, double t_s, const std::string& text) {
    if (said_.insert(key).second) hooks.on_warning(t_s, text);
  };
  const double now_s = result.epoch_t_s.back();
  for (; monitor_seen_ < result.monitor.warnings.size(); ++monitor_seen_) {
    const MonitorWarning& warning = result.monitor.warnings[monitor_seen_];
    say(warning.text, warning.t_s, warning.text);
  }
  if (estimator.contact().loosened() > 0) {
    say("contact", now_s,
        "all updates contradict the estimate: it is loosened - look for faults of the IMU, or of "
        "all that they measure");
  }
  for (const UpdateTrack& update : result.updates) {
    const std::string of = "update '" + update.name + "' ";
    if (update.failures.count == 0) continue;
    say(of, now_s, of + "failed: " + update.failures.cause);
    if (update.failures.disabled) say(of + "disabled", now_s, of + "is disabled");
  }
  for (const std::string& line : contradictions(result.updates)) {
    say("contradictions of " + line.substr(0, line.find(':')), now_s, line);
  }
}

}  // namespace viwo::experiment

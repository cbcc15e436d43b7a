#include "running_warnings.hpp"

#include <algorithm>

#include "viwo/run/warnings.hpp"

namespace viwo {
namespace {

constexpr double kLatest_s = 10.;

}  // namespace

void RunningWarnings::tell(double now_s, const std::string& text) {
  std::erase_if(latest_, [now_s](const Said& said) { return said.t_s < now_s - kLatest_s; });
  latest_.push_back({now_s, text});
  if (hooks_.on_warning) hooks_.on_warning(now_s, text);
}

void RunningWarnings::say_once(const std::string& key, double t_s, const std::string& text) {
  if (said_.insert(key).second) tell(t_s, text);
}

void RunningWarnings::say(double now_s, const Findings& findings) {
  found_.clear();
  for (const Finding& finding : findings) {
    say_once(finding.key, now_s, finding.text);
    if (!finding.is_over) found_.push_back(finding.text);
  }
}

/// Of what is suspicious when it is most, such as the samples of a wheel that the others
/// contradict: whether it was a fifth in the last second.
void RunningWarnings::look_at_rejections(double now_s, const Estimator& estimator) {
  constexpr double kPeriod_s = 1.;
  constexpr std::int64_t kFewest = 5;
  if (now_s < next_look_s_) return;
  next_look_s_ = now_s + kPeriod_s;
  left_out_.clear();
  for (const RejectionCount& r : estimator.rejections()) {
    if (r.of == 0) continue;
    Counts& before = rejected_[r.reason];
    const Counts since{r.count - before.count, r.of - before.of};
    before = {r.count, r.of};
    if (since.count < kFewest || 5 * since.count < since.of) continue;
    // Epochs that are lost late are counted in another second than the rest of theirs.
    left_out_.push_back(r.reason + " - " + std::to_string(since.count) + " of " +
                        std::to_string(std::max(since.of, since.count)) + " in the last second");
    say_once(r.reason, now_s, left_out_.back());
  }
}

void RunningWarnings::epoch(const RunResult& result, const Estimator& estimator) {
  const double now_s = result.epoch_t_s.back();
  for (; monitor_seen_ < result.monitor.warnings.size(); ++monitor_seen_) {
    const MonitorWarning& warning = result.monitor.warnings[monitor_seen_];
    say_once(warning.text, warning.t_s, warning.text);
  }
  if (estimator.contact().loosened() > 0) {
    say_once("contact", now_s,
             "all updates contradict the estimate: it is loosened - look for faults of the IMU, or "
             "of all that they measure");
  }
  for (const UpdateTrack& update : result.updates) {
    const std::string of = "update '" + update.name + "' ";
    if (update.failures.count == 0) continue;
    say_once(of, now_s, of + "failed: " + update.failures.cause);
    if (update.failures.disabled) say_once(of + "disabled", now_s, of + "is disabled");
  }
  for (const Contradiction& found : contradictions(result.updates)) {
    say_once("contradictions of " + found.update, now_s, found.text);
  }
  look_at_rejections(now_s, estimator);
}

std::vector<std::string> RunningWarnings::now(double now_s) const {
  std::vector<std::string> all = found_;
  all.insert(all.end(), left_out_.begin(), left_out_.end());
  for (const Said& said : latest_) {
    const bool lasts = std::find(all.begin(), all.end(), said.text) != all.end();
    if (said.t_s >= now_s - kLatest_s && !lasts) all.push_back(said.text);
  }
  return all;
}

}  // namespace viwo

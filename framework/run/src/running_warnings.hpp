// What is wrong with a run, said when it is first seen.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "viwo/plausibility/finding.hpp"
#include "viwo/run/run.hpp"

namespace viwo {

class RunningWarnings {
 public:
  explicit RunningWarnings(const RunHooks& hooks) : hooks_(hooks) {}

  /// After each epoch: tells hooks.on_warning what is new. Each thing is said once in a run.
  void epoch(const RunResult& result, const Estimator& estimator);
  /// The same of what is found in samples, `now_s` after the start of the run.
  void say(double now_s, const Findings& findings);
  /// Something that happens now, and may happen again.
  void tell(double now_s, const std::string& text);

  /// What is wrong by `now_s`: what lasts, and what was said in the last ten seconds.
  std::vector<std::string> now(double now_s) const;

 private:
  struct Said {
    double t_s = 0.;
    std::string text;
  };
  struct Counts {
    std::int64_t count = 0, of = 0;
  };
  void say_once(const std::string& key, double t_s, const std::string& text);
  void look_at_rejections(double now_s, const Estimator& estimator);

  const RunHooks& hooks_;
  std::set<std::string> said_;
  std::size_t monitor_seen_ = 0;               ///< of the monitor's warnings
  std::vector<Said> latest_;                   ///< of the last ten seconds
  std::vector<std::string> found_, left_out_;  ///< by now: in samples, by updates
  std::map<std::string, Counts> rejected_;     ///< by reason, at the last look
  double next_look_s_ = -std::numeric_limits<double>::infinity();
};

}  // namespace viwo

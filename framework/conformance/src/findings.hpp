// What a check writes its answer to, and the processes that checks run in.
#pragma once

#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "viwo/conformance/conformance.hpp"

namespace viwo::conformance {

/// Collects the answer of one check. Of many alike only the first few are kept.
class Findings {
 public:
  void fail(const std::string& text) { add(failures_, text); }
  void note(const std::string& text) { add(notes_, text); }
  /// Like note(), but shown without being asked for.
  void warn(const std::string& text) { add(warnings_, text); }
  /// The check cannot be made, and why.
  void skip(const std::string& why) { skipped_ = why; }
  const std::vector<std::string>& failures() const { return failures_; }
  const std::vector<std::string>& notes() const { return notes_; }
  const std::vector<std::string>& warnings() const { return warnings_; }
  const std::string& skipped() const { return skipped_; }

 private:
  static void add(std::vector<std::string>& to, const std::string& text) {
    constexpr std::size_t kMost = 12;
    if (to.size() < kMost) to.push_back(text);
    if (to.size() == kMost) to.back() = "and more of that kind";
  }

  std::vector<std::string> failures_;
  std::vector<std::string> notes_;
  std::vector<std::string> warnings_;
  std::string skipped_;
};

using Check = std::function<void(Findings&)>;

/// Runs `check` in a process of its own: a crash, an exception and too long a time are failures of
/// it, and nothing that the plugin does there is left behind.
CheckResult run_apart(const std::string& name, int time_limit_s, const Check& check);

/// "%.6g"
inline std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.6g", value);
  return text;
}

}  // namespace viwo::conformance

// Signals that ask the process to end wait.
#pragma once

namespace viwo::files {

/// As long as one of them lives, SIGINT, SIGTERM and SIGHUP are only remembered, whichever thread
/// they come to; with the last they do what they would have done. Those that are ignored (nohup)
/// stay ignored.
class DelayedSignals {
 public:
  DelayedSignals();
  ~DelayedSignals();
  DelayedSignals(const DelayedSignals&) = delete;
  DelayedSignals& operator=(const DelayedSignals&) = delete;
};

}  // namespace viwo::files

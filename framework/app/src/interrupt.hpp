// Signals that ask something long to end: remembered, instead of ending the process in the middle.
#pragma once

#include <array>
#include <csignal>

namespace viwo::app {

/// While it lives, the first SIGINT (ctrl-C), SIGTERM or SIGHUP is only remembered; the next one
/// ends the process as usual. A SIGHUP that is ignored (nohup) stays ignored. What was done about
/// them before is put back afterwards. At most one object at a time.
class InterruptSignal {
 public:
  InterruptSignal();
  ~InterruptSignal();
  InterruptSignal(const InterruptSignal&) = delete;
  InterruptSignal& operator=(const InterruptSignal&) = delete;

  /// Whether one of them has come. From any thread.
  bool raised() const;

 private:
  std::array<struct sigaction, 3> before_{};
};

}  // namespace viwo::app

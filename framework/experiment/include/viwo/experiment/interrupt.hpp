// Ctrl-C while something long runs: asked for, instead of ending the process in the middle.
#pragma once

#include <csignal>

namespace viwo::experiment {

/// While it lives, the first SIGINT is only remembered; a second one ends the process as usual.
/// What was done about SIGINT before is put back afterwards. At most one object at a time.
class InterruptSignal {
 public:
  InterruptSignal();
  ~InterruptSignal();
  InterruptSignal(const InterruptSignal&) = delete;
  InterruptSignal& operator=(const InterruptSignal&) = delete;

  /// Whether a SIGINT has come. From any thread.
  bool raised() const;

 private:
  struct sigaction before_ {};
};

}  // namespace viwo::experiment

// Of a child of a process: it ends in time, whatever it waits for.
#pragma once

#include <csignal>

#include <pthread.h>
#include <unistd.h>

namespace viwo::files {

/// SIGALRM ends this process after so many seconds. Whoever called may ignore or block it, which a
/// process inherits.
inline void end_after(unsigned seconds) {
  std::signal(SIGALRM, SIG_DFL);
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGALRM);
  pthread_sigmask(SIG_UNBLOCK, &ends, nullptr);
  ::alarm(seconds);
}

}  // namespace viwo::files

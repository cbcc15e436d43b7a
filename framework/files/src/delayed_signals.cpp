#include "viwo/files/delayed_signals.hpp"

#include <array>
#include <atomic>
#include <csignal>
#include <cstddef>
#include <mutex>

namespace viwo::files {
namespace {

constexpr std::array kDelayed{SIGINT, SIGTERM, SIGHUP};

std::array<std::atomic<bool>, kDelayed.size()> has_come;
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may not wait");

/// Several threads may write results at once: the first one changes what is done about signals, the
/// last one puts it back. A mask would be that of one thread, and any other takes the signal.
std::mutex delayed_mutex;
int delayed_by = 0;
std::array<struct sigaction, kDelayed.size()> done_before;

void note_signal(int number) {
  for (std::size_t i = 0; i < kDelayed.size(); ++i) {
    if (kDelayed[i] == number) has_come[i] = true;
  }
}

}  // namespace

DelayedSignals::DelayedSignals() {
  const std::scoped_lock lock(delayed_mutex);
  if (delayed_by++ > 0) return;
  struct sigaction action {};
  action.sa_handler = note_signal;
  sigemptyset(&action.sa_mask);
  action.sa_flags = static_cast<int>(SA_RESTART);
  for (std::size_t i = 0; i < kDelayed.size(); ++i) {
    has_come[i] = false;
    sigaction(kDelayed[i], nullptr, &done_before[i]);
    if (done_before[i].sa_handler != SIG_IGN) sigaction(kDelayed[i], &action, nullptr);
  }
}

DelayedSignals::~DelayedSignals() {
  const std::scoped_lock lock(delayed_mutex);
  if (--delayed_by > 0) return;
  for (std::size_t i = 0; i < kDelayed.size(); ++i)
    sigaction(kDelayed[i], &done_before[i], nullptr);
  for (std::size_t i = 0; i < kDelayed.size(); ++i) {
    if (has_come[i]) std::raise(kDelayed[i]);
  }
}

}  // namespace viwo::files

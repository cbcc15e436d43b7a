#include "interrupt.hpp"

#include <atomic>
#include <cstddef>
#include <tuple>

namespace viwo::app {
namespace {

constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP};

std::atomic<bool> interrupt_raised = false;
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may not wait");

/// The next one, of whichever kind, ends the process.
void note_interrupt(int) {
  interrupt_raised = true;
  for (const int number : kSignals) {
    struct sigaction present {};
    sigaction(number, nullptr, &present);
    if (present.sa_handler != note_interrupt) continue;
    present.sa_handler = SIG_DFL;
    sigaction(number, &present, nullptr);
  }
}

}  // namespace

InterruptSignal::InterruptSignal() {
  static_assert(kSignals.size() == std::tuple_size_v<decltype(before_)>);
  interrupt_raised = false;
  struct sigaction action {};
  action.sa_handler = note_interrupt;
  sigemptyset(&action.sa_mask);
  action.sa_flags = static_cast<int>(SA_RESTART);
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    sigaction(kSignals[i], &action, &before_[i]);
    // As nohup wants it. (Shells let what runs in the background ignore SIGINT.)
    const bool is_nohup = kSignals[i] == SIGHUP && before_[i].sa_handler == SIG_IGN;
    if (is_nohup) sigaction(SIGHUP, &before_[i], nullptr);
  }
}

InterruptSignal::~InterruptSignal() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &before_[i], nullptr);
}

bool InterruptSignal::raised() const { return interrupt_raised; }

}  // namespace viwo::app

#include "viwo/experiment/interrupt.hpp"

#include <atomic>

namespace viwo::experiment {
namespace {

std::atomic<bool> interrupt_raised = false;
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may not wait");

void note_interrupt(int) { interrupt_raised = true; }

}  // namespace

InterruptSignal::InterruptSignal() {
  interrupt_raised = false;
  struct sigaction action {};
  action.sa_handler = note_interrupt;
  sigemptyset(&action.sa_mask);
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
  sigaction(SIGINT, &action, &before_);
}

InterruptSignal::~InterruptSignal() { sigaction(SIGINT, &before_, nullptr); }

bool InterruptSignal::raised() const { return interrupt_raised; }

}  // namespace viwo::experiment

// Signals that ask a process to end.
#include <csignal>

#include <gtest/gtest.h>

#include "interrupt.hpp"

namespace viwo::app {
namespace {

TEST(InterruptSignal, RemembersTheFirstAndPutsBackWhatWasThere) {
  struct sigaction before {
  }, during{}, after{};
  sigaction(SIGINT, nullptr, &before);
  {
    const InterruptSignal signal;
    EXPECT_FALSE(signal.raised());
    std::raise(SIGINT);
    EXPECT_TRUE(signal.raised());
    sigaction(SIGINT, nullptr, &during);
    EXPECT_EQ(during.sa_handler, SIG_DFL);  // a second one ends the process
  }
  sigaction(SIGINT, nullptr, &after);
  EXPECT_EQ(after.sa_handler, before.sa_handler);
  EXPECT_FALSE(InterruptSignal().raised());
}

TEST(InterruptSignal, IsRaisedByAllThatAskAProcessToEnd) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    const InterruptSignal signal;
    EXPECT_FALSE(signal.raised());
    std::raise(number);
    EXPECT_TRUE(signal.raised()) << number;
  }
}

TEST(InterruptSignal, EndsTheProcessTheSecondTime) {
  const auto twice = [](int first, int second) {
    const InterruptSignal signal;
    std::raise(first);
    std::raise(second);
  };
  EXPECT_EXIT(twice(SIGINT, SIGINT), ::testing::KilledBySignal(SIGINT), "");
  EXPECT_EXIT(twice(SIGHUP, SIGTERM), ::testing::KilledBySignal(SIGTERM), "");
}

TEST(InterruptSignal, LeavesAHangUpAloneThatIsIgnored) {
  const auto before = std::signal(SIGHUP, SIG_IGN);
  {
    const InterruptSignal signal;
    std::raise(SIGHUP);
    EXPECT_FALSE(signal.raised());
    std::raise(SIGTERM);
    EXPECT_TRUE(signal.raised());
    std::raise(SIGHUP);  // still is
  }
  std::signal(SIGHUP, before);
}

}  // namespace
}  // namespace viwo::app

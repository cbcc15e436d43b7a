// What a terminal or a file shows of long work.
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include "progress.hpp"

namespace viwo::app {
namespace {

TEST(Progress, SaysInAFileEachPieceThatIsDone) {
  ::testing::internal::CaptureStderr();
  {
    Progress progress;
    progress.begin("fits", 3);
    progress.note("one more thing");
    progress.skipped(1, "1 of 3 taken over");
    progress.done("first");
    progress.done("second");
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(),
            "one more thing\n[1/3] 1 of 3 taken over\n[2/3] first\n[3/3] second\n");
}

TEST(TimeProgress, IsSilentForASecondAndThenSaysEveryTenPercent) {
  ::testing::internal::CaptureStderr();
  {
    TimeProgress progress("run");
    progress.at(0.5);
    std::this_thread::sleep_for(std::chrono::milliseconds(1050));
    progress.at(0.05);  // less than ten percent are not worth a line
    progress.at(0.678);
    progress.at(0.9);  // within a second of the last line
    std::this_thread::sleep_for(std::chrono::milliseconds(1050));
    progress.at(0.69);
    progress.at(1.);
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "run: 67 %\nrun: 100 %\n");
}

}  // namespace
}  // namespace viwo::app

// Each mistake of an update fails, with a message that names it.
#include "support.hpp"

namespace viwo::conformance {
namespace {

/// The first of the checks that fail.
std::string update_failures(const std::string& defect) {
  const std::string all = failures_of("update", defect);
  return all.substr(0, all.find('\n'));
}

TEST(BrokenUpdate, WithoutAMistakeItPasses) { EXPECT_EQ(update_failures("none"), ""); }

TEST(BrokenUpdate, AResidualThatIsNotFinite) {
  EXPECT_EQ(update_failures("nan"),
            "start: residual factor 0 of epoch 1: residual has entries that are not finite");
}

TEST(BrokenUpdate, ColumnsThatOverlap) {
  EXPECT_EQ(update_failures("overlap"),
            "start: residual factor 0 of epoch 1: columns 5 to 7 overlap another block (column "
            "5)");
}

TEST(BrokenUpdate, ColumnsBeyondTheState) {
  EXPECT_EQ(update_failures("beyond"),
            "start: residual factor 0 of epoch 1: columns 97 to 99 are not in the state of 99");
}

TEST(BrokenUpdate, ANoiseThatIsNotSymmetric) {
  EXPECT_EQ(update_failures("asymmetric"),
            "start: residual factor 0 of epoch 1: R is not symmetric (by up to 0.001)");
}

TEST(BrokenUpdate, ANoiseThatIsNotPositive) {
  EXPECT_EQ(update_failures("negative"),
            "start: residual factor 0 of epoch 1: R is not positive definite (eigenvalue -0.5)");
}

TEST(BrokenUpdate, StateThatInstancesShare) {
  EXPECT_EQ(update_failures("shared"),
            "start: two instances give different factors for the same epoch (epoch 1) - no "
            "static variables, no clock, no random numbers but from HostServices::seed");
}

TEST(BrokenUpdate, AnExceptionInAnEpochWithoutImu) {
  EXPECT_EQ(update_failures("throws"),
            "hostile epochs: update() threw 'no IMU' in epoch 9 - leave out what cannot be "
            "used, and count it in rejections()");
}

TEST(BrokenUpdate, ACrashInAnEpochWithoutImu) {
  EXPECT_EQ(update_failures("crash"),
            "hostile epochs: crashed: Segmentation fault - run it under a debugger, or build "
            "plugin and host with VIWO_SANITIZE=address,undefined");
}

TEST(BrokenUpdate, AnUpdateThatCannotStart) {
  EXPECT_EQ(update_failures("no_camera"),
            "start: start() or the first epochs: needs two cameras - the robot of these checks "
            "has an IMU, one camera, four driven wheels and a pose reference");
}

}  // namespace
}  // namespace viwo::conformance

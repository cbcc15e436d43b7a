// viwo run --mcap, where it cannot be done. What it writes: tests/mcap.
#include "support.hpp"

namespace viwo {
namespace {

class McapTest : public CommandLineTest {
 protected:
  Outcome run(const std::string& file) const {
    return viwo({"run", VIWO_TEST_SOURCE_DIR "/configs/runs/viwo_swerve.yaml", "--set",
                 "sensors.simulator0.duration_s=3", "--out", "out", "--mcap", file});
  }
};

TEST_F(McapTest, WantsAFileThatCanBeWritten) {
  expect_refused({"run", "x.yaml", "--mcap", ""},
                 "viwo run: --mcap needs the name of a file (see viwo run --help)");
  const Outcome outcome = run("/dev/full");
  if (outcome.err.find("MCAP cannot be written") != std::string::npos) {
    GTEST_SKIP() << outcome.err;
  }
  EXPECT_EQ(outcome.code, 2);
  EXPECT_EQ(outcome.err, "--mcap: /dev/full  cannot be written: No space left on device\n");
}

}  // namespace
}  // namespace viwo

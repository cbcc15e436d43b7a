// Wheels and IMU of real bases, with noises that are first guesses.
#include <algorithm>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support.hpp"

namespace viwo {
namespace {

const std::filesystem::path kData = std::filesystem::path(VIWO_TEST_SHARED_DIR) / "data/real";

class RealWheels : public CommandLineTest {
 protected:
  void SetUp() override {
    CommandLineTest::SetUp();
    if (!std::filesystem::exists(kData)) GTEST_SKIP() << "the recordings are not here";
  }

  nlohmann::json run(const std::string& configuration, const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{
        "run",   std::string(VIWO_TEST_SOURCE_DIR) + "/configs/runs/" + configuration,
        "--out", "out",

        "--set", "placeholders.data=" + std::filesystem::canonical(kData).string()};
    for (const std::string& assignment : more) {
      words.push_back("--set");
      words.push_back(assignment);
    }
    expect_done(words);
    return summary();
  }

  static double ate_m(const nlohmann::json& summary) { return summary["accuracy"]["ate_m"]; }
};

/// run_21 tilts and skids so much (a noise thirty times the guess, then as the guess again) that a
/// scale which follows it leaves more beyond the gate than the twentieth that is aimed at.
struct Recording {
  const char* name;
  double most_rejected;
};
void PrintTo(const Recording& recording, std::ostream* out) { *out << recording.name; }

class SkidSteer : public RealWheels, public ::testing::WithParamInterface<Recording> {};

TEST_P(SkidSteer, IsAsAccurateWithAGuessAsWithTheBestNoiseThatIsHeld) {
  const std::string recording = std::string("placeholders.run=") + GetParam().name;
  const nlohmann::json guess = run("ucsd_skid_steer.yaml", {recording});
  EXPECT_EQ(guess["status"], "ok");
  const nlohmann::json& wheels = guess["updates"]["wheel_odometry"];
  const double applied = wheels["applied"], rejected = wheels["rejected"];
  EXPECT_LT(rejected, GetParam().most_rejected * (applied + rejected));
  double best_m = std::numeric_limits<double>::infinity();
  for (const char* scale : {"1", "2", "5", "10", "20", "50"}) {
    best_m =
        std::min(best_m, ate_m(run("ucsd_skid_steer.yaml",
                                   {recording, "updates.wheel_odometry.find_noise=false",
                                    std::string("updates.wheel_odometry.noise_scale=") + scale})));
  }
  EXPECT_LT(ate_m(guess), 1.5 * best_m);
}

INSTANTIATE_TEST_SUITE_P(Recordings, SkidSteer,
                         ::testing::Values(Recording{"run_20", 0.05}, Recording{"run_21", 0.10}));

}  // namespace
}  // namespace viwo

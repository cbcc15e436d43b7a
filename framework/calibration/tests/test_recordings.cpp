// The figures of the recorded robot: nominal dead reckoning, calibration with one repetition left
// out.
#include <filesystem>
#include <map>

#include <gtest/gtest.h>

#include "simulated.hpp"
#include "viwo/calibration/calibrate.hpp"
#include "viwo/experiment/experiment.hpp"

namespace viwo {
namespace {

using namespace calibration;
using namespace experiment;
using testing::registry;

const std::filesystem::path kConfigs = std::filesystem::path(VIWO_TEST_SOURCE_DIR) / "configs";

class Recordings : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto data = std::filesystem::path(VIWO_TEST_SHARED_DIR) / "data" / "4wis4wid";
    if (!std::filesystem::exists(data)) GTEST_SKIP() << "no recordings at " << data;
  }
};

TEST_F(Recordings, NominalDeadReckoningEndsWhereOthersMeasured) {
  // Least-squares twist of the eight rows, drive angles from position differences, mm.
  const std::map<std::string, double> end_mm{
      {"1", 121.}, {"2", 127.}, {"3", 150.}, {"6", 235.}, {"7", 237.}, {"8", 229.},
      {"11", 45.}, {"12", 44.}, {"13", 44.}, {"16", 32.}, {"17", 33.}, {"18", 38.},
      {"21", 1.5}, {"22", 1.6}, {"23", 1.7}, {"26", 0.5}, {"27", 0.6}, {"28", 0.6}};
  const auto base = load_run_configuration(kConfigs / "runs" / "recording.yaml", {});
  for (const auto& [recording, expected_mm] : end_mm) {
    const auto result = testing::run(resolve_placeholders(base, {{"recording", recording}}));
    ASSERT_TRUE(result.accuracy);
    EXPECT_NEAR(1e3 * result.accuracy->end_m, expected_mm, 3.) << recording;
  }
}

TEST_F(Recordings, CalibrationPredictsTheRepetitionThatIsLeftOutAndHalfwaysTheMotion) {
  auto setup =
      read_calibration_setup(kConfigs / "calibrations" / "recordings.yaml", {}, registry());
  ASSERT_EQ(setup.recordings.size(), 18u);
  const auto result = calibrate(setup);
  EXPECT_TRUE(result.all.converged);
  const auto expect_below = [](const LeftOut& left_out, double most_m, double most_rad) {
    double end_m = 0., yaw_rad = 0.;
    for (const ValidationRun& run : left_out.runs) {
      end_m += run.calibrated.accuracy->end_m / 18.;
      yaw_rad += std::abs(run.calibrated.accuracy->end_yaw_deg) * M_PI / 180. / 18.;
    }
    EXPECT_EQ(left_out.runs.size(), 18u) << left_out.by;
    EXPECT_LT(end_m, most_m) << left_out.by;
    EXPECT_LT(yaw_rad, most_rad) << left_out.by;
  };
  ASSERT_EQ(result.left_out.size(), 2u);
  expect_below(result.left_out[0], 0.010, 0.012);
  // Without gains of the steering 65 mm, 0.040 rad; nominal 75 mm, 0.072 rad.
  expect_below(result.left_out[1], 0.040, 0.035);
}

TEST_F(Recordings, ThreeModelsRunSideBySide) {
  ExperimentOptions options;
  const auto setup = read_experiment(kConfigs / "experiments" / "three_models.yaml", options);
  const auto result = run_experiment(setup, options, registry(), {});
  EXPECT_EQ(result.runs.size(), 54u);
  for (const ExperimentRun& run : result.runs) EXPECT_EQ(run.result.status, RunStatus::kOk);
}

}  // namespace
}  // namespace viwo

// What viwo observability reads, refuses and writes.
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "analysis.hpp"
#include "message_of.hpp"
#include "viwo/results/run_output.hpp"

namespace viwo {
namespace {

using namespace observability;
using ::testing::HasSubstr;

const std::vector<std::string> kShort = {"sensors.simulator0.duration_s=5",
                                         "sensors.simulator0.features=20",
                                         "sensors.simulator0.ramp_s=0"};

// Cameras and IMU alone hide where the world begins, and that has a name.
TEST(Observability, ExplainsTheNullSpaceOfARobotWithoutWheels) {
  const auto file = std::filesystem::path(::testing::TempDir()) / "viwo_no_wheels.yaml";
  const std::string cameras = testing::configuration("cameras/t265_like.yaml").string();
  std::ofstream(file) << "sensors:\n"
                         "  simulator0:\n"
                         "    type: simulator\n"
                         "    robot: {type: differential, baseline_m: 0.4, radius_left_m: 0.05, "
                         "radius_right_m: 0.05}\n"
                         "    motion: figure_eight\n"
                         "    duration_s: 5\n"
                         "    features: 20\n"
                         "    cameras: "
                      << cameras << "\ncameras: {kalibr: " << cameras
                      << ", calibrate: false}\nestimator: {start: reference}\n"
                         "updates:\n  visual_features: {sigma_px: 1}\n";
  const ObservabilityReport report =
      observability::analyse(read_observability(file, {}), testing::registry());
  const Observability& free = report.results.at(0).free;
  EXPECT_EQ(free.unobservable, 4);
  EXPECT_EQ(free.unexplained, 0);
  EXPECT_EQ(testing::find(free, "global position and yaw").hidden, 4);
}

TEST(ObservabilityOutput, OfARunHasTheKeysThatScriptsRead) {
  const ObservabilityReport report = testing::analyse("runs/viwo_swerve.yaml", kShort);
  ASSERT_EQ(report.results.size(), 1u);
  EXPECT_TRUE(report.notes.empty());
  const auto folder = std::filesystem::path(::testing::TempDir()) / "viwo_observability";
  std::filesystem::remove_all(folder);
  write_observability(folder, report);
  EXPECT_TRUE(std::filesystem::exists(folder / "report.html"));
  std::ifstream in(folder / "observability.json");
  const auto json = nlohmann::json::parse(in);
  const auto& entry = json["motions"]["viwo_swerve"]["run"];
  EXPECT_EQ(entry["state_size"], 44);
  EXPECT_EQ(entry["rank"], 40);
  EXPECT_EQ(entry["unobservable"], 4);
  EXPECT_EQ(entry["null_directions"].size(), 4u);
  EXPECT_EQ(entry["gauge_free"]["unobservable"], 7);
  EXPECT_EQ(entry["parameters"]["r_1"]["observable"], true);
  EXPECT_GT(entry["parameters"]["r_1"]["sigma_ratio"], 0.);
  EXPECT_LT(entry["parameters"]["x_2"]["sigma_ratio"], 0.5);
  EXPECT_FALSE(entry["parameters"].contains("x_1"));
  // Three of the four are shifts: of the body and of the feature alike.
  int shifts = 0;
  for (const auto& direction : entry["null_directions"]) {
    shifts += direction.contains("p_IinG_z") && direction.contains("p_FinG_z");
    for (const auto& [state, weight] : direction.items()) {
      EXPECT_TRUE(state.starts_with("p_") || state.starts_with("theta_GtoI") ||
                  state.starts_with("v_IinG"))
          << state;
      EXPECT_LE(std::abs(weight.get<double>()), 1.);
    }
  }
  EXPECT_GE(shifts, 1);
  EXPECT_THAT(describe(report), HasSubstr("4 + 3"));
  const report::Document document = report_of(report);
  EXPECT_EQ(document.sections.size(), 3u);
}

TEST(ObservabilityOutput, DoesNotChangeFromCallToCall) {
  const ObservabilityReport first = testing::analyse("runs/viwo_swerve.yaml", kShort);
  const ObservabilityReport second = testing::analyse("runs/viwo_swerve.yaml", kShort);
  EXPECT_EQ(first.results[0].free.singular_values, second.results[0].free.singular_values);
}

TEST(ObservabilityOutput, RefusesWhatHasNoFilterOrNoTruth) {
  const auto error = [](const std::string& name, const std::vector<std::string>& assignments) {
    return testing::error_of([&] { testing::analyse(name, assignments); });
  };
  EXPECT_THAT(error("runs/simulated_swerve.yaml", {}),
              HasSubstr("observability is that of the filter: the run needs a section 'updates'"));
  auto standstill = kShort;
  standstill.emplace_back("estimator.start=standstill");
  EXPECT_THAT(error("runs/viwo_swerve.yaml", standstill),
              HasSubstr("observability needs estimator.start: reference"));
}

}  // namespace
}  // namespace viwo

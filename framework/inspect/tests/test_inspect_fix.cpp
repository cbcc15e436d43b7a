// What is to be written is written, and then it is well.
#include <array>
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "in_folder.hpp"
#include "inspected.hpp"
#include "viwo/run/simulate.hpp"

namespace viwo::inspect {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class FixedConfiguration : public testing::InFolder {};

/// A configuration of viwo_swerve that has clock and mounting wrong.
RunSetup wrong() {
  return simulated("viwo_swerve", {"sensors.simulator0.duration_s=40", "wheels.t_OtoI_s=0.1",
                                   "wheels.rpy_ItoO_rad=[3.14159265, 0, 0]"});
}

/// Read again as it would be written.
RunSetup fixed(const RunSetup& setup, const Inspection& found) {
  const std::string text = fixed_configuration(setup, found, testing::registry());
  return read_run(config::parse(text, "fixed.yaml"), testing::registry());
}

TEST_F(FixedConfiguration, HasNoFindingsAnyMore) {
  RunSetup setup = wrong();
  EXPECT_TRUE(inspect(setup).has_faults());
  // What an IMU that is upside down hides shows when it is mended.
  constexpr int kRounds = 2;
  for (int round = 0; round < kRounds; ++round) {
    setup = read_run(setup.resolved, testing::registry());
    setup = fixed(setup, inspect(setup));
  }
  EXPECT_THAT(faults_of(inspect(setup)), IsEmpty());
  EXPECT_NEAR(setup.filter->wheels.front().prior.wheels.t_OtoI_s, 0.005, 2e-3);
  EXPECT_LT((setup.filter->wheels.front().prior.wheels.R_ItoO - Eigen::Matrix3d::Identity()).norm(),
            1e-6);
}

/// configs/runs/viwo_log.yaml on another log, without the true calibration.
config::Node on_log(const std::filesystem::path& folder) {
  const auto file = testing::configuration("runs/viwo_log.yaml");
  config::Node run = config::load_file(file);
  auto& sensors = run.at_path("sensors")->entries();
  std::erase_if(sensors, [](const config::Node::Entry& entry) { return entry.key == "truth0"; });
  config::set_path(run, "estimator.calibration_error_scale", config::Node::scalar_of("0"));
  return resolve_placeholders(run, {{"log", folder.string()}});
}

TEST_F(FixedConfiguration, MendsTheJointsOfALog) {
  RunSetup faulty = changed(swerve(), {.wheels = [](EncoderSample& s) {
                              s.drive_rad_per_s[1] *= -1.;
                              s.steer_rad[2] += 0.3;
                              return true;
                            }});
  write_log(faulty, folder_);
  RunSetup setup = read_run(on_log(folder_), testing::registry());
  const bool has_keys = setup.resolved.at_path("sensors.wheels0.drive_scale") != nullptr;
  EXPECT_TRUE(inspect(setup).has_faults());
  constexpr int kRounds = 2;  // the sign hides the offset
  for (int round = 0; round < kRounds && has_keys; ++round) {
    setup = read_run(setup.resolved, testing::registry());
    setup = fixed(setup, inspect(setup));
  }
  const Inspection mended = inspect(setup);
  if (!has_keys) GTEST_SKIP() << "sensors have no key drive_scale";
  EXPECT_THAT(faults_of(mended), IsEmpty());
}

TEST_F(FixedConfiguration, GivesScalesToTheChannelsOfTheLog) {
  // The first channel is the second drive, and turns backwards.
  RunSetup faulty = changed(swerve(), {.wheels = [](EncoderSample& s) {
                              std::swap(s.drive_rad_per_s[0], s.drive_rad_per_s[1]);
                              s.drive_rad_per_s[0] *= -1.;
                              return true;
                            }});
  write_log(faulty, folder_);
  config::Node run = on_log(folder_);
  config::set_path(run, "sensors.wheels0.drive_channel", config::parse("[2, 1, 3, 4]", "test"));
  RunSetup setup = read_run(run, testing::registry());
  const Inspection found = inspect(setup);
  EXPECT_EQ(remedy_of(finding_of(found, "wheels0", "order"), "sensors.wheels0.drive_scale"),
            "[-1, 1, 1, 1]");
  // What is told to be written is what has to stand there, with what does already.
  config::Node scaled = run;
  config::set_path(scaled, "sensors.wheels0.drive_scale", config::parse("[1, 1.01, 1, 1]", "test"));
  RunSetup other = read_run(scaled, testing::registry());
  EXPECT_EQ(
      remedy_of(finding_of(inspect(other), "wheels0", "order"), "sensors.wheels0.drive_scale"),
      "[-1, 1.01, 1, 1]");
  setup = read_run(setup.resolved, testing::registry());
  setup = fixed(setup, found);
  EXPECT_EQ(drive_signs(setup), (std::vector<int>{1, -1, 1, 1}));
  EXPECT_THAT(faults_of(inspect(setup)), IsEmpty());
}

TEST_F(FixedConfiguration, PutsAnOrderBehindTheOneThatIsThere) {
  RunSetup faulty = changed(swerve(), {.wheels = [](EncoderSample& s) {
                              std::swap(s.drive_rad_per_s[0], s.drive_rad_per_s[1]);
                              return true;
                            }});
  write_log(faulty, folder_);
  // WHEN a third is exchanged in the configuration, where nothing was to be exchanged but two
  config::Node run = on_log(folder_);
  config::set_path(run, "sensors.wheels0.drive_channel", config::parse("[1, 3, 2, 4]", "test"));
  RunSetup setup = read_run(run, testing::registry());
  const Inspection found = inspect(setup);
  EXPECT_EQ(remedy_of(finding_of(found, "wheels0", "order"), "sensors.wheels0.drive_channel"),
            "[2, 1, 3, 4]");
  setup = read_run(setup.resolved, testing::registry());
  setup = fixed(setup, found);
  EXPECT_THAT(faults_of(inspect(setup)), IsEmpty());
}

TEST_F(FixedConfiguration, TurnsTheShiftWithTheSign) {
  // GIVEN a steering encoder that is reversed, and a shift that is right for it: z = s y + o
  RunSetup faulty = changed(swerve(), {.wheels = [](EncoderSample& s) {
                              s.steer_rad[0] = -(s.steer_rad[0] - 0.3);
                              return true;
                            }});
  write_log(faulty, folder_);
  config::Node run = on_log(folder_);
  // WHEN the configuration has the shift of the other sign, as of an encoder that is not reversed
  config::set_path(run, "sensors.wheels0.steer_shift_rad",
                   config::parse("[-0.3, 0, 0, 0]", "test"));
  RunSetup setup = read_run(run, testing::registry());
  const Finding order = finding_of(inspect(setup), "wheels0", "order");
  // THEN both are turned
  EXPECT_EQ(remedy_of(order, "sensors.wheels0.steer_scale"), "[-1, 1, 1, 1]");
  EXPECT_EQ(remedy_of(order, "sensors.wheels0.steer_shift_rad"), "[0.3, 0, 0, 0]");
}

TEST_F(FixedConfiguration, GivesATurnInTheUnitOfTheReading) {
  // GIVEN drives in degrees that begin anew after a turn, and the scale for them
  constexpr double kDegree = std::numbers::pi / 180.;
  std::array<double, 4> angle{};
  std::int64_t last_ns = 0;
  RunSetup faulty = changed(
      swerve(), {.wheels = [&](EncoderSample& s) {
        const double dt_s = last_ns == 0 ? 0. : 1e-9 * static_cast<double>(s.t_ns - last_ns);
        last_ns = s.t_ns;
        for (std::size_t i = 0; i < angle.size(); ++i) {
          angle[i] += dt_s * s.drive_rad_per_s[i] / kDegree;
          s.drive_rad_per_s[i] = angle[i] - 360. * std::floor(angle[i] / 360.);
        }
        return true;
      }});
  write_log(faulty, folder_);
  config::Node run = on_log(folder_);
  config::set_path(run, "sensors.wheels0.drive_input", config::Node::scalar_of("angle"));
  config::set_path(
      run, "sensors.wheels0.drive_scale",
      config::parse("[0.0174532925, 0.0174532925, 0.0174532925, 0.0174532925]", "test"));
  RunSetup setup = read_run(run, testing::registry());
  const Inspection found = inspect(setup);
  EXPECT_EQ(remedy_of(finding_of(found, "wheels0", "turn"), "sensors.wheels0.drive_turn"),
            "[360, 360, 360, 360]");
  setup = fixed(setup, found);
  EXPECT_THAT(faults_of(inspect(setup)), IsEmpty());
}

TEST_F(FixedConfiguration, LeavesOutWhatCannotBeRead) {
  RunSetup setup = swerve();
  Inspection inspection;
  inspection.name = setup.name;
  inspection.findings = {
      {"wheels0", Severity::kFault, "clock", "lags", {}, {{"wheels.t_OtoI_s", "-0.05"}}},
      {"wheels0", Severity::kFault, "x", "is no text", {}, {{"estimator.clones", "soon"}}}};
  const std::string text = fixed_configuration(setup, inspection, testing::registry());
  EXPECT_THAT(text, HasSubstr("t_OtoI_s: -0.05  # wheels0: lags"));
  EXPECT_THAT(text, HasSubstr("# Not in here, for with it nothing can be read ("));
  EXPECT_THAT(text, HasSubstr("): estimator.clones: soon  (wheels0: is no text)"));
}

TEST_F(FixedConfiguration, WritesTheUnitsOfAnImuThatHasKeysForThem) {
  const Fault fault = {.imu = [](ImuSample& s) {
    scale(s.gyro_rad_per_s, 180. / std::numbers::pi);
    scale(s.accel_m_per_s2, 1. / 9.80665);
    return true;
  }};
  RunSetup without = changed(swerve(), fault);
  const Inspection told = inspect(without);
  for (const char* check : {"gravity", "rate"}) {
    EXPECT_EQ(finding_of(told, "imu0", check).severity, Severity::kFault);
    EXPECT_THAT(finding_of(told, "imu0", check).remedies, IsEmpty()) << check;
  }
  RunSetup faulty = changed(swerve(), fault);
  write_log(faulty, folder_);
  config::Node run = on_log(folder_);
  config::set_path(
      run, "sensors.imu0",
      config::parse("{type: csv_table, path: " + (folder_ / "imu0" / "data.csv").string() +
                        ", time_column: 1, time_unit: ns, gyro_columns: [2, 3, 4], "
                        "accel_columns: [5, 6, 7]}",
                    "test"));
  RunSetup setup = read_run(run, testing::registry());
  const Inspection found = inspect(setup);
  EXPECT_EQ(remedy_of(finding_of(found, "imu0", "gravity"), "sensors.imu0.accel_unit"), "g");
  EXPECT_EQ(remedy_of(finding_of(found, "imu0", "rate"), "sensors.imu0.gyro_unit"), "deg");
  setup = fixed(setup, found);
  EXPECT_THAT(faults_of(inspect(setup)), IsEmpty());
}

TEST_F(FixedConfiguration, SaysWhyAKeyIsChangedAndWhatItHasNoKeyFor) {
  RunSetup setup = swerve();
  Inspection inspection;
  inspection.name = setup.name;
  inspection.findings = {
      {"wheels0", Severity::kFault, "clock", "lags behind", {}, {{"wheels.t_OtoI_s", "-0.05"}}},
      {"wheels0", Severity::kNote, "other", "not to be written", {}, {{"wheels.t_OtoI_s", "7"}}},
      {"wheels0", Severity::kFault, "late", "is late", {}, {{"wheels.t_OtoI_s", "9"}}},
      {"wheels0", Severity::kFault, "x", "no such key", {}, {{"sensors.nowhere.key", "[1, 2]"}}}};
  const std::string text = fixed_configuration(setup, inspection, testing::registry());
  EXPECT_THAT(text, HasSubstr("t_OtoI_s: -0.05  # wheels0: lags behind"));
  EXPECT_THAT(text,
              HasSubstr("# Not in here, for want of such a key: sensors.nowhere.key: [1, 2]"));
  EXPECT_THAT(text, HasSubstr("# Not in here, for what is found first has this key: "
                              "wheels.t_OtoI_s: 9  (wheels0: is late)"));
  const RunSetup fixed = read_run(config::parse(text, "fixed.yaml"), testing::registry());
  EXPECT_EQ(fixed.filter->wheels.front().prior.wheels.t_OtoI_s, -0.05);
}

TEST(InspectionOutput, HasAllFiguresAndVerdicts) {
  RunSetup setup = wrong();
  const Inspection inspection = inspect(setup);
  const nlohmann::json json = to_json(inspection);
  EXPECT_EQ(json.at("name"), "viwo_swerve");
  EXPECT_GE(json.at("faults").get<int>(), 1);
  EXPECT_EQ(json.at("findings").size(), inspection.findings.size());
  EXPECT_THAT(describe(inspection), HasSubstr("write  wheels.rpy_ItoO_rad: [0, 0, 0]"));
  EXPECT_THAT(describe(inspected(swerve(), {})), HasSubstr("\nno findings\n"));
}

}  // namespace
}  // namespace viwo::inspect

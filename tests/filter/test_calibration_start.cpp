// A run that starts from the calibration.yaml of another one begins where that has ended.
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "filter_runs.hpp"
#include "in_folder.hpp"
#include "message_of.hpp"
#include "viwo/results/run_output.hpp"
#include "viwo/setup/calibration_values.hpp"

namespace viwo {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kRounding = 1e-9;

/// All entries of a calibration.
CalibrationFile::Entries all_of(const CalibrationFile& file) {
  CalibrationFile::Entries all;
  for (const auto* section : {&file.intrinsics, &file.mount, &file.clock, &file.cameras}) {
    all.insert(all.end(), section->begin(), section->end());
  }
  return all;
}

/// What differs between the end of a filter and the start of another one.
std::vector<std::string> differences(const CalibrationFile& end, const CalibrationFile& start) {
  std::vector<std::string> found;
  const auto all = all_of(end), again = all_of(start);
  if (all.size() != again.size()) return {"number of entries"};
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].name != again[i].name) found.push_back(all[i].name + " is " + again[i].name);
    if (!(std::abs(all[i].estimate - again[i].estimate) <= kRounding)) {
      found.push_back("estimate of " + all[i].name);
    }
    if (!(std::abs(all[i].sigma - again[i].sigma) <= kRounding * all[i].sigma)) {
      found.push_back("sigma of " + all[i].name);
    }
  }
  const auto &P = end.correlations, &Q = start.correlations;
  if (P.entries != Q.entries || !P.matrix.isApprox(Q.matrix, kRounding)) {
    found.emplace_back("correlations");
  }
  return found;
}

class CalibrationStartTest : public testing::InFolder {
 protected:
  /// A short run of the swerve robot with two cameras, all of it calibrated.
  static RunSetup setup(const std::vector<std::string>& more = {}, const char* scale = "0") {
    std::vector<std::string> assignments{
        "placeholders.motion=icr_sweep", "sensors.simulator0.duration_s=8",
        "cameras.calibrate=true", std::string("estimator.calibration_error_scale=") + scale};
    assignments.insert(assignments.end(), more.begin(), more.end());
    return testing::run_setup("runs/viwo_swerve.yaml", assignments);
  }

  /// Runs it and writes its results; the file that is left.
  std::filesystem::path first_run() {
    RunSetup first = setup({}, "1");
    const RunData data = collect(first);
    const RunResult result = run(first, data);
    EXPECT_EQ(result.status, RunStatus::kOk) << result.cause;
    end_ = *result.final_calibration;
    write_run(folder_, first, result);
    return folder_ / "calibration.yaml";
  }

  static CalibrationFile start_of(const RunSetup& setup) {
    return calibration_file_of(make_estimator(*setup.filter).filter());
  }

  std::filesystem::path write(const std::string& text) const {
    return InFolder::write("changed.yaml", text);
  }

  CalibrationFile end_;
};

TEST_F(CalibrationStartTest, ARunBeginsWhereTheOneBeforeHasEndedInValueAndCovariance) {
  const auto file = first_run();
  ASSERT_EQ(all_of(end_).size(), 16u + 6u + 1u + 2u * 14u + 1u);
  const RunSetup second = setup({"calibration=" + file.string()});
  EXPECT_THAT(differences(end_, start_of(second)), IsEmpty());
  EXPECT_THAT(second.warnings, IsEmpty());
  // It has been learned something, or nothing would be tested.
  const auto prior = differences(end_, start_of(setup()));
  for (const char* what :
       {"sigma of r_2", "estimate of r_2", "sigma of t_OtoI", "sigma of p_IinO_x",
        "sigma of cam0.fx", "sigma of cam1.p_IinC_x", "correlations"}) {
    EXPECT_THAT(prior, ::testing::Contains(what));
  }
  // The wheels' part of the file by the key of the wheels.
  const CalibrationFile wheels = start_of(setup({"kinematics.calibration=" + file.string()}));
  const CalibrationFile configured = start_of(setup());
  const CalibrationFile::Entries ends = all_of(end_);
  for (const CalibrationEntry& entry : all_of(wheels)) {
    const bool is_camera = entry.name.starts_with("cam");
    const CalibrationEntry& expected = *find(is_camera ? configured.cameras : ends, entry.name);
    EXPECT_NEAR(entry.estimate, expected.estimate, kRounding) << entry.name;
    EXPECT_NEAR(entry.sigma, expected.sigma, kRounding) << entry.name;
  }
}

TEST_F(CalibrationStartTest, OfSeveralWheelSetsTakesEachByItsName) {
  // Without updates of wheels: those would need a sensor of their own for the second set.
  const std::string back =
      "wheel_sets={back: {kinematics: {type: differential, radius_left_m: 0.0255, radius_right_m: "
      "0.0255, baseline_m: 0.3}, wheels: {p_IinO_m: [0.05, 0.02, 0.15]}}}";
  const std::string updates = "updates={visual_features: {}}";
  const RunSetup two = setup({back, updates});
  CalibrationFile file = start_of(setup());
  describe_rig(two, file);
  EXPECT_EQ(file.wheel_sets.at("back"), "differential");
  for (auto* section : {&file.intrinsics, &file.mount, &file.clock}) section->clear();
  file.correlations = {};
  int i = 0;
  for (const WheelSet& set : two.filter->wheels) {
    for (const BlockSpec& block : wheels_blocks(set.prior)) {
      auto& section = block.name.ends_with(".extrinsics") ? file.mount
                      : block.name.ends_with(".clock")    ? file.clock
                                                          : file.intrinsics;
      for (const BlockEntry& entry : block.entries) {
        section.push_back({entry.name, 0.05 + 1e-4 * ++i, 1e-3 * i, 0., entry.unit});
      }
    }
  }
  const auto changed = write(calibration_text(file, "a test"));
  const RunSetup start = setup({back, updates, "calibration=" + changed.string()});
  const auto [mount, clock, intrinsics] = wheels_blocks(start.filter->wheels[1].prior);
  for (const auto& [block, section] :
       {std::pair{&mount, &file.mount}, {&clock, &file.clock}, {&intrinsics, &file.intrinsics}}) {
    for (const BlockEntry& entry : block->entries) {
      ASSERT_TRUE(entry.name.starts_with("back.")) << entry.name;
      EXPECT_EQ(entry.sigma, find(*section, entry.name)->sigma) << entry.name;
    }
  }
  EXPECT_EQ(start.filter->wheels[1].prior.wheels.x_WI[2],
            find(file.intrinsics, "back.baseline")->estimate);
  // Another model of that name.
  file.wheel_sets["back"] = "skid_steer";
  write(calibration_text(file, "a test"));
  EXPECT_THAT(
      [&] {
        setup({back, updates, "calibration=" + changed.string()});
      },
      ::testing::ThrowsMessage<InputError>(
          HasSubstr("for the model 'skid_steer', wheel set 'back' has 'differential'")));
}

TEST_F(CalibrationStartTest, ShowsWhereSigmasOrCorrelationsAreNotRead) {
  const auto file = first_run();
  const std::string text = testing::text_of(file);
  CalibrationFile without = read_calibration(file);
  without.correlations = {};
  auto changed = write(calibration_text(without, "a test"));
  EXPECT_THAT(differences(end_, start_of(setup({"calibration=" + changed.string()}))),
              ::testing::ElementsAre("correlations"));
  for (auto* section : {&without.intrinsics, &without.mount, &without.clock, &without.cameras}) {
    for (CalibrationEntry& entry : *section) entry.sigma = 0.;
  }
  changed = write(calibration_text(without, "a test"));
  const auto found = differences(end_, start_of(setup({"calibration=" + changed.string()})));
  for (const CalibrationEntry& entry : all_of(end_)) {
    if (!(entry.sigma > 0.)) continue;
    EXPECT_THAT(found, ::testing::Contains("sigma of " + entry.name));
  }
}

TEST_F(CalibrationStartTest, WhatIsHeldStaysHeldAndWhatWasHeldHasTheConfiguredPrior) {
  const auto file = first_run();
  const std::string from = "calibration=" + file.string();
  const CalibrationFile held = start_of(setup({from, "wheels.calibrate_intrinsics=false"}));
  EXPECT_EQ(find(held.intrinsics, "r_2")->sigma, 0.);
  EXPECT_EQ(find(held.intrinsics, "r_2")->estimate, find(end_.intrinsics, "r_2")->estimate);
  EXPECT_EQ(find(held.intrinsics, "x_1")->sigma, 0.) << "the gauge";
  CalibrationFile of_held = read_calibration(file);
  for (CalibrationEntry& entry : of_held.mount) entry.sigma = 0.;
  of_held.correlations = {};
  const auto changed = write(calibration_text(of_held, "a test"));
  const CalibrationFile start = start_of(setup({"calibration=" + changed.string()}));
  const CalibrationFile configured = start_of(setup({}));
  EXPECT_NEAR(find(start.mount, "p_IinO_x")->sigma, find(configured.mount, "p_IinO_x")->sigma,
              1e-4);
  EXPECT_GT(find(start.mount, "p_IinO_x")->sigma, 0.1) << "the first wheel may be off";
  EXPECT_NEAR(find(start.mount, "p_IinO_x")->estimate, find(end_.mount, "p_IinO_x")->estimate,
              kRounding);
}

TEST_F(CalibrationStartTest, RefusesWhatHasDivergedAndTellsOfDoubts) {
  const auto file = first_run();
  CalibrationFile bad = read_calibration(file);
  bad.status = CalibrationFile::Status::kDiverged;
  bad.reasons = {"a speed: of 200 m/s"};
  auto changed = write(calibration_text(bad, "a test"));
  const std::string from = "calibration=" + changed.string();
  EXPECT_EQ(testing::error_of([&] { setup({from}); }),
            changed.string() +
                ":4:9  this calibration is not to be used: what it is from has diverged (a speed: "
                "of 200 m/s) - calibrate again, or, if you know it to be right, write status: "
                "doubtful");
  bad.status = CalibrationFile::Status::kDoubtful;
  write(calibration_text(bad, "a test"));
  const RunSetup doubtful = setup({from});
  ASSERT_EQ(doubtful.warnings.size(), 1u);
  EXPECT_EQ(doubtful.warnings[0],
            "calibration " + changed.string() + " is doubtful: a speed: of 200 m/s");
}

TEST_F(CalibrationStartTest, OfARunThatDivergesIsRefused) {
  RunSetup first = setup({"estimator.max_speed_m_per_s=0.01"});
  const RunData data = collect(first);
  const RunResult result = run(first, data);
  ASSERT_EQ(result.status, RunStatus::kDiverged);
  write_run(folder_, first, result);
  const std::string from = "calibration=" + (folder_ / "calibration.yaml").string();
  EXPECT_THAT([&] { setup({from}); },
              ::testing::ThrowsMessage<InputError>(HasSubstr("has diverged (")));
}

TEST_F(CalibrationStartTest, StartsThatAreMadeWrongAreDrawnWithoutCorrelations) {
  const auto file = first_run();
  const RunSetup wrong = setup({"calibration=" + file.string()}, "1");
  EXPECT_TRUE(wrong.filter->options.filter.correlations.entries.empty());
  ASSERT_EQ(wrong.warnings.size(), 1u);
  EXPECT_THAT(wrong.warnings[0], HasSubstr("draws each parameter by itself"));
}

}  // namespace
}  // namespace viwo

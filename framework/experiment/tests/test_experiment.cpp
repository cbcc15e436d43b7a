// Experiments: axes, checks before the first run, independence of the number of jobs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "experiment_file.hpp"
#include "message_of.hpp"

namespace viwo {
namespace {

using namespace experiment;
using ::testing::AllOf;
using testing::error_of;
using testing::ExperimentFile;
using ::testing::HasSubstr;
using testing::kVariants;
using testing::registry;

TEST_F(ExperimentFile, RunsEveryVariantWithEveryMotionAndSeedWhateverTheJobs) {
  const auto file = write(kVariants);
  std::vector<ExperimentResult> results;
  for (const int jobs : {1, 2}) {
    ExperimentOptions options;
    options.jobs = jobs;
    options.assignments = {"evaluation.segment_lengths_m=[10, 25]"};
    results.push_back(run_experiment(read_experiment(file, options), options, registry(), folder_));
    EXPECT_EQ(results.back().runs.size(), 8u);
  }
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(results[0].runs[i].result.status, RunStatus::kOk);
    EXPECT_EQ(results[0].runs[i].result.total.g, results[1].runs[i].result.total.g);
    EXPECT_EQ(results[0].runs[i].seed, i % 2 + 1);
  }
  write_experiment(folder_ / "out", results[0]);
  for (const char* name : {"runs.csv", "summary.json", "report.html"}) {
    EXPECT_TRUE(std::filesystem::exists(folder_ / "out" / name)) << name;
  }
  std::ifstream in(folder_ / "out" / "summary.json");
  const auto summary = nlohmann::json::parse(in);
  EXPECT_EQ(summary["variants"]["drive_only"]["runs"], 4);
  EXPECT_EQ(summary["variants"]["drive_only"]["diverged"], 0);
  EXPECT_TRUE(summary["variants"]["redundant"]["rpe"].contains("10"));
}

TEST(FilterExperiment, GivesTheSameBitsForAnyNumberOfJobsAndTwiceInARow) {
  std::vector<ExperimentResult> results;
  for (const int jobs : {1, 2, 2}) {
    ExperimentOptions options;
    options.jobs = jobs;
    options.seeds = 2;
    options.assignments = {"sensors.simulator0.duration_s=12", "estimator.hold_unexcited=true"};
    results.push_back(run_experiment(
        read_experiment(VIWO_TEST_SOURCE_DIR "/configs/experiments/paper_accuracy.yaml", options),
        options, registry(), {}));
  }
  for (std::size_t i = 0; i < results[0].runs.size(); ++i) {
    const RunResult& first = results[0].runs[i].result;
    ASSERT_EQ(first.status, RunStatus::kOk) << first.cause;
    ASSERT_GT(first.calibration.size(), 20u);
    for (const auto* other : {&results[1].runs[i].result, &results[2].runs[i].result}) {
      EXPECT_EQ(first.estimate.back().p_BinW, other->estimate.back().p_BinW);
      EXPECT_EQ(first.nees.pose, other->nees.pose);
      for (std::size_t k = 0; k < first.calibration.size(); ++k) {
        EXPECT_EQ(first.calibration[k].estimate, other->calibration[k].estimate);
        EXPECT_EQ(first.calibration[k].sigma, other->calibration[k].sigma);
      }
    }
  }
}

TEST_F(ExperimentFile, GivesEverySeedTheSameSensorsInEveryVariant) {
  ExperimentOptions options;
  const auto file = write(
      "experiment: test\nbase: run.yaml\nseeds: 2\nmotions: [circle]\n"
      "variants: {a: , b: {evaluation.segment_lengths_m: [5]}}\n");
  const auto result = run_experiment(read_experiment(file, options), options, registry(), folder_);
  EXPECT_EQ(result.runs[0].result.total.g, result.runs[2].result.total.g);
  EXPECT_NE(result.runs[0].result.total.g, result.runs[1].result.total.g);
}

TEST_F(ExperimentFile, ChecksEveryVariantBeforeTheFirstRun) {
  ExperimentOptions options;
  const auto file = write(
      "experiment: test\nbase: run.yaml\nmotions: [circle]\n"
      "variants:\n  good:\n  bad: {kinematics.radius_mm: 25}\n");
  const auto setup = read_experiment(file, options);
  EXPECT_THAT(error_of([&] { run_experiment(setup, options, registry(), folder_); }),
              HasSubstr("experiment.yaml:6:9  kinematics (four_wis_wid): unknown key 'radius_mm'"));
}

TEST_F(ExperimentFile, KeepsARunThatFailsAndGoesOn) {
  ExperimentOptions options;
  const auto file = write(
      "experiment: test\nbase: run.yaml\nmotions: [circle, lateral]\nvariants:\n"
      "  swerve:\n"
      "  differential:\n"
      "    sensors.simulator0.robot: &d {type: differential, radius_left_m: 0.05, radius_right_m: "
      "0.05, baseline_m: 0.3}\n    kinematics: *d\n");
  // A differential drive cannot follow a lateral motion: told before anything runs.
  const auto setup = read_experiment(file, options);
  EXPECT_THAT(error_of([&] { run_experiment(setup, options, registry(), folder_); }),
              AllOf(HasSubstr("cannot follow motion 'lateral'"),
                    HasSubstr("experiment.yaml:3:19  while reading recording 'lateral'")));
}

TEST_F(ExperimentFile, SaysWhatIsWrongWithItsAxes) {
  const ExperimentOptions options;
  const auto error = [&](const std::string& text) {
    const std::string what = error_of([&] { read_experiment(write(text), options); });
    return what.substr(what.find("experiment.yaml"));
  };
  const std::string head = "experiment: test\nbase: run.yaml\n";
  EXPECT_EQ(error(head),
            "experiment.yaml:1:1  'variants' must be a section with at least one "
            "variant: NAME: {overrides}");
  EXPECT_EQ(error(head + "recordings: [1, 1]\nvariants: {a: }\n"),
            "experiment.yaml:3:17  '1' is in this list twice");
  EXPECT_EQ(error(head + "recordings: []\nvariants: {a: }\n"),
            "experiment.yaml:3:13  this must be a list with at least one element");
  EXPECT_EQ(error(head + "recordings: [1]\nmotions: [circle]\nvariants: {a: }\n"),
            "experiment.yaml:4:10  give either 'recordings' or 'motions', not both");
  EXPECT_EQ(error(head + "recordings: [{repetition: 1}]\nvariants: {a: }\n"),
            "experiment.yaml:3:14  this recording has none of 'name', 'recording' and 'motion' to "
            "be called by");
  EXPECT_EQ(error(head + "report_by: [motoin]\nmotions: [circle]\nvariants: {a: }\n"),
            "experiment.yaml:3:12  report_by: no recording has the label 'motoin' - did you mean "
            "'motion'?");
  EXPECT_EQ(
      error(head + "variants: {../a: }\n"),
      "experiment.yaml:3:12  '../a' must be usable as a file name: letters, digits, '_', '-', "
      "'+' and '.'");
  EXPECT_EQ(error(head + "baseline: b\nvariants: {a: , bb: }\n"),
            "experiment.yaml:3:11  baseline: there is no variant 'b' - did you mean 'bb'?");
  EXPECT_THAT(error("experiment: test\nbase: wlak.yaml\nvariants: {a: }\n"),
              HasSubstr("experiment.yaml:2:7  base: no such file: " + folder_.string()));
  EXPECT_EQ(error(head + "variants: {a: 5}\n"),
            "experiment.yaml:3:15  variant 'a' must be a section of overrides");
  EXPECT_EQ(
      error("experiment: test\nvariants: {a: }\n"),
      "experiment.yaml:1:1  experiment: 'base' is missing (run configuration, relative to this "
      "file)");
}

TEST(Placeholders, ComeFromTheLabelsThenFromTheRunItself) {
  const auto run = config::parse("placeholders: {a: 1, b: 2}\nx: '{a}/{b}'\n", "run.yaml");
  EXPECT_EQ(resolve_placeholders(run, {{"b", "7"}}).find("x")->scalar(), "1/7");
  EXPECT_EQ(resolve_placeholders(run).find("x")->scalar(), "1/2");
  EXPECT_EQ(error_of([&] {
              resolve_placeholders(
                  config::parse("x: '{recordng}'\nplaceholders: {recording: 1}\n", "run.yaml"));
            }),
            "run.yaml:1:4  unknown placeholder '{recordng}' in '{recordng}' - did you mean "
            "'recording'?");
}

}  // namespace
}  // namespace viwo

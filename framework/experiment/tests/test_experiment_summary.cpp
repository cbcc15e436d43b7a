// What is written of an experiment: statistics, paired differences, labels, failures, the page.
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "experiment_file.hpp"
#include "viwo/results/metrics.hpp"
#include "viwo/results/run_output.hpp"
#include "viwo/results/run_record.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;
using namespace experiment;
using ::testing::HasSubstr;
using testing::kVariants;
using testing::registry;
using testing::text_of;

/// Two variants on two recordings with two seeds; ATE in metres as given, by variant, recording,
/// seed.
ExperimentResult with_errors(const std::vector<double>& ate_m) {
  ExperimentResult result;
  result.setup.name = "by hand";
  result.setup.variants = {{"a", {}}, {"b", {}}};
  result.setup.recordings = {{"1", {{"motion", "turn"}}}, {"2", {{"motion", "go"}}}};
  result.setup.report_by = {"motion"};
  result.setup.seeds = 2;
  result.jobs = 2;
  result.wall_s = 8.;
  for (std::size_t i = 0; i < ate_m.size(); ++i) {
    ExperimentRun run{i / 4, i / 2 % 2, i % 2 + 1, {}};
    run.result.duration_s = 60.;
    run.result.wall_s = 0.5;
    if (std::isfinite(ate_m[i])) {
      run.result.accuracy.emplace();
      run.result.accuracy->ate_m = ate_m[i];
    } else {
      run.result.status = RunStatus::kDiverged;
      run.result.cause = "went, as \"they\" say,\naway";
    }
    result.runs.push_back(run);
  }
  return result;
}

class Summary : public testing::ExperimentFile {
 protected:
  nlohmann::json summary_of(const ExperimentResult& result) {
    write_experiment(folder_ / "out", result);
    return nlohmann::json::parse(text_of(folder_ / "out" / "summary.json"));
  }
};

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST_F(Summary, HasMeanMedianSpreadAndQuantiles) {
  const auto summary = summary_of(with_errors({1., 2., 3., 6., 1., 1., 1., kNan}));
  const auto& a = summary["variants"]["a"]["metrics"]["ate_m"];
  EXPECT_EQ(a["n"], 4);
  EXPECT_DOUBLE_EQ(a["mean"], 3.);
  EXPECT_DOUBLE_EQ(a["median"], 2.5);
  EXPECT_DOUBLE_EQ(a["std"], std::sqrt((4. + 1. + 0. + 9.) / 3.));
  EXPECT_DOUBLE_EQ(a["p5"], 1.15);   // position 0.15 between 1 and 2
  EXPECT_DOUBLE_EQ(a["p95"], 5.55);  // position 2.85 between 3 and 6
  EXPECT_EQ(summary["variants"]["b"]["metrics"]["ate_m"]["n"], 3);
  EXPECT_EQ(summary["variants"]["b"]["diverged"], 1);
  EXPECT_TRUE(summary["variants"]["a"]["metrics"]["nees_pose"]["mean"].is_null());
  EXPECT_EQ(summary["jobs"], 2);
  EXPECT_DOUBLE_EQ(summary["realtime_factor"], 120.);
  EXPECT_EQ(summary["viwo_version"], viwo_version());
}

TEST_F(Summary, LeavesOutWhatARunStoppedAtThatDiverged) {
  // GIVEN a diverged run that has numbers of its first half second
  ExperimentResult result = with_errors({1., 2., 3., 6., 1., 1., 1., kNan});
  for (ExperimentRun& run : result.runs) {
    run.result.updates = {{"parity", {8, 9}, {}, {}, {}}};
    run.result.nees.pose = run.result.status == RunStatus::kOk ? 6. : 600.;
  }
  // THEN they are in no mean and in no pair
  const auto summary = summary_of(result);
  const auto& b = summary["variants"]["b"]["metrics"]["nees_pose"];
  EXPECT_EQ(b["n"], 3);
  EXPECT_EQ(b["mean"], 6.);
  EXPECT_EQ(summary["paired"]["variants"]["b"]["nees_pose"]["pairs"], 3);
  EXPECT_EQ(summary["paired"]["variants"]["b"]["nees_pose"]["mean"], 0.);
}

TEST_F(Summary, CalibrationOfVariantsStandsBelowItsOwnName) {
  // GIVEN variants that estimate as many families of parameters, but others
  ExperimentResult result = with_errors({1., 2., 3., 6., 2., 4., 6., 7.});
  for (ExperimentRun& run : result.runs) {
    const char* const name = run.variant == 0 ? "r_1" : "t_OtoI";
    run.result.updates = {{"parity", {8, 9}, {}, {}, {}}};
    run.result.calibration = {{name, "m", {0., 0.}, {10., 1.}, 0., run.variant == 0 ? 2. : 3., 1.}};
  }
  // WHEN the page is written
  write_experiment(folder_ / "out", result);
  // THEN each has a column, and nothing in that of the other
  const std::string page = text_of(folder_ / "out" / "report.html");
  const auto table = page.find("Calibration by motion");
  ASSERT_NE(table, std::string::npos);
  const std::string rows = page.substr(table, page.find("</table>", table) - table);
  const auto first = rows.find(">20"), second = rows.find(">30");
  ASSERT_NE(first, std::string::npos) << rows;
  ASSERT_NE(second, std::string::npos) << rows;
  const auto cells = [&rows](std::size_t from, std::size_t to) {
    std::size_t n = 0;
    for (auto at = rows.find("<td", from); at < to; at = rows.find("<td", at + 1)) ++n;
    return n;
  };
  const auto row_of = [&rows](std::size_t at) { return rows.rfind("<tr", at); };
  EXPECT_EQ(cells(row_of(first), first), 3U) << rows;
  EXPECT_EQ(cells(row_of(second), second), 4U) << rows;
}

TEST_F(Summary, HasEveryMetricInEveryPlaceAlsoOfARunThatWasTakenOver) {
  ExperimentResult result = with_errors({1., 2., 3., 6., 2., 4., 6., 7.});
  RunResult& run = result.runs[0].result;
  run.accuracy->rpe = {{2.5, 3, 0.01, 0.02, 0.03, 0.04}};
  run.nees_planar = run.nees.pose = run.nees.position = run.nees.orientation = run.nees.relative =
      2.25;
  run.end_sigma.position_m = 2.25;
  run.updates = {{"parity", {8, 9}, {}, {}, {}}};
  CalibrationTrack& track = run.calibration.emplace_back();
  track.estimate = track.sigma = {0.1, 0.1};
  track.scatter = 2.25;
  run.epoch_t_s = {0., 0.1};
  run.updates[0].applied = run.updates[0].rejected = {4, 4};
  const RunResult kept = from_record(to_record(run));
  const auto summary = summary_of(result);
  const std::string csv = text_of(folder_ / "out" / "runs.csv");
  const std::string header = csv.substr(0, csv.find('\n')) + ",";
  const std::string page = text_of(folder_ / "out" / "report.html"), table = describe(result);
  for (const Metric& metric : metrics_over({2.5})) {
    ASSERT_TRUE(std::isfinite(metric.of(run))) << metric.key << ": give the run above one";
    EXPECT_EQ(metric.of(kept), metric.of(run)) << metric.key;
    EXPECT_THAT(header, HasSubstr("," + metric.key + ","));
    EXPECT_TRUE(summary["variants"]["a"]["metrics"].contains(metric.key)) << metric.key;
    EXPECT_TRUE(summary["paired"]["variants"]["b"].contains(metric.key)) << metric.key;
    EXPECT_THAT(table, HasSubstr(metric.heading));
    EXPECT_THAT(page, HasSubstr(metric.heading));
  }
}

/// Mean of (2 / 1)^2 and (6 / 1)^2; of (2 / 1)^2 and (6 / 4)^2.
TEST_F(Summary, SaysWhatErrorsOfCalibrationAreBySigmasThatAreWidenedByTheirScatter) {
  ExperimentResult result = with_errors({1., 2.});
  for (std::size_t i = 0; i < 2; ++i) {
    RunResult& run = result.runs[i].result;
    run.updates = {{"parity", {8, 9}, {}, {}, {}}};
    run.calibration = {{"r_1", "m", {0., 0.}, {10., 1.}, 0., i == 0 ? 2. : 6., i == 0 ? 1. : 4.}};
  }
  const auto r = summary_of(result)["variants"]["a"]["calibration"]["r_1"];
  EXPECT_DOUBLE_EQ(r["nees"], 20.);
  EXPECT_DOUBLE_EQ(r["widened_nees"], 3.125);
  EXPECT_THAT(describe(result), HasSubstr("44.7 (20! / 3.1)"));
  EXPECT_THAT(text_of(folder_ / "out" / "report.html"), HasSubstr("(20!\u00a0/\u00a03.1)"));
}

/// Chi-square of two runs: 0.01003 to 10.597.
TEST_F(Summary, SaysWhichParametersAreBiasedOrNotConsistent) {
  ExperimentResult result = with_errors({1., 2.});
  const double errors[3][2] = {{2., 2.2}, {3., -2.}, {0.05, -0.05}};  // in sigmas, of two runs
  for (std::size_t i = 0; i < 2; ++i) {
    RunResult& run = result.runs[i].result;
    run.updates = {{"parity", {8, 9}, {}, {}, {}}};
    for (std::size_t k = 0; k < 3; ++k) {
      run.calibration.push_back(
          {"r_" + std::to_string(k), "m", {0., 0.}, {10., 0.5}, 0., 0.5 * errors[k][i], 1.});
    }
  }
  const auto calibration = summary_of(result)["variants"]["a"]["calibration"];
  EXPECT_NEAR(calibration["r_0"]["nees_bounds"][0], 0.01003 / 2., 1e-5);
  EXPECT_NEAR(calibration["r_0"]["nees_bounds"][1], 10.597 / 2., 1e-3);
  EXPECT_DOUBLE_EQ(calibration["r_0"]["mean_error_sigmas"], 2.1);
  EXPECT_DOUBLE_EQ(calibration["r_1"]["mean_error_sigmas"], 0.5);
  const std::string page = text_of(folder_ / "out" / "report.html");
  for (const char* nees : {"(4.4)", "(6.5!)", "(0.0025!)"}) EXPECT_THAT(page, HasSubstr(nees));
  EXPECT_THAT(describe(result), HasSubstr("9.54 (3.6!)")) << "of the three together";
}

TEST_F(Summary, CountsRunsThatAreNotToBeTrusted) {
  ExperimentResult result = with_errors({1., 2., kNan, 4.});
  result.runs[1].result.doubts = {"the reference contradicts the estimate"};
  const auto a = summary_of(result)["variants"]["a"];
  EXPECT_EQ(a["diverged"], 1);
  EXPECT_EQ(a["doubtful"], 1);
  EXPECT_THAT(describe(result), HasSubstr("\na              1         1 "));
}

TEST_F(Summary, SaysOfHowManyRunsAMeanIsIfNotOfAll) {
  ExperimentResult result = with_errors({1., 2., 3., 6., 1., 1., 1., kNan});
  const auto is_told = [&](const std::string& what) {
    write_experiment(folder_ / "out", result);
    const bool in_table = describe(result).find(what) != std::string::npos;
    EXPECT_EQ(text_of(folder_ / "out" / "report.html").find(what) != std::string::npos, in_table);
    return in_table;
  };
  EXPECT_TRUE(is_told("b: all means of 3 of 4 runs"));
  EXPECT_FALSE(is_told("a: all means"));
  result.runs[0].result.nees_planar = 2.;
  EXPECT_TRUE(is_told("a: NEES (3) of 1 of 4 runs"));
  EXPECT_TRUE(is_told("b: end [mm], end yaw [mrad], ATE [mm], ATE [deg] of 3 of 4 runs"));
}

TEST_F(Summary, PairsTheRunsOfOneRecordingAndSeed) {
  // b - a: 1, 2, 3 and nothing for the last pair; t(0.975, 2) = 4.302653.
  ExperimentResult result = with_errors({1., 2., 3., 6., 2., 4., 6., kNan});
  std::swap(result.runs[4], result.runs[6]);  // the order does not matter
  auto summary = summary_of(result);
  EXPECT_EQ(summary["paired"]["baseline"], "a");
  EXPECT_EQ(summary["paired"]["confidence"], 0.95);
  EXPECT_EQ(summary["paired"]["variants"].size(), 1u);
  const auto& b = summary["paired"]["variants"]["b"]["ate_m"];
  EXPECT_EQ(b["pairs"], 3);
  EXPECT_DOUBLE_EQ(b["mean"], 2.);
  EXPECT_DOUBLE_EQ(b["std"], 1.);
  EXPECT_NEAR(b["low"], 2. - 4.302653 / std::sqrt(3.), 1e-6);
  EXPECT_NEAR(b["high"], 2. + 4.302653 / std::sqrt(3.), 1e-6);
  result.setup.baseline = 1;
  summary = summary_of(result);
  EXPECT_EQ(summary["paired"]["baseline"], "b");
  EXPECT_DOUBLE_EQ(summary["paired"]["variants"]["a"]["ate_m"]["mean"], -2.);
}

TEST_F(Summary, HasTheRelativeErrorsOverTheLengthsThatTheRunsAreConfiguredWith) {
  ExperimentOptions options;
  options.assignments = {"sensors.simulator0.duration_s=60"};  // longer than 10 m
  const auto file = write(
      "experiment: test\nbase: run.yaml\nmotions: [circle]\nvariants:\n"
      "  usual: {evaluation.segment_lengths_m: [10, 25]}\n  short: {evaluation.segment_lengths_m: "
      "[2.5, 0.5]}\n");
  const auto result = run_experiment(read_experiment(file, options), options, registry(), {});
  const auto summary = summary_of(result);
  // Both variants have the lengths of both; what one was not evaluated over is empty.
  const auto& usual = summary["variants"]["usual"];
  const auto& brief = summary["variants"]["short"];
  const eval::Accuracy& accuracy = *result.runs[1].result.accuracy;
  EXPECT_EQ(brief["metrics"]["rpe_2.5_m"]["mean"], accuracy.rpe[0].mean_m);
  EXPECT_EQ(brief["metrics"]["rpe_0.5_deg"]["mean"], accuracy.rpe[1].mean_deg);
  EXPECT_EQ(brief["rpe"]["0.5"]["m"], accuracy.rpe[1].mean_m);
  EXPECT_EQ(brief["metrics"]["rpe_10_m"]["n"], 0);
  EXPECT_EQ(usual["metrics"]["rpe_10_m"]["mean"], result.runs[0].result.accuracy->rpe[0].mean_m);
  EXPECT_EQ(usual["metrics"]["rpe_0.5_m"]["n"], 0);
  EXPECT_TRUE(usual["metrics"]["rpe_0.5_m"]["mean"].is_null());
  EXPECT_EQ(summary["paired"]["variants"]["short"]["rpe_2.5_m"]["pairs"], 0);
  const std::string csv = text_of(folder_ / "out" / "runs.csv");
  EXPECT_THAT(csv.substr(0, csv.find('\n')),
              HasSubstr(",ate_deg,rpe_0.5_m,rpe_0.5_deg,rpe_2.5_m,rpe_2.5_deg,rpe_10_m,rpe_10_deg,"
                        "rpe_25_m,rpe_25_deg,nees_planar,"));
  EXPECT_THAT(describe(result), HasSubstr("RPE 0.5 m [mm]"));
  EXPECT_THAT(text_of(folder_ / "out" / "report.html"), HasSubstr("RPE 2.5 m [deg]"));
}

TEST_F(Summary, IsBrokenDownByLabels) {
  const auto summary = summary_of(with_errors({1., 2., 3., 6., 2., 4., 6., kNan}));
  const auto& by = summary["by"]["motion"];
  ASSERT_EQ(by.size(), 2u);
  EXPECT_DOUBLE_EQ(by["turn"]["variants"]["a"]["metrics"]["ate_m"]["mean"], 1.5);
  EXPECT_DOUBLE_EQ(by["go"]["variants"]["a"]["metrics"]["ate_m"]["mean"], 4.5);
  EXPECT_EQ(by["go"]["variants"]["b"]["runs"], 2);
  EXPECT_EQ(by["go"]["variants"]["b"]["diverged"], 1);
  EXPECT_EQ(by["turn"]["variants"]["b"]["diverged"], 0);
  EXPECT_DOUBLE_EQ(by["turn"]["paired"]["variants"]["b"]["ate_m"]["mean"], 1.5);
  EXPECT_EQ(by["go"]["paired"]["variants"]["b"]["ate_m"]["pairs"], 1);
}

TEST_F(Summary, MarksOnTheTerminalWhatIsMoreThanChance) {
  // b - a in mm: 10, 10, 10, 14, so 11 and 3.182446 * 2 / sqrt(4) by t(0.975, 3).
  const ExperimentResult result =
      with_errors({0.001, 0.002, 0.003, 0.006, 0.011, 0.012, 0.013, 0.02});
  const std::string text = describe(result);
  EXPECT_THAT(text, HasSubstr("difference to a over pairs of runs, 95 % interval"));
  EXPECT_THAT(text, HasSubstr("\nATE [mm]                     11 +- 3.2 *\n"));
  EXPECT_THAT(text, HasSubstr("end [mm]                        0 +- 0  \n"));
  EXPECT_THAT(text, HasSubstr("one core runs 120 times faster than real time; the experiment with "
                              "2 jobs 60 times\n"));
  // What was taken over has not been run in this time.
  ExperimentResult resumed = result;
  for (std::size_t i = 0; i < 4; ++i) resumed.runs[i].taken_over = true;
  EXPECT_THAT(describe(resumed), HasSubstr("120 times faster than real time; the experiment with "
                                           "2 jobs 30 times\n"));
}

TEST_F(Summary, SaysWhyARunIsNotOk) {
  ExperimentResult result = with_errors({1., 2., 3., 6., 1., 1., 1., kNan});
  result.runs.front().result.doubts = {"it goes elsewhere", "and more"};
  summary_of(result);
  const std::string csv = text_of(folder_ / "out" / "runs.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 9);
  EXPECT_THAT(csv, HasSubstr(",doubtful,"));
  EXPECT_THAT(csv, HasSubstr(",it goes elsewhere\n"));
  EXPECT_THAT(csv.substr(0, csv.find('\n')), ::testing::EndsWith(",epoch_ms,cause"));
  EXPECT_THAT(csv, ::testing::EndsWith(",\"went, as \"\"they\"\" say, away\"\n"));
  const std::string page = text_of(folder_ / "out" / "report.html");
  EXPECT_THAT(page, HasSubstr("Runs that failed, diverged or are doubtful: 2"));
  EXPECT_THAT(page, HasSubstr("went, as &quot;they&quot; say,"));
}

TEST_F(Summary, ReasonsOfRunsAreNeitherFormulasNorControlTheTerminal) {
  ExperimentResult result = with_errors({1., 2., 3., 6., 1., 1., 1., 1.});
  result.runs[0].result.doubts = {"=cmd|'/C calc'!A0.csv is late"};
  result.runs[1].result.doubts = {"@\x1b[2J\xe2\x80\xae, a"};
  result.runs[2].result.doubts = {"caf\xc3\xa9 = 1"};
  summary_of(result);
  const std::string csv = text_of(folder_ / "out" / "runs.csv");
  EXPECT_THAT(csv, HasSubstr(",'=cmd|'/C calc'!A0.csv is late\n"));
  EXPECT_THAT(csv, HasSubstr(",\"'@?[2J?, a\"\n"));
  EXPECT_THAT(csv, HasSubstr(",caf\xc3\xa9 = 1\n"));
}

TEST_F(Summary, KeepsGoingWhenAPluginThrows) {
  // A plugin with one drive that throws when it is in that mood.
  const fs::path plugins = folder_ / "plugins";
  fs::create_directories(plugins);
  fs::create_symlink(VIWO_TEST_BINARY_DIR "/tests/plugins_bad/libviwo_kinematics_moody.so",
                     plugins / "libviwo_kinematics_moody.so");
  PluginRegistry moody({VIWO_TEST_PLUGIN_DIR, plugins});
  std::ofstream log(folder_ / "data.csv");
  log << "#timestamp_ns,drive_1\n";
  for (int i = 1; i <= 300; ++i) log << i << "0000000,2.0\n";
  log.close();
  std::ofstream(folder_ / "run.yaml") << "sensors: {wheels0: {type: asl_encoders, path: .}}\n"
                                         "kinematics: {type: moody}\n";
  const auto file = write(
      "experiment: moods\nbase: run.yaml\nseeds: 2\nvariants:\n"
      "  fine:\n  bad: {kinematics.mood: rows_std}\n  worse: {kinematics.mood: rows_int}\n");
  ExperimentOptions options;
  testing::Told told;
  options.progress = &told;
  const ExperimentResult result =
      run_experiment(read_experiment(file, options), options, moody, folder_ / "out");
  const std::string lines = told.text();
  ASSERT_EQ(result.runs.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(result.runs[i].result.status, i < 2 ? RunStatus::kOk : RunStatus::kFailed) << i;
  }
  EXPECT_THAT(result.runs[2].result.cause, HasSubstr("no such row"));
  EXPECT_THAT(lines, HasSubstr("bad  seed 1  failed: "));
  // Those that failed are run again: their cause may have been mended. They are collected all the
  // same.
  const auto taken_over = [&](const ExperimentOptions& how) {
    const ExperimentResult again =
        run_experiment(read_experiment(file, how), how, moody, folder_ / "out");
    return std::count_if(again.runs.begin(), again.runs.end(),
                         [](const ExperimentRun& run) { return run.taken_over; });
  };
  options.resume = true;
  EXPECT_EQ(taken_over(options), 2);
  options.resume = false;
  options.collect = true;
  EXPECT_EQ(taken_over(options), 6);
  write_experiment(folder_ / "out", result);
  EXPECT_THAT(text_of(folder_ / "out" / "runs.csv"), HasSubstr("no such row"));
  EXPECT_THAT(text_of(folder_ / "out" / "report.html"), HasSubstr("no such row"));
}

}  // namespace
}  // namespace viwo

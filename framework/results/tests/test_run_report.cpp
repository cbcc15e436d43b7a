// The page of a run: what it shows of real runs, checked against the run's numbers and in a
// browser.
#include <cmath>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "browser.hpp"
#include "simulated.hpp"
#include "viwo/report/curves.hpp"
#include "viwo/report/figures.hpp"
#include "viwo/report/html.hpp"
#include "viwo/results/metrics.hpp"
#include "viwo/results/run_output.hpp"
#include "viwo/run/warnings.hpp"

namespace viwo {
namespace {

using report::Document;
using report::Plot;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::registry;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct FinishedRun {
  RunSetup setup;
  RunResult result;
};

/// Ten seconds of a swerve robot on a circle, with everything that the filter estimates.
RunSetup filter_setup() {
  const config::Node node =
      config::parse("name: page\n" + testing::swerve_with_camera(40) +
                        "wheels: {sigma_p_IinO_m: [0.1, 0.1, 0.1], sigma_t_OtoI_s: 0.01}\n"
                        "cameras: {kalibr: " VIWO_TEST_SOURCE_DIR
                        "/configs/cameras/pinhole.yaml}\n"
                        "updates: {visual_features: {}, wheel_odometry: {}}\n",
                    "run.yaml");
  return read_run(node, registry(), 7);
}

const FinishedRun& filter_run() {
  static const FinishedRun run = [] {
    RunSetup setup = filter_setup();
    const RunData data = collect(setup);
    RunResult result = viwo::run(setup, data);
    return FinishedRun{std::move(setup), std::move(result)};
  }();
  return run;
}

/// Wheels alone.
FinishedRun odometry_run() {
  RunSetup setup = read_run(testing::simulated("circle"), registry(), 1);
  const RunData data = collect(setup);
  RunResult result = run_odometry(setup, data);
  return {std::move(setup), std::move(result)};
}

std::vector<std::string> headings(const Document& document) {
  std::vector<std::string> all;
  for (const auto& section : document.sections) all.push_back(section.heading);
  return all;
}

std::vector<const Plot*> plots_of(const Document& document) {
  std::vector<const Plot*> plots;
  for (const auto& section : document.sections) {
    for (const auto& block : section.blocks) {
      if (const auto* plot = std::get_if<Plot>(&block)) plots.push_back(plot);
    }
  }
  return plots;
}

const Plot& plot_named(const Document& document, std::string_view title) {
  for (const Plot* plot : plots_of(document)) {
    if (plot->title == title) return *plot;
  }
  throw std::runtime_error("no plot '" + std::string(title) + "'");
}

int estimated_parameters(const RunResult& result) {
  return static_cast<int>(
      std::count_if(result.calibration.begin(), result.calibration.end(),
                    [](const CalibrationTrack& track) { return track.sigma.front() > 0.; }));
}

TEST(Contradictions, AreUpdatesThatHaveMoreRejectedThanGatesDoByChance) {
  const auto warned = [](std::int64_t applied, std::int64_t rejected) {
    return !contradictions({{"wheel_odometry", {applied, rejected}, {}, {}, {}}}).empty();
  };
  EXPECT_TRUE(warned(28, 12));
  EXPECT_FALSE(warned(29, 11));
  EXPECT_TRUE(warned(799, 201));
  EXPECT_FALSE(warned(800, 200));
  EXPECT_FALSE(warned(20, 19));
  EXPECT_FALSE(warned(12227, 12));
  EXPECT_FALSE(warned(0, 19));
  EXPECT_TRUE(warned(9, 11));  // of most of them half as many are enough
}

TEST(Contradictions, KnowWhereTheyAreMoreThanHalf) {
  const auto doubted = [](std::int64_t applied, std::int64_t rejected) {
    return contradictions({{"wheel_odometry", {applied, rejected}, {}, {}, {}}}).at(0).is_most;
  };
  EXPECT_FALSE(doubted(500, 500));
  EXPECT_TRUE(doubted(499, 501));
}

TEST(Contradictions, AreTellTalesOfSwappedJoints) {
  // Left and right wheels are each other's: the base seems to turn the other way.
  RunSetup setup = filter_setup();
  RunData data = collect(setup);
  const auto given = data.wheels();
  std::vector<EncoderSample> samples(given.begin(), given.end());
  for (EncoderSample& sample : samples) {
    for (auto* joints : {&sample.drive_rad_per_s, &sample.steer_rad}) {
      std::swap((*joints)[0], (*joints)[3]);
      std::swap((*joints)[1], (*joints)[2]);
    }
  }
  data.recorded.set(data.wheels_name, samples);
  const RunResult result = viwo::run(setup, data);
  ASSERT_EQ(result.doubts.size(), 2U);
  EXPECT_THAT(result.doubts[0], HasSubstr("left and right of the wheels are exchanged"));
  EXPECT_THAT(result.doubts[1],
              HasSubstr(" rejected: what it measures and the rest contradict each other - check"));
  EXPECT_THAT(describe(result), HasSubstr("status doubtful\n  " + result.doubts[0]));
  const nlohmann::json summary = summary_of(setup, result);
  EXPECT_EQ(summary.at("status"), "doubtful");
  EXPECT_EQ(summary.at("doubts").at(1), result.doubts[1]);
  EXPECT_EQ(summary.at("warnings").at(0), result.warnings[0]);
  const std::string page = report::to_html(report_of(setup, result));
  EXPECT_THAT(page, HasSubstr(result.doubts[0]));
  EXPECT_THAT(page, HasSubstr(result.warnings[0]));
  EXPECT_TRUE(filter_run().result.warnings.empty());
  EXPECT_TRUE(is_trusted(filter_run().result));
}

TEST(DisplayUnit, IsSmallWhereValuesAre) {
  EXPECT_EQ(report::display_unit("m", 0.05).name, "mm");
  EXPECT_EQ(report::display_unit("m", 0.05).scale, 1e3);
  EXPECT_EQ(report::display_unit("m", 0.5).name, "m");
  EXPECT_EQ(report::display_unit("m", 0.5).scale, 1.);
  EXPECT_EQ(report::display_unit("rad", 0.01).name, "mrad");
  EXPECT_EQ(report::display_unit("s", 0.01).name, "ms");
  EXPECT_EQ(report::display_unit("1", 0.01).name, "1");
  EXPECT_EQ(report::with_unit("error", "mm"), "error [mm]");
  EXPECT_EQ(report::with_unit("error", ""), "error");
}

TEST(Curve, IsThinnedToItsEndsAndScaled) {
  const std::vector<double> x{0., 1., 2., 3., 4., 5.}, y{1., 2., 3., 4., 5., 6.};
  const std::vector<double> sigma{0.5, 0.5, 0.5, 0.5, 0.5, 1.};
  const report::Series all = report::curve("a", {x, y, sigma, 10.});
  EXPECT_EQ(all.x, x);
  EXPECT_THAT(all.y, ElementsAre(10., 20., 30., 40., 50., 60.));
  EXPECT_THAT(all.y_low, ElementsAre(-5., 5., 15., 25., 35., 30.));
  EXPECT_THAT(all.y_high, ElementsAre(25., 35., 45., 55., 65., 90.));
  const report::Series error = report::error_curve("b", {x, y, sigma, 10.}, 3);
  EXPECT_THAT(error.x, ElementsAre(0., 2., 4., 5.));
  EXPECT_THAT(error.y, ElementsAre(10., 30., 50., 60.));
  EXPECT_THAT(error.y_low, ElementsAre(-15., -15., -15., -30.));
  EXPECT_THAT(error.y_high, ElementsAre(15., 15., 15., 30.));
  EXPECT_TRUE(report::curve("c", {x, y}).y_low.empty());
}

TEST(RunReport, HasEveryMetricThatTheRunHas) {
  const auto& [setup, result] = filter_run();
  const auto metrics = summary_of(setup, result)["metrics"];
  const std::string page = report::to_html(report_of(setup, result));
  int found = 0;
  for (const Metric& metric : metrics_over(segment_lengths_m(result))) {
    ASSERT_TRUE(metrics.contains(metric.key)) << metric.key;
    if (!std::isfinite(metric.of(result))) {
      EXPECT_TRUE(metrics[metric.key].is_null()) << metric.key;
      continue;
    }
    ++found;
    EXPECT_EQ(metrics[metric.key], metric.of(result));
    EXPECT_THAT(page, HasSubstr(metric.heading));
  }
  EXPECT_GE(found, 9);
  EXPECT_EQ(metrics["ate_m"], result.accuracy->ate_m);
}

TEST(RunReport, ShowsAllOfAFilter) {
  const auto& [setup, result] = filter_run();
  ASSERT_EQ(result.status, RunStatus::kOk) << result.cause;
  RunResult without_monitor = result;
  without_monitor.monitor = {};
  const Document document = report_of(setup, without_monitor);
  EXPECT_THAT(headings(document),
              ElementsAre("Result", "Trajectory", "Error and its bounds", "Calibration", "Noise",
                          "Updates and gates", "Time", "Configuration"));
  // Top view, error over the way; x, y, z, yaw; NEES; updates; two of time.
  const int expected = 2 + 4 + 1 + estimated_parameters(result) + 2 + 2;
  EXPECT_EQ(plots_of(document).size(), static_cast<std::size_t>(expected));
  EXPECT_GE(estimated_parameters(result), 17);
  EXPECT_TRUE(plot_named(document, "Seen from above").equal_axes);
}

TEST(RunReport, ShowsTheErrorsOfTheRunWithItsSigmas) {
  const auto& [setup, result] = filter_run();
  const Document document = report_of(setup, result);
  const Plot& yaw = plot_named(document, "Yaw error");
  EXPECT_EQ(yaw.y_label, "error [mrad]");
  ASSERT_EQ(yaw.series.size(), 1U);
  ASSERT_EQ(yaw.series[0].y.size(), result.errors.size());
  const PoseError& last = result.errors.back();
  EXPECT_EQ(yaw.series[0].y.back(), 1e3 * last.yaw_rad);
  EXPECT_NEAR(yaw.series[0].y_high.back(), 3e3 * last.yaw_sigma_rad, 1e-12);
  EXPECT_NEAR(yaw.series[0].y_low.back(), -3e3 * last.yaw_sigma_rad, 1e-12);
}

TEST(RunReport, DrawsTheNeesBetweenItsChiSquareBounds) {
  const auto& [setup, result] = filter_run();
  const Document document = report_of(setup, result);
  const Plot& nees = plot_named(document, "Normalised estimation error squared (NEES) of the pose");
  ASSERT_EQ(nees.lines.size(), 2U);
  // From a table of the chi-square distribution with six degrees of freedom.
  EXPECT_NEAR(nees.lines[0].value, 1.237, 5e-4);
  EXPECT_NEAR(nees.lines[1].value, 14.449, 5e-4);
  ASSERT_EQ(nees.series.size(), 2U);
  double sum = 0.;
  for (const double value : nees.series[0].y) sum += value;
  EXPECT_NEAR(nees.series[1].y[0], sum / static_cast<double>(nees.series[0].y.size()), 1e-9);
}

TEST(RunReport, ShowsParametersInUnitsThatFit) {
  const auto& [setup, result] = filter_run();
  const Document document = report_of(setup, result);
  EXPECT_EQ(plot_named(document, "r_1").y_label, "r_1 [mm]");
  EXPECT_EQ(plot_named(document, "t_OtoI").y_label, "t_OtoI [ms]");
  EXPECT_EQ(plot_named(document, "delta_o2").y_label, "delta_o2 [mrad]");
  const auto track = std::find_if(result.calibration.begin(), result.calibration.end(),
                                  [](const auto& t) { return t.name == "r_1"; });
  const Plot& plot = plot_named(document, "r_1");
  ASSERT_EQ(plot.series.size(), 2U);
  EXPECT_EQ(plot.series[0].y.back(), 1e3 * track->estimate.back());
  EXPECT_TRUE(plot.series[1].reference);
  EXPECT_EQ(plot.series[1].y[0], 1e3 * track->truth);
  EXPECT_THROW(plot_named(document, "x_1"), std::runtime_error);  // held by the gauge
}

TEST(RunReport, CountsFactorsPerSecond) {
  const auto& [setup, result] = filter_run();
  const Document document = report_of(setup, result);
  const Plot& wheels = plot_named(document, "wheel_odometry");
  const auto update = std::find_if(result.updates.begin(), result.updates.end(),
                                   [](const auto& u) { return u.name == "wheel_odometry"; });
  double in_third_second = 0.;
  for (std::size_t i = 0; i < result.epoch_t_s.size(); ++i) {
    const double t_s = result.epoch_t_s[i] - result.epoch_t_s.front();
    if (t_s >= 2. && t_s < 3.) in_third_second += update->applied[i];
  }
  EXPECT_GT(in_third_second, 0.);
  EXPECT_EQ(wheels.series[0].name, "applied");
  EXPECT_NEAR(wheels.series[0].x.at(2), result.epoch_t_s.front() + 2.5, 1e-12);
  EXPECT_EQ(wheels.series[0].y.at(2), in_third_second);
  EXPECT_EQ(wheels.series[1].name, "rejected");
}

TEST(RunReport, CarriesAConfigurationThatRunsAgain) {
  const auto& [setup, result] = filter_run();
  const Document document = report_of(setup, result);
  const auto& details = std::get<report::Details>(document.sections.back().blocks.at(1));
  const RunSetup again = read_run(config::parse(details.text, "page"), registry());
  EXPECT_EQ(config::to_yaml(again.resolved), config::to_yaml(setup.resolved));
  const auto& plugins = std::get<report::Table>(document.sections.back().blocks.at(0));
  EXPECT_EQ(plugins.rows.size(), 4U);  // kinematics, simulator, two updates
}

TEST(RunReport, ShowsWheelsAloneAndRunsWithoutTruth) {
  FinishedRun run = odometry_run();
  const Document wheels = report_of(run.setup, run.result);
  EXPECT_EQ(headings(wheels).front(), "Result");
  EXPECT_EQ(headings(wheels).back(), "Configuration");
  EXPECT_EQ(plot_named(wheels, "Seen from above").series.size(), 2U);
  EXPECT_NO_THROW(plot_named(wheels, "Yaw error"));
  EXPECT_NO_THROW(report::to_html(wheels));

  run.result.reference.clear();
  run.result.accuracy.reset();
  const Document unknown = report_of(run.setup, run.result);
  EXPECT_EQ(plot_named(unknown, "Seen from above").series.size(), 1U);
  EXPECT_THAT(report::to_html(unknown),
              HasSubstr("There is no reference: nothing to compare the estimate with."));

  RunResult blind = filter_run().result;
  blind.reference.clear();
  blind.accuracy.reset();
  blind.errors.clear();
  blind.nees = {};
  for (CalibrationTrack& track : blind.calibration) track.truth = track.final_error = kNaN;
  const Document filter = report_of(filter_run().setup, blind);
  EXPECT_EQ(plot_named(filter, "r_1").series.size(), 1U);
  EXPECT_NO_THROW(report::to_html(filter));
}

TEST(RunReport, SaysWhyARunFailed) {
  FinishedRun run = odometry_run();
  RunResult nothing;
  nothing.status = RunStatus::kFailed;
  nothing.cause = "no state to start from";
  const Document document = report_of(run.setup, nothing);
  EXPECT_THAT(headings(document), ElementsAre("Result", "Configuration"));
  EXPECT_THAT(report::to_html(document),
              HasSubstr("<p class=\"warning\" role=\"alert\">failed: no state to start from</p>"));
}

/// Three looks of a monitor at two parameters.
MonitorTrack monitor() {
  return {{1., 2., 3.},
          {"r_1", "x_2"},
          {{1., 0.5, 0.25}, {1., 1., kNaN}},
          {0, 1, 2},
          {{2.5, "no yaw rate for 5 s - turn", {"x_2"}}}};
}

TEST(RunReport, ShowsWhatTheMonitorFound) {
  auto [setup, result] = filter_run();
  result.monitor = monitor();
  const Document document = report_of(setup, result);
  const Plot& map = plot_named(document, "Excitation of the calibration over time");
  ASSERT_TRUE(map.heat_map);
  EXPECT_THAT(map.heat_map->x, ElementsAre("1", "2", "3"));
  EXPECT_THAT(map.heat_map->y, ElementsAre("r_1", "x_2"));
  EXPECT_THAT(map.heat_map->z[0], ElementsAre(1., 0.5, 0.25));
  EXPECT_THAT(plot_named(document, "Directions of the calibration that are held").series[0].y,
              ElementsAre(0., 1., 2.));
  EXPECT_THAT(report::to_html(document), HasSubstr("2.5 s: no yaw rate for 5 s - turn</p>"));
  EXPECT_THAT(describe(result), HasSubstr("at 2.5 s: no yaw rate for 5 s - turn\n"));
}

TEST(RunSummary, HasTheVersionAndTheMonitor) {
  auto [setup, result] = filter_run();
  result.monitor = {};
  EXPECT_FALSE(summary_of(setup, result).contains("monitor"));
  EXPECT_EQ(summary_of(setup, result).at("viwo_version"), viwo_version());
  result.monitor = monitor();
  EXPECT_EQ(summary_of(setup, result).at("monitor"),
            nlohmann::json::parse(R"({"warnings": [{"time_s": 2.5,
                "text": "no yaw rate for 5 s - turn", "parameters": ["x_2"]}],
                "sigma_ratio": {"r_1": 0.25, "x_2": null}})"));
}

TEST(RunReportInBrowser, DrawsEveryPlotOfARealRun) {
  const std::string program = report::browser();
  if (program.empty()) GTEST_SKIP() << "no chromium, chromium-browser or google-chrome in PATH";
  auto [setup, result] = filter_run();
  result.monitor = monitor();
  const Document document = report_of(setup, result);
  const std::string dom = report::rendered(program, report::to_html(document));
  EXPECT_EQ(report::body_tag(dom),
            "<body data-plots=\"" + std::to_string(plots_of(document).size()) + "\">");
  EXPECT_THAT(dom, HasSubstr("class=\"trace bars\""));
}

TEST(RunReportFigures, DrawEveryPlotOfARealRun) {
  if (report::output_of("command -v gnuplot").empty()) {
    GTEST_SKIP() << "no gnuplot in PATH (Debian: gnuplot-nox)";
  }
  auto [setup, result] = filter_run();
  result.monitor = monitor();
  const Document document = report_of(setup, result);
  const report::TemporaryFolder folder;
  report::write_figures(folder.path(), document, report::FigureFormat::kSvg);
  std::size_t figures = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    if (entry.path().extension() != ".svg") continue;
    EXPECT_GT(entry.file_size(), 2000U) << entry.path();
    ++figures;
  }
  EXPECT_EQ(figures, plots_of(document).size());
}

}  // namespace
}  // namespace viwo

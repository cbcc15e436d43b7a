// The plots on the page of an experiment.
#include <gtest/gtest.h>

#include "experiment_file.hpp"

namespace viwo {
namespace {

using namespace experiment;
using testing::kVariants;
using testing::registry;

class Plots : public testing::ExperimentFile {};

/// Number of plots of a document, and how many of them have nothing in them.
std::pair<int, int> plots_of(const report::Document& document) {
  int plots = 0, empty = 0;
  for (const report::Section& section : document.sections) {
    for (const report::Block& block : section.blocks) {
      if (const auto* plot = std::get_if<report::Plot>(&block)) {
        ++plots;
        empty += plot->series.empty() && !plot->heat_map;
      }
    }
  }
  return {plots, empty};
}

TEST_F(Plots, AreThereIfThereIsSomethingToShowFor) {
  const ExperimentOptions options;
  const auto result =
      run_experiment(read_experiment(write(kVariants), options), options, registry(), {});
  // Dead reckoning on two motions: above, the ends, position and yaw error of each.
  EXPECT_EQ(plots_of(report_of(result)), std::make_pair(8, 0));
}

TEST_F(Plots, ShowTheCalibrationOfTheFilterBesideItsTruth) {
  ExperimentOptions options;
  options.seeds = 2;
  options.assignments = {"sensors.simulator0.duration_s=4"};
  const auto result = run_experiment(
      read_experiment(VIWO_TEST_SOURCE_DIR "/configs/experiments/paper_accuracy.yaml", options),
      options, registry(), {});
  const report::Document document = report_of(result);
  // Above, consistency, position, yaw; the map of what is left of the sigmas; a plot for each of
  // 6 + 1 + 4 + 3 + 3 + 3 parameters; the stages.
  EXPECT_EQ(plots_of(document), std::make_pair(4 + 1 + 20 + 1, 0));
  const report::Plot* radius = nullptr;
  for (const report::Section& section : document.sections) {
    for (const report::Block& block : section.blocks) {
      const auto* plot = std::get_if<report::Plot>(&block);
      if (plot != nullptr && plot->title == "r_1") radius = plot;
    }
  }
  ASSERT_NE(radius, nullptr);
  EXPECT_EQ(radius->y_label, "error [mm]");
  // Four variants estimate it: two seeds and two lines of three sigma each.
  ASSERT_EQ(radius->series.size(), 16u);
  const RunResult& run = result.runs[0].result;
  const auto track =
      std::find_if(run.calibration.begin(), run.calibration.end(),
                   [](const CalibrationTrack& candidate) { return candidate.name == "r_1"; });
  EXPECT_NEAR(radius->series[0].y.back(), 1e3 * (track->estimate.back() - track->truth), 1e-5);
  EXPECT_EQ(radius->series[2].dash, report::Dash::kDotted);
  EXPECT_NEAR(radius->series[2].y.back(), -3e3 * track->sigma.back(), 0.1 * track->sigma.back());
}

}  // namespace
}  // namespace viwo

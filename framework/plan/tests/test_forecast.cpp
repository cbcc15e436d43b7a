// What is forecast, against what a filter then knows.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "plan_files.hpp"
#include "viwo/config/overrides.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/plan/forecast.hpp"
#include "viwo/run/run.hpp"
#include "viwo/setup/calibration_values.hpp"
#include "viwo/setup/configuration.hpp"

namespace viwo {
namespace {

using plan::Forecast;
using plan::Forecaster;
using plan::Information;
using testing::own_folder;
using testing::written;

/// The robot of configs/runs/viwo_swerve.yaml.
plan::PlanSetup plan_of_swerve() {
  const auto file =
      written(own_folder() / "plan.yaml",
              "plan: swerve\nbase_radius_m: 0.2\nfloor_x_m: 3\nfloor_y_m: 3\n"
              "sigma_gyro_rad_per_s_sqrt_hz: 1.6968e-4\ngoals: {r: 0.05 %, delta_o: 0.00002}\n"
              "kinematics: {type: four_wis_wid, x_m: [0.1125, -0.1125, -0.1125, 0.1125],\n"
              "  y_m: [0.1125, 0.1125, -0.1125, -0.1125], radius_m: 0.0255,\n"
              "  prior_sigma_radius_m: 0.000255, prior_sigma_position_m: 0.01,\n"
              "  prior_sigma_steer_offset_rad: 0.01, sigma_drive_rad_per_s: 0.001,\n"
              "  sigma_steer_rad: 0.001, sigma_lateral_m_per_s: 0.001}\n");
  return plan::read_plan_setup(file, {}, testing::registry());
}

struct Known {
  std::vector<std::string> names;
  Eigen::MatrixXd P;
};

Known known_by(const Filter& filter) {
  const CalibrationFile file = calibration_file_of(filter);
  Known known;
  std::vector<double> sigma;
  for (const CalibrationEntry& entry : file.intrinsics) {
    if (!(entry.sigma > 0.)) continue;
    known.names.push_back(entry.name);
    sigma.push_back(entry.sigma);
  }
  const auto n = static_cast<Eigen::Index>(sigma.size());
  const Eigen::VectorXd s = Eigen::Map<const Eigen::VectorXd>(sigma.data(), n);
  const auto first = std::find(file.correlations.entries.begin(), file.correlations.entries.end(),
                               known.names.front()) -
                     file.correlations.entries.begin();
  known.P = s.asDiagonal() * file.correlations.matrix.block(first, first, n, n) * s.asDiagonal();
  return known;
}

/// A filter at work, and what it knows after 10 and after 20 s.
struct Drive {
  RunSetup setup;
  RunData data;
  Known at_10_s, at_20_s;
  std::int64_t begin_ns = 0;
};

Drive driven(const std::string& motion, bool with_cameras) {
  config::Node node = config::load_file(testing::configuration("runs/viwo_swerve.yaml"));
  config::set_path(node, "sensors.simulator0.duration_s", config::Node::scalar_of("20.5"));
  config::set_path(node, "updates.visual_features.enabled",
                   config::Node::scalar_of(with_cameras ? "true" : "false"));
  Drive run;
  run.setup = read_run(resolve_placeholders(node, {{"motion", motion}}), testing::registry());
  run.data = collect(run.setup);
  RunHooks hooks;
  hooks.on_estimate = [&](double t_s, const Filter& filter) {
    if (run.at_10_s.names.empty() && t_s >= 10.) run.at_10_s = known_by(filter);
    if (run.at_20_s.names.empty() && t_s >= 20.) run.at_20_s = known_by(filter);
  };
  const RunResult result = run_filter(run.setup, run.data, hooks);
  run.begin_ns = result.pieces.front().begin_ns;
  return run;
}

/// The most that sigmas of a forecast lie below, and above, those that a filter then has.
struct Off {
  double below = 0., above = 0.;
};

Off off(const Intrinsics& forecast, const Eigen::MatrixXd& then, const WheelModel& model,
        const std::string& stem) {
  Off out;
  Eigen::Index k = 0;
  for (int i = 0; i < forecast.size(); ++i) {
    if (!(forecast[i] > 0.)) continue;
    const double ratio = forecast[i] / std::sqrt(then(k, k));
    ++k;
    if (!model.description().intrinsics[static_cast<std::size_t>(i)].name.starts_with(stem))
      continue;
    out.below = std::max(out.below, 1. / ratio);
    out.above = std::max(out.above, ratio);
  }
  return out;
}

TEST(Forecast, IsWhatAFilterThenKnows) {
  Forecaster forecaster(plan_of_swerve());
  plan::WheelInformation& wheels = forecaster.wheels();
  const WheelModel& model = wheels.model();
  for (const bool with_cameras : {false, true}) {
    for (const char* motion : {"figure_eight", "icr_sweep"}) {
      const Drive run = driven(motion, with_cameras);
      forecaster.of(run.at_10_s.names, run.at_10_s.P);
      Information drive = wheels.of(run.data.wheels(), run.begin_ns + 10'000'000'000,
                                    run.begin_ns + 20'000'000'000);
      const Eigen::MatrixXd& then = run.at_20_s.P;
      // Wheels and gyro tell the zeros: 1 % off. Of lengths the accelerometer and cameras tell
      // more, which is not promised.
      const Intrinsics forecast = wheels.sigma(drive);
      EXPECT_LT(off(forecast, then, model, "").below, 1.02) << motion;
      EXPECT_LT(off(forecast, then, model, "delta_o").above, with_cameras ? 1.3 : 1.02) << motion;
      // Nothing, or twice as much, would be seen.
      const Intrinsics before = wheels.sigma(Information::zero(model.n_intrinsics()));
      EXPECT_GT(off(before, then, model, "delta_o").above, 1.3) << motion;
      EXPECT_GT(off(wheels.sigma(drive *= 2.), then, model, "").below, 1.02) << motion;
    }
  }
}

TEST(Forecast, NamesWhatIsMissingAndWhatWouldTellIt) {
  Forecaster forecaster(plan_of_swerve());
  const Drive run = driven("figure_eight", true);
  const Forecast forecast = forecaster.of(run.at_10_s.names, run.at_10_s.P);
  EXPECT_FALSE(forecast.is_enough());
  EXPECT_FALSE(forecast.piece.empty());
  EXPECT_GT(forecast.sigma, forecast.goal);
  EXPECT_LT(forecast.sigma_after, forecast.sigma);
  EXPECT_THAT(text_of(forecast), ::testing::HasSubstr(" after another '" + forecast.piece + "'"));
  const Forecast enough = forecaster.of(run.at_10_s.names, 1e-4 * run.at_10_s.P);
  EXPECT_TRUE(enough.is_enough());
  EXPECT_THAT(text_of(enough), ::testing::StartsWith("enough: "));
}

TEST(Forecast, RefusesAnotherBase) {
  Forecaster forecaster(testing::differential_plan());
  EXPECT_THAT([&] { forecaster.of(std::vector<std::string>{"r_1"}, Eigen::MatrixXd::Ones(1, 1)); },
              ::testing::ThrowsMessage<InputError>(
                  "the plan is for another base: it has no intrinsic 'r_1'"));
  EXPECT_THAT(
      [&] { forecaster.of(std::vector<std::string>{"baseline"}, Eigen::MatrixXd::Ones(1, 1)); },
      ::testing::Throws<InputError>());
}

}  // namespace
}  // namespace viwo

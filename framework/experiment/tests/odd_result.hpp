// A run with one of everything.
#pragma once

#include <limits>

#include "viwo/run/run_result.hpp"

namespace viwo::testing {

/// A result with one of everything, and with numbers that text does not carry.
inline RunResult odd_result() {
  RunResult run;
  run.status = RunStatus::kDiverged;
  run.cause = "a \"cause\",\nof two lines";
  run.epochs = 7;
  run.duration_s = 0.1;
  run.wall_s = 1e-300;
  run.estimate = {{-5, {0.1, -0., 1. / 3.}, Eigen::Quaterniond(0.5, -0.5, 0.5, 0.1)}};
  run.reference = run.estimate;
  run.accuracy.emplace();
  run.accuracy->alignment = eval::Alignment::kSe3;
  run.accuracy->ate_m = std::numeric_limits<double>::infinity();
  run.accuracy->rpe = {{10., 3, 0.1, 0.2, 0.3, 0.4}};
  run.accuracy->series = {{0., 0.1}, {0., 1.}, {0.3, 0.4}, {0.1, 0.2}};
  run.nees_planar = 3.3;
  run.total.g = {0.7, 0.1, 0.2};
  run.total.samples = 11;
  run.epoch_ms = {{0.1, 0.2}};
  run.stages = {{"propagate", {0.1, 0.2, 0.3}}};
  run.total_ms = {0.4, 0.5, 0.6};
  run.rejections = {{"wheels0", {"late", 3, "odom.csv:17"}}};
  run.nees.pose = std::numeric_limits<double>::quiet_NaN();
  run.nees.series = {{0.1, 6.1}};
  run.errors = {{0.1, {0.1, 0.2, 0.3}, {0.4, 0.5, 0.6}, 0.7, 0.8}};
  run.epoch_t_s = {0., 0.1};
  run.calibration = {{"r_1", "m", {0.1, 0.2}, {0.3, 0.4}, 0.5, 0.6}};
  run.updates = {{"parity", {8, 9}, {1, 2}, {3, 4}, {2, true, "lost"}}};
  run.monitor.t_s = {0.5};
  run.monitor.parameters = {"r_1"};
  run.monitor.sigma_ratio = {{0.25}};
  run.monitor.held = {1};
  run.monitor.warnings = {{0.5, "turn", {"r_1"}}};
  return run;
}

}  // namespace viwo::testing

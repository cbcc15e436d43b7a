// The simulated robot of the paper, far from where its filter begins.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "registry.hpp"
#include "viwo/config/overrides.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/setup/configuration.hpp"
#include "viwo/smoother/smoother.hpp"

namespace viwo::testing {

inline config::Node swerve_run(std::uint64_t seed, const std::string& motion,
                               const std::vector<std::string>& assignments = {}) {
  config::Node run =
      config::load_file(std::string(VIWO_TEST_SOURCE_DIR) + "/configs/runs/viwo_swerve.yaml");
  std::vector<std::string> all{"sensors.simulator0.duration_s=20", "seed=" + std::to_string(seed)};
  all.insert(all.end(), assignments.begin(), assignments.end());
  for (const std::string& text : all) {
    const config::Assignment one = config::parse_assignment(text);
    config::set_path(run, one.path, one.value);
  }
  return resolve_placeholders(run, {{"motion", motion}});
}

/// Truth 0.1 rad, 5 % and 1 cm from nominal, one sigma each.
inline std::vector<std::string> far_away() {
  std::vector<std::string> out{"wheels.sigma_R_ItoO_rad=[0.05, 0.05, 0.05]"};
  for (const std::string robot : {"kinematics", "sensors.simulator0.robot"}) {
    out.push_back(robot + ".prior_sigma_steer_offset_rad=0.1");
    out.push_back(robot + ".prior_sigma_radius_m=0.0013");
  }
  return out;
}

inline std::vector<CalibrationEntry> entries_of(const CalibrationFile& file) {
  std::vector<CalibrationEntry> all;
  for (const auto* section : {&file.intrinsics, &file.mount, &file.clock}) {
    for (const CalibrationEntry& entry : *section) {
      if (entry.sigma > 0.) all.push_back(entry);
    }
  }
  return all;
}

/// Mean square of the errors in sigmas; `truth` has the names and the true values.
inline double mean_square(const CalibrationFile& file, const RunResult& truth) {
  double sum = 0.;
  const std::vector<CalibrationEntry> entries = entries_of(file);
  for (const CalibrationEntry& entry : entries) {
    const auto track = std::find_if(truth.calibration.begin(), truth.calibration.end(),
                                    [&](const auto& one) { return one.name == entry.name; });
    sum += std::pow((entry.estimate - track->truth) / entry.sigma, 2);
  }
  return sum / static_cast<double>(entries.size());
}

inline RunResult filtered(const config::Node& run) {
  RunSetup setup = read_run(run, registry());
  return run_filter(setup, collect(setup));
}

inline smoother::Smoothed smoothed(const std::vector<config::Node>& runs) {
  std::vector<smoother::Input> inputs;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    inputs.push_back({"recording '" + std::to_string(i + 1) + "'", runs[i]});
  }
  return smoother::smooth(inputs, registry());
}

}  // namespace viwo::testing

// Calibrations of a simulated swerve robot whose true intrinsics are drawn.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "motion_reference.hpp"
#include "simulated.hpp"
#include "viwo/calibration/calibrate.hpp"
#include "viwo/sim/encoder_simulator.hpp"
#include "viwo/wheel/held_gauge.hpp"

namespace viwo::testing {

inline calibration::CalibrationSetup setup_of(const std::vector<std::string>& motions,
                                              std::uint64_t seed,
                                              const std::vector<std::string>& assignments = {}) {
  calibration::CalibrationSetup setup;
  setup.name = "test";
  setup.options.segments = calibration::Segments::kLength;
  setup.options.segment_s = 2.;
  setup.options.estimate_extrinsics = true;
  for (const std::string& motion : motions) {
    auto all = assignments;
    all.emplace_back("sensors.simulator0.true_intrinsics_scale=1");
    all.emplace_back("odometry.twist=noise_weighted");
    all.emplace_back("sensors.simulator0.repetition=" + std::to_string(setup.recordings.size()));
    RunSetup run = read_run(simulated(motion, all), registry(), seed);
    RunData data = collect(run);
    const Recording label{motion, {{"motion", motion}}};
    calibration::MotionReference reference =
        motion_reference(label, run, data, setup.options.reference);
    setup.recordings.push_back({label, std::move(run), std::move(data), std::move(reference)});
  }
  return setup;
}

inline calibration::CalibrationEstimate fit_of(const calibration::CalibrationSetup& setup,
                                               const std::vector<std::size_t>& used) {
  return fit(setup, used, setup.options, start_of(setup, {}));
}

inline calibration::CalibrationEstimate fit_all(const calibration::CalibrationSetup& setup) {
  return fit_of(setup, all_of(setup));
}

/// The true intrinsics of the simulated robot, and in R_ItoO, p_IinO the reference body, in the
/// frame that the gauge holds: the sensor's seed is 1000 times the run's.
inline WheelsView truth_of(const calibration::CalibrationSetup& setup, std::uint64_t seed) {
  const WheelModel& model = *setup.recordings[0].setup.model;
  WheelsView truth;
  truth.x_WI = sim::perturbed_intrinsics(model.description(), 1., 1000 * seed);
  move_to_held_gauge(model, model.nominal(), truth);  // bases without a gauge stay as they are
  return truth;
}

}  // namespace viwo::testing

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

/// True intrinsics of the simulated robot: the sensor's seed is 1000 times the run's.
inline Intrinsics truth_of(const calibration::CalibrationSetup& setup, std::uint64_t seed) {
  return sim::perturbed_intrinsics(setup.recordings[0].setup.model->description(), 1., 1000 * seed);
}

}  // namespace viwo::testing

// The parts of a run's page; each adds its section, or nothing when the run has nothing for it.
#pragma once

#include "viwo/report/document.hpp"
#include "viwo/run/run.hpp"

namespace viwo {

// Colours of all plots of the page, as indices into the palette.
inline constexpr int kEstimateColour = 0;
inline constexpr int kSecondColour = 1;

/// What cameras, trajectory and calibration looked like at some instants.
void add_picture_section(const RunResult& result, report::Document& document);

/// Position and yaw error with their bands, and the NEES with its bounds.
void add_error_section(const RunResult& result, report::Document& document);

/// Every estimated parameter of the wheels over time, and where it ended.
void add_calibration_section(const RunResult& result, report::Document& document);

/// What the monitor found about the motion.
void add_excitation_section(const RunResult& result, report::Document& document);
void add_noise_section(const RunResult& result, report::Document& document);

/// What updates and gates took and refused, and what sensors and estimator did not use.
void add_measurements_section(const RunResult& result, report::Document& document);

/// Time per stage and per epoch.
void add_time_section(const RunResult& result, report::Document& document);

}  // namespace viwo

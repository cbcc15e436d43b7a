// The plots on the page of an experiment.
#pragma once

#include <vector>

#include "viwo/experiment/experiment.hpp"
#include "viwo/report/document.hpp"

namespace viwo::experiment {

/// For each recording: trajectories, errors with their three sigma, consistency.
std::vector<report::Section> recording_sections(const ExperimentResult& result);

/// How much of the prior sigmas is left at the end: observability by motion and model.
std::vector<report::Block> sigma_ratio_maps(const ExperimentResult& result);

/// Errors of the calibration parameters over time, of the first motion.
std::vector<report::Block> calibration_plots(const ExperimentResult& result);

/// Mean time per epoch of the stages of each variant; nothing without a filter.
std::vector<report::Block> stage_plots(const ExperimentResult& result);

/// What a recording is called: its first label that the tables are broken down by, or its name.
const std::string& motion_of(const ExperimentSetup& setup, const Recording& recording);

/// The number with five significant digits: a page need not carry more.
double rounded(double value);

}  // namespace viwo::experiment

#include "by_smoother.hpp"

#include <algorithm>

#include "recording_name.hpp"
#include "undetermined.hpp"

namespace viwo::calibration {

smoother::Smoothed smooth(const CalibrationSetup& setup, const std::vector<std::size_t>& recordings,
                          WorkProgress& progress) {
  std::vector<smoother::Input> inputs;
  for (const std::size_t i : recordings) {
    const CalibrationRecording& recording = setup.recordings[i];
    inputs.push_back({name_of(recording.label), recording.run});
  }
  return smoother::smooth(inputs, *setup.plugins, progress);
}

CalibrationEstimate estimate_of(const smoother::Smoothed& smoothed, const CalibrationSetup& setup) {
  const auto& specs = setup.recordings.front().setup.model->description().intrinsics;
  const CalibrationFile& file = smoothed.calibration;
  CalibrationEstimate out;
  const auto n = static_cast<Eigen::Index>(specs.size());
  out.x_WI = out.sigma = out.prior_sigma = Intrinsics::Zero(n);
  out.correlations = Eigen::MatrixXd::Zero(n, n);
  out.extrinsics = setup.options.extrinsics_x_m_y_m_yaw_rad;
  std::vector<int> free;
  std::vector<Eigen::Index> known;  // where they stand among the correlations
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const CalibrationEntry* const entry = find(file.intrinsics, specs[i].name);
    if (entry == nullptr) {
      throw InputError(setup.name +
                       ": reference: smoother, but no update of the base takes wheels");
    }
    const auto k = static_cast<Eigen::Index>(i);
    out.x_WI[k] = entry->estimate;
    out.sigma[k] = entry->sigma;
    if (!(entry->sigma > 0.)) continue;
    free.push_back(static_cast<int>(i));
    out.prior_sigma[k] = specs[i].prior_sigma;
    const auto& names = file.correlations.entries;
    known.push_back(std::find(names.begin(), names.end(), entry->name) - names.begin());
  }
  if (free.empty()) {
    throw InputError(setup.name + ": reference: smoother, but the base estimates no intrinsics");
  }
  const Eigen::MatrixXd correlations = file.correlations.matrix(known, known);
  out.correlations(free, free) = correlations;
  Eigen::VectorXd ratio(static_cast<Eigen::Index>(free.size()));
  for (std::size_t i = 0; i < free.size(); ++i) {
    ratio[static_cast<Eigen::Index>(i)] =
        out.sigma[free[i]] / specs[static_cast<std::size_t>(free[i])].prior_sigma;
  }
  out.undetermined =
      undetermined_of(ratio.asDiagonal() * correlations * ratio.asDiagonal(),
                      Eigen::MatrixXd::Identity(ratio.size(), ratio.size()), free, specs);
  out.residuals = static_cast<int>(smoothed.residuals);
  // What each factor tells is in the covariance: nothing is counted.
  out.unknowns = out.parity_directions = static_cast<int>(free.size());
  out.iterations = smoothed.iterations;
  out.converged = smoothed.converged;
  return out;
}

}  // namespace viwo::calibration

#include "by_smoother.hpp"

#include <Eigen/Cholesky>

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
  std::vector<std::string> names;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const CalibrationEntry* const entry = find(file.intrinsics, specs[i].name);
    const CalibrationEntry* const before = find(smoothed.before.intrinsics, specs[i].name);
    if (entry == nullptr || before == nullptr) {
      throw InputError(setup.name +
                       ": reference: smoother, but no update of the base takes wheels");
    }
    const auto k = static_cast<Eigen::Index>(i);
    out.x_WI[k] = entry->estimate;
    out.sigma[k] = entry->sigma;
    if (!(entry->sigma > 0.)) continue;
    free.push_back(static_cast<int>(i));
    names.push_back(entry->name);
    out.prior_sigma[k] = before->sigma;
  }
  if (free.empty()) {
    throw InputError(setup.name + ": reference: smoother, but the base estimates no intrinsics");
  }
  const Eigen::MatrixXd correlations = file.correlations.among(names);
  out.correlations(free, free) = correlations;
  const Eigen::VectorXd ratio = out.sigma(free).cwiseQuotient(out.prior_sigma(free));
  // In what was known before, which hangs together where the gauge holds entries.
  const Eigen::MatrixXd root = smoothed.before.correlations.among(names).llt().matrixL();
  const Eigen::MatrixXd to_white =
      root.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd(ratio.asDiagonal()));
  out.undetermined =
      undetermined_of(to_white * correlations * to_white.transpose(), root, free, specs);
  out.residuals = static_cast<int>(smoothed.residuals);
  // What each factor tells is in the covariance: nothing is counted.
  out.unknowns = out.parity_directions = static_cast<int>(free.size());
  out.iterations = smoothed.iterations;
  out.converged = smoothed.converged;
  return out;
}

}  // namespace viwo::calibration

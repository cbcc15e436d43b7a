// Sum of the normal equations of many features, each with its point eliminated.
#pragma once

#include <Eigen/Core>

#include "calibration_sums.hpp"
#include "feature.hpp"
#include "point_fit.hpp"
#include "viwo/api/update.hpp"
#include "window.hpp"

namespace viwo::visual {

class NormalEquations {
 public:
  /// Allocates.
  void start(int max_clones, int n_cameras);

  /// Takes the feature in: its normal matrix by the point, and the parts of its residual. False
  /// when the matrix has no usable inverse or something is not finite; then the feature must not
  /// be added.
  bool prepare(const Feature& feature);

  /// Chi-square of the prepared feature if the window were known exactly: an upper bound of that
  /// of the gate (chi2_gate.hpp).
  double chi2_bound() const { return fit_.chi2; }
  /// The same of the part of it that a velocity of the point explains.
  double motion_bound() const { return fit_.chi2_of_motion; }

  /// Starts a factor: `factor.columns` of the window, zero Lambda and eta.
  void begin(const Window& window, InformationFactor& factor);
  /// Adds the prepared feature.
  void add(const Feature& feature, const Window& window, InformationFactor& factor);
  /// After the last feature: what is still waiting.
  void finish(const Window& window, InformationFactor& factor);

 private:
  static constexpr int kPointSize = 3;
  void subtract_waiting(int size, InformationFactor& factor);

  PointFit fit_;  ///< of the prepared feature

  CalibrationSums calibration_;
  // Points waiting to be subtracted: Lambda -= W W^T, eta -= W y. Many at once are one matrix
  // product; not so many that Eigen's product would need the heap for its work space.
  Eigen::MatrixXd W_;
  Eigen::VectorXd y_;
  int n_waiting_ = 0;
  int max_waiting_ = 0;
};

}  // namespace viwo::visual

// Sum of the normal equations of many features, each with its point eliminated, and the
// chi-square of one feature.
#pragma once

#include <Eigen/Core>

#include "feature.hpp"
#include "viwo/api/update.hpp"
#include "window.hpp"

namespace viwo::visual {

class NormalEquations {
 public:
  /// Allocates for factors of up to `max_columns`, `max_calibration` of them of cameras, and
  /// features of up to `max_sights` observations.
  void start(int max_columns, int max_calibration, int max_sights);

  /// Takes the feature in: its normal matrix by the point, and the parts of its residual. False
  /// when the matrix has no usable inverse or something is not finite; then the feature must not
  /// be added.
  bool prepare(const Feature& feature);

  /// Chi-square of the prepared feature if the window were known exactly: an upper bound of
  /// chi2().
  double chi2_bound() const { return chi2_bound_; }
  /// Chi-square of the residual outside of what the point explains, with the covariance of the
  /// window. Infinity when the covariance is not positive definite.
  double chi2(const Feature& feature, Window& window);

  /// Starts a factor: `factor.columns` of the window, zero Lambda and eta.
  void begin(const Window& window, InformationFactor& factor);
  /// Adds the prepared feature.
  void add(const Feature& feature, const Window& window, InformationFactor& factor);
  /// After the last feature: the part of the eliminated points that is still waiting.
  void finish(InformationFactor& factor);

 private:
  static constexpr int kPointSize = 3;
  void add_calibration(const Feature& feature, const Window& window, InformationFactor& factor,
                       int waiting_column);
  /// Rows of one sight by the calibration columns, into E_.
  void calibration_rows(const LinearSight& row, const WindowCamera& camera, int at, int columns);

  // Of the prepared feature.
  Eigen::Matrix3d L_ff_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d y_f_ = Eigen::Vector3d::Zero();
  double chi2_bound_ = 0.;

  // Points waiting to be subtracted: Lambda -= W W^T, eta -= W y. Many at once are one matrix
  // product; not so many that Eigen's product would need the heap for its work space.
  Eigen::MatrixXd W_;
  Eigen::VectorXd y_;
  int n_waiting_ = 0;
  int max_waiting_ = 0;

  // Of the gate.
  Eigen::MatrixXd S_;
  Eigen::Matrix<double, Eigen::Dynamic, 4> rhs_;  ///< residual, H_f
  Eigen::Matrix<double, Eigen::Dynamic, 2> PHt_;
  Eigen::MatrixXd E_, T_;
};

}  // namespace viwo::visual

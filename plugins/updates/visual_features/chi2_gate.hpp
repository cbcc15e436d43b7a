// Chi-square of a feature under the covariance of the window and of the calibration.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "feature.hpp"
#include "point_fit.hpp"
#include "viwo/api/noise_scale.hpp"
#include "window.hpp"

namespace viwo::visual {

class Chi2Gate {
 public:
  /// Allocates.
  void start(int max_clones, int n_cameras);

  /// A new epoch: covariances are read again when they are needed.
  void begin() { has_covariance_ = false; }

  /// Of the residual of a linearised feature outside of what its point explains. Infinity when the
  /// covariance is not positive definite.
  double chi2(const Feature& feature, Window& window);
  /// The part of it that a velocity of the point explains. After chi2(), when that was finite.
  double chi2_of_motion() const { return fit_.chi2_of_motion; }
  /// Tells what the residual of a feature, that chi2() was asked for last and was finite, says of
  /// the noise (VF-21).
  void tell(NoiseScale& noise);

 private:
  /// Rows of the feature's sights of one camera.
  struct Camera {
    std::vector<int> sights;
    Eigen::Matrix<double, Eigen::Dynamic, kCalibrationRows> E;
  };

  void read_covariance(Window& window);
  void add_poses(const Feature& feature, Window& window);
  void add_calibration(const Feature& feature, const Window& window);
  void add_pair(const Feature& feature, int a, int b);
  std::size_t pair(int a, int b) const {
    return static_cast<std::size_t>(a) * cameras_.size() + static_cast<std::size_t>(b);
  }

  std::vector<Camera> cameras_;
  // Covariances of the calibration errors of cameras, zero where they are held.
  std::vector<Eigen::Matrix<double, kCalibrationRows, kCalibrationRows>> P_kk_;  ///< by pair
  std::vector<Eigen::Matrix<double, Eigen::Dynamic, kCalibrationRows>> P_xk_;    ///< by camera
  bool has_covariance_ = false;
  Eigen::Matrix<double, Eigen::Dynamic, kCalibrationRows> T_;
  Eigen::MatrixXd S_, M_;
  Eigen::Matrix<double, Eigen::Dynamic, 7> rhs_;  ///< H_f, t H_f D, residual, whitened
  int n_rows_ = 0;                                ///< of the feature asked for last
  PointFit fit_;                                  ///< of the same
  Eigen::MatrixXd L_inverse_, M_of_noise_;
  Eigen::Matrix<double, Eigen::Dynamic, 2> PHt_;
};

}  // namespace viwo::visual

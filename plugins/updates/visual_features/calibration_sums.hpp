// What the sights of an epoch say of the calibration of their cameras. Each sight has columns of
// its own camera only, so that the sums are small blocks of fixed size, put into the factor once.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "feature.hpp"
#include "viwo/api/update.hpp"
#include "window.hpp"

namespace viwo::visual {

class CalibrationSums {
 public:
  /// Allocates.
  void start(int max_clones, int n_cameras);
  /// Zero sums.
  void begin(const Window& window);
  /// Adds the sights of a feature; adds to `A_xf` (rows as the factor's columns) what they give by
  /// the point.
  void add(const Feature& feature, const Window& window, Eigen::Ref<Eigen::MatrixXd> A_xf);
  /// Adds the sums to the lower triangle of the factor.
  void finish(const Window& window, InformationFactor& factor) const;

 private:
  struct Camera {
    Eigen::Matrix<double, kCalibrationRows, kCalibrationRows> EE;  ///< with the residual: (E, r)
    Eigen::Matrix<double, kCalibrationRows, 3> EF;                 ///< of the feature at hand
    std::vector<Eigen::Matrix<double, kCalibrationRows, kPoseSize>> EX;  ///< by clone
    bool seen = false;                                                   ///< by that feature
  };

  std::vector<Camera> cameras_;
};

}  // namespace viwo::visual

// The least squares of a start from cameras and IMU: states at the keys, points and calibration,
// tied by what the IMU and the cameras have measured. Equations (F-36) of docs/math/filter.md.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "linear_start.hpp"
#include "visual_window.hpp"
#include "viwo/filter/propagation.hpp"

namespace viwo {

struct VisualEstimate {
  std::vector<ImuState> keys;
  std::vector<Eigen::Vector3d> points;  ///< x/z, y/z, 1/z in the camera of the first sight
  Eigen::VectorXd calibration;          ///< of each camera, in prior sigmas
};

/// Normal equations of keys, then calibration. Points, each of which meets no other, are eliminated
/// and follow from the rest.
struct VisualNormals {
  Eigen::MatrixXd H;  ///< lower triangle
  Eigen::VectorXd b;
  double cost = 0.;
  double imu_cost = 0.;      ///< its part of the IMU
  double sight_cost = 0.;    ///< its part of the sights that are not far off ...
  std::size_t n_sights = 0;  ///< ... and their number
  std::vector<Eigen::Matrix3d> point_inverse;
  std::vector<Eigen::Matrix<double, 3, Eigen::Dynamic>> point_with;
  std::vector<Eigen::Vector3d> point_b;
  std::vector<double> track_cost;  ///< mean square of the sights, in sigmas
};

class VisualProblem {
 public:
  /// Both must outlive it.
  VisualProblem(const VisualWindow& window, const VisualStartOptions& options);

  Eigen::Index imu_columns() const {
    return kImuSize * static_cast<Eigen::Index>(window_.keys.size());
  }
  Eigen::Index size() const {
    return imu_columns() + kCalibration * static_cast<Eigen::Index>(options_.cameras.size());
  }

  VisualEstimate initial(const LinearStart& linear, const Eigen::Vector3d& gyro_bias) const;
  /// At `x`, with sights of noise `sigma_px`.
  VisualNormals linearise(const VisualEstimate& x, double sigma_px) const;
  /// `dx`: of keys and calibration; `n`: the equations that it solves.
  VisualEstimate moved(const VisualEstimate& x, const Eigen::VectorXd& dx,
                       const VisualNormals& n) const;

 private:
  /// Columns of a camera's calibration: rotation, position, intrinsics, clock; in prior sigmas.
  static constexpr Eigen::Index kCalibration = 15;

  struct Prediction {
    ImuState state;
    ImuTransition transition;
  };
  /// The Jacobian of a sight by all columns that it has.
  struct Row {
    Eigen::Index key = 0, anchor = 0, calibration = 0, clock = 0;
    Eigen::Matrix<double, 2, 6> of_key, of_anchor;
    Eigen::Matrix<double, 2, kCalibration - 1> of_calibration;
    Eigen::Vector2d of_clock;
    Eigen::Matrix<double, 2, 3> of_point;
    Eigen::Vector2d r;
  };

  Prediction predict(const ImuState& from, std::size_t to) const;
  /// Of the biases at the first key and of the calibration. Yaw and position of the last key are
  /// held: nothing measures them.
  void add_priors(const VisualEstimate& x, VisualNormals& n) const;
  void add_imu(const VisualEstimate& x, std::size_t k, VisualNormals& n) const;
  void add_track(const VisualEstimate& x, std::size_t i, double sigma_px, VisualNormals& n) const;
  /// Adds a sight to the lower triangle. Key and anchor may be one.
  static void add_row(const Row& row, double weight, VisualNormals& n);
  /// False: the camera does not see the point at all.
  bool sight_row(const VisualEstimate& x, std::size_t i, const StartSight& sight, Row& row) const;
  /// Camera with the calibration as it is estimated.
  CameraView camera_at(const VisualEstimate& x, std::size_t c) const;
  Eigen::Index clock_column(std::size_t c) const {
    return imu_columns() + kCalibration * static_cast<Eigen::Index>(clocks_[c]) + kCalibration - 1;
  }
  double clock_sigma(std::size_t c) const { return options_.cameras[clocks_[c]].sigma_clock_s; }
  Eigen::Vector3d rate_at(std::size_t key) const;

  const VisualWindow& window_;
  const VisualStartOptions& options_;
  std::vector<std::size_t> clocks_;  ///< whose clock each camera has
  Eigen::MatrixXd known_;            ///< inverse of the correlations of the calibration
};

}  // namespace viwo

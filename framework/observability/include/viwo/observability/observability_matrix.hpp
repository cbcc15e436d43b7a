// The observability matrix of a filter along its way: every Jacobian that its updates emit, carried
// back to the first state. Equations: docs/observability.md.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "viwo/estimator/estimator.hpp"

namespace viwo {

/// The one point feature of the analysed state: its bearing from the IMU is seen at every epoch.
struct FeatureOptions {
  bool enabled = true;
  Eigen::Vector3d p_FinI_m = {4., 3., 2.};  ///< where it is in the first IMU frame
  double sigma_bearing_rad = 0.0035;        ///< of each of the two angles: 1 px at f = 286 px
};

/// Watches an estimator (RunnerOptions::frozen) and accumulates (OB-1) .. (OB-3).
///
/// State: inertial state of the start (15, as in filter_view.hpp), then the calibration columns of
/// the filter that have a prior variance, then the feature (3). The clone of the start, six more
/// columns tied to the inertial state, is left out: it adds as much to the rank as to the size. So
/// are blocks that come and go (landmarks): of a factor that has them the part counts that they do
/// not enter.
class ObservabilityMatrix final : public EstimatorObserver {
 public:
  static constexpr int kCloneSize = kPoseSize;  ///< size of the clone that is left out

  /// `filter` is initialised and has not moved yet.
  ObservabilityMatrix(const Filter& filter, const FeatureOptions& feature);

  void on_clone(const Filter& filter, const ImuMatrix& Phi) override;
  void on_factor(const Filter& filter, const UpdateEntry& update,
                 const ResidualFactor& factor) override;
  void on_factor(const Filter& filter, const UpdateEntry& update,
                 const InformationFactor& factor) override;

  int size() const { return static_cast<int>(prior_sigma_.size()); }
  /// The filter's columns that the state's columns kImuSize .. stand for.
  const std::vector<int>& calibration_columns() const { return calibration_; }
  /// The state's column of a column of the filter; -1: not estimated, or of a later clone.
  int state_column(int filter_column) const {
    return filter_column < 0 ? -1 : column_of_[static_cast<std::size_t>(filter_column)];
  }
  /// Where the feature starts in the state; -1: none.
  int feature_column() const { return feature_.enabled ? size() - 3 : -1; }
  const Eigen::Vector3d& p_FinG() const { return p_FinG_; }
  /// Prior sigmas of the state's columns (of the feature: 1 m), for scaling.
  const Eigen::VectorXd& prior_sigma() const { return prior_sigma_; }

  /// Inertial state of the start.
  const ImuState& start() const { return start_; }

  /// Triangular R with R^T R = M^T M, M in units of the noise: size() x size().
  Eigen::MatrixXd triangle();

 private:
  void set_carry(const FactorColumns& columns);
  /// Rows of a factor's own columns, in units of its noise.
  void add_factor(const FactorColumns& columns, const Eigen::MatrixXd& rows);
  void add_rows(const Eigen::MatrixXd& rows);
  void add_bearing(const CloneState& clone);
  void compress();

  FeatureOptions feature_;
  ImuState start_;
  std::vector<int> calibration_;
  std::vector<int> column_of_;    // of the state, per column of the filter; -1: none
  std::vector<bool> is_in_room_;  // per column of the filter: of a block that comes and goes
  Eigen::VectorXd prior_sigma_;
  Eigen::Vector3d p_FinG_ = Eigen::Vector3d::Zero();
  ImuMatrix Phi_ = ImuMatrix::Identity();                              // from the start to now
  std::vector<Eigen::Matrix<double, kPoseSize, kImuSize>> clone_Phi_;  // per slot
  Eigen::MatrixXd carry_;  // d (columns of a factor) / d state
  Eigen::MatrixXd rows_;   // triangle on top, new rows below
  int n_rows_ = 0;
};

}  // namespace viwo

// How sure a filter is along some directions of its calibration, over time.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "viwo/observability/observability.hpp"
#include "viwo/observability/observability_matrix.hpp"

namespace viwo::observability {

/// Watches an estimator and keeps the covariance of its calibration every few epochs. Also tells a
/// second observer, if there is one.
class CovarianceTrack final : public EstimatorObserver {
 public:
  /// `columns` of the filter and their prior sigmas.
  CovarianceTrack(std::vector<int> columns, Eigen::VectorXd prior_sigma,
                  EstimatorObserver* next = nullptr);

  void on_clone(const Filter& filter, const ImuMatrix& Phi) override;
  void on_factor(const Filter& filter, const UpdateEntry& update,
                 const ResidualFactor& factor) override;
  void on_factor(const Filter& filter, const UpdateEntry& update,
                 const InformationFactor& factor) override;

  /// Root mean square sigma along the columns of `hidden` (orthonormal, in units of the prior
  /// sigmas) and along what is orthogonal to them; both begin at 1.
  SigmaOverTime along(const Eigen::MatrixXd& hidden) const;

 private:
  std::vector<int> columns_;
  Eigen::VectorXd prior_sigma_;
  EstimatorObserver* next_;
  int epoch_ = 0;
  std::int64_t begin_ns_ = 0;
  std::vector<double> t_s_;
  std::vector<Eigen::MatrixXd> P_;  // in units of the prior sigmas
};

}  // namespace viwo::observability

// The factors of one pass of a frozen estimator along a given path, as normal equations.
// Equations: docs/math/smoother.md.
#pragma once

#include <vector>

#include "arrow_system.hpp"
#include "path_recorder.hpp"
#include "viwo/estimator/estimator.hpp"

namespace viwo::smoother {

/// Unknowns of a state of the IMU; those of the start come first, then those of each epoch, then
/// blocks that only this recording has.
class FactorCollector final : public EstimatorObserver {
 public:
  /// `column_of`: for each column of blocks in the state, counted from the first one, which unknown
  /// it is, behind the path as `own` or shared; `n_shared` of those.
  FactorCollector(const PathRecorder& run, const ImuState& start, std::size_t epochs,
                  std::vector<int> column_of, int n_shared);

  void on_propagated(const Filter& filter, const ImuTransition& transition) override;
  void on_clone(const Filter& filter, const ImuMatrix& Phi) override;
  void on_factor(const Filter& filter, const UpdateEntry& update,
                 const ResidualFactor& factor) override;
  void on_factor(const Filter& filter, const UpdateEntry& update,
                 const InformationFactor& factor) override;

  ArrowSystem& system() { return system_; }
  /// Where the factors were linearised.
  const GivenPath& path() const { return path_; }
  /// Rows of residual factors, and those that were weighed down.
  long rows() const { return rows_; }
  long weighed_down() const { return weighed_down_; }

 private:
  void collect(const Filter& filter, const FactorColumns& columns);
  int unknown(const Filter& filter, int column) const;

  ArrowSystem system_;
  std::vector<int> column_of_;
  GivenPath path_;
  std::vector<std::size_t> epoch_in_slot_;
  ImuTransition transition_;
  ImuState predicted_;
  std::vector<int> columns_;
  long rows_ = 0, weighed_down_ = 0;
};

/// The error that moves `from` to `to`, in the order of the columns of the inertial state.
Eigen::Matrix<double, kImuSize, 1> difference(const ImuState& to, const ImuState& from);
/// Moves it by such an error.
void retract(const Eigen::Ref<const Eigen::VectorXd>& dx, ImuState& state);

}  // namespace viwo::smoother

// Rows of the sights of one landmark that is in the state.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "anchored_point.hpp"
#include "feature.hpp"
#include "viwo/api/update.hpp"
#include "window.hpp"

namespace viwo::visual {

/// A landmark and where it stands.
struct LandmarkState {
  Eigen::Vector3d value;
  int state_column = 0;
  int factor_column = 0;
  int clone = 0;   ///< of the anchor, in the window
  int camera = 0;  ///< of the anchor
};

class LandmarkRows {
 public:
  /// Allocates for `max_factor_columns`, landmarks included.
  void start(int max_clones, int n_cameras, int max_factor_columns, double sigma_px);
  void set_sigma(double sigma_px) { inverse_sigma_ = 1. / sigma_px; }

  /// False when a camera model has no image of the landmark, or something is not finite.
  bool linearize(std::span<const Sight> sights, const Window& window,
                 const LandmarkState& landmark);

  /// Whether the residual's chi-square, with all that is uncertain, is at most `threshold`.
  bool passes(const Window& window, double threshold);
  int rows() const { return n_rows_; }

  /// Adds to Lambda (lower triangle) and eta.
  void add(InformationFactor& factor);

  // For tests: columns of the factor, rows and residual.
  std::span<const int> columns() const { return columns_; }
  auto H() const { return H_.topLeftCorner(n_rows_, n_columns()); }
  auto residual() const { return residual_.head(n_rows_); }

 private:
  Eigen::Index n_columns() const { return static_cast<Eigen::Index>(columns_.size()); }
  /// Where factor columns from `first` on are among those of the rows.
  int place(int first, int first_state, int count);
  void add_sight(const LinearSight& row, int at, const Window& window,
                 const LandmarkState& landmark, const AnchoredPoint& point);

  double inverse_sigma_ = 1.;
  int n_rows_ = 0;
  std::vector<int> columns_, state_columns_;
  std::vector<int> local_;  ///< of factor columns; -1: not there
  Eigen::MatrixXd H_, PHt_, S_, G_;
  Eigen::VectorXd residual_, white_;
};

}  // namespace viwo::visual

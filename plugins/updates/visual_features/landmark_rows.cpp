#include "landmark_rows.hpp"

#include <algorithm>

#include <Eigen/Cholesky>

namespace viwo::visual {
void LandmarkRows::start(int max_clones, int n_cameras, int max_factor_columns, double sigma_px) {
  set_sigma(sigma_px);
  const int rows = 2 * max_clones * n_cameras;
  const int columns = kPoseSize * max_clones + kCalibrationSize * n_cameras + 3;
  columns_.reserve(static_cast<std::size_t>(columns));
  state_columns_.reserve(static_cast<std::size_t>(columns));
  local_.assign(static_cast<std::size_t>(max_factor_columns), -1);
  H_.setZero(rows, columns);
  PHt_.setZero(columns, rows);
  S_.setZero(rows, rows);
  G_.setZero(columns, columns);
  residual_.setZero(rows);
  white_.setZero(rows);
}

int LandmarkRows::place(int first, int first_state, int count) {
  int& local = local_[static_cast<std::size_t>(first)];
  if (local >= 0) return local;
  local = static_cast<int>(columns_.size());
  for (int k = 0; k < count; ++k) {
    columns_.push_back(first + k);
    state_columns_.push_back(first_state + k);
    H_.col(local + k).head(n_rows_).setZero();
  }
  return local;
}

bool LandmarkRows::linearize(std::span<const Sight> sights, const Window& window,
                             const LandmarkState& landmark) {
  columns_.clear();
  state_columns_.clear();
  n_rows_ = 2 * static_cast<int>(sights.size());
  const WindowClone& clone = window.clone(landmark.clone);
  const CameraView& camera = window.camera(landmark.camera).view;
  const AnchoredPoint point({clone.R_GtoI, camera.R_ItoC, clone.p_IinG, camera.p_IinC},
                            landmark.value);
  bool visible = true;
  for (std::size_t i = 0; visible && i < sights.size(); ++i) {
    LinearSight row;
    visible =
        linearize_sight(window, sights[i], InversePoint::at(point.p_FinG), inverse_sigma_, row);
    if (visible) add_sight(row, 2 * static_cast<int>(i), window, landmark, point);
  }
  for (const int column : columns_) local_[static_cast<std::size_t>(column)] = -1;
  return visible && residual_.head(n_rows_).allFinite() && H().allFinite();
}

void LandmarkRows::add_sight(const LinearSight& row, int at, const Window& window,
                             const LandmarkState& landmark, const AnchoredPoint& point) {
  residual_.segment<2>(at) = row.residual;
  const auto rows_at = [&](int column, int count) { return H_.block(at, column, 2, count); };
  const auto place_clone = [&](int factor_column) {
    return place(factor_column, window.state_column(factor_column), kPoseSize);
  };
  const WindowClone& clone = window.clone(row.clone);
  const WindowClone& anchor = window.clone(landmark.clone);
  auto by_clone = rows_at(place_clone(row.column), kPoseSize);
  auto by_anchor = rows_at(place_clone(anchor.column), kPoseSize);
  by_clone += row.H_x;
  by_anchor += row.H_f * point.by_clone;
  // (VF-25); where both are one clone, they see nothing.
  const Eigen::Vector2d seen =
      row.H_x * clone.world_turn + row.H_f * point.by_clone * anchor.world_turn;
  make_blind(by_clone, 0.5 * seen, clone.world_turn);
  make_blind(by_anchor, 0.5 * seen, anchor.world_turn);
  // (VF-18)
  const auto add_entry = [&](int camera, int entry, const Eigen::Vector2d& rows) {
    const int column = window.camera(camera).column[static_cast<std::size_t>(entry)];
    if (column >= 0) H_.block<2, 1>(at, place(column, window.state_column(column), 1)) += rows;
  };
  if (window.camera(row.camera).calibrates()) {
    for (int k = 0; k < kCalibrationSize; ++k) {
      add_entry(row.camera, k, row.calibration.row(k).transpose());
    }
  }
  if (window.camera(landmark.camera).has_extrinsics) {
    const Eigen::Matrix<double, 2, kPoseSize> rows = row.H_f * point.by_extrinsics;
    for (int k = 0; k < kPoseSize; ++k) add_entry(landmark.camera, k, rows.col(k));
  }
  rows_at(place(landmark.factor_column, landmark.state_column, 3), 3) +=
      row.H_f * point.by_landmark;
}

bool LandmarkRows::passes(const Window& window, double threshold) {
  const auto r = residual_.head(n_rows_);
  if (r.squaredNorm() <= threshold) return true;  // S is at least the unit matrix
  const FilterView::Covariance P = window.filter().P();
  const Eigen::Index n = n_columns();
  auto P_local = G_.topLeftCorner(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const int b = state_columns_[static_cast<std::size_t>(j)];
    for (Eigen::Index i = j; i < n; ++i) {
      const int a = state_columns_[static_cast<std::size_t>(i)];
      P_local(i, j) = P(std::max(a, b), std::min(a, b));
      P_local(j, i) = P_local(i, j);
    }
  }
  auto PHt = PHt_.topLeftCorner(n, n_rows_);
  PHt.noalias() = P_local * H().transpose();
  auto S = S_.topLeftCorner(n_rows_, n_rows_);
  S.noalias() = H() * PHt;
  S.diagonal().array() += 1.;
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(S);
  if (llt.info() != Eigen::Success) return false;
  auto white = white_.head(n_rows_);
  white = r;
  llt.matrixL().solveInPlace(white);
  return white.squaredNorm() <= threshold;
}

void LandmarkRows::add(InformationFactor& factor) {
  const Eigen::Index n = n_columns();
  auto G = G_.topLeftCorner(n, n);
  G.noalias() = H().transpose() * H();
  for (Eigen::Index j = 0; j < n; ++j) {
    const int b = columns_[static_cast<std::size_t>(j)];
    factor.eta[b] += H_.col(j).head(n_rows_).dot(residual_.head(n_rows_));
    for (Eigen::Index i = j; i < n; ++i) {
      const int a = columns_[static_cast<std::size_t>(i)];
      factor.Lambda(std::max(a, b), std::min(a, b)) += G(i, j);
    }
  }
}

}  // namespace viwo::visual

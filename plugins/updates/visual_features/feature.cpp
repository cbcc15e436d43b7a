#include "feature.hpp"

#include <algorithm>
#include <cmath>

#include "viwo/math/so3.hpp"

namespace viwo::visual {
namespace {

/// A sight farther from the point of the others is none of it.
constexpr double kStraySigmas = 4.;
/// Two sights agree on a point whatever they see.
constexpr int kLeastAgreeing = 3;
/// Variance of a pixel, in its own, that is none.
constexpr double kLeastNoise = 1e-4;

/// Rows by the calibration (VF-6), (VF-15), `J` divided by the standard deviation.
void set_calibration(const WindowCamera& camera, const WindowClone& clone, const CameraPose& pose,
                     const InversePoint& point, const PixelJacobian& J,
                     const IntrinsicsJacobian& J_intrinsics, double inverse_sigma,
                     LinearSight& row) {
  auto rows = row.calibration.transpose();
  rows.setZero();
  if (camera.has_extrinsics) {
    const Eigen::Vector3d turned = pose.R_GtoC * point.seen_from(pose.p_IinG);  // R_ItoC p_FinI
    rows.leftCols<3>().noalias() = J * skew(turned);
    rows.middleCols<3>(3) = point.rho * J;
  }
  if (camera.has_intrinsics) rows.middleCols<8>(kIntrinsicsEntry) = inverse_sigma * J_intrinsics;
  if (camera.has_clock) {
    const Eigen::Vector3d w_IinG = clone.R_GtoI.transpose() * clone.w_IinI;
    rows.col(kClockEntry).noalias() =
        row.H_f * (point.seen_from(pose.p_IinG).cross(w_IinG) - point.rho * clone.v_IinG);
  }
  rows.col(kCalibrationSize) = row.residual;
}

}  // namespace

void collect_sights(const TrackStore& tracks, int track, const Window& window,
                    std::vector<Sight>& out) {
  out.clear();
  for (int clone = 0; clone < window.n_clones(); ++clone) {
    const int slot = window.clone(clone).slot;
    for (int camera = 0; camera < tracks.n_cameras(); ++camera) {
      if ((tracks.mask(track, camera) >> slot & 1u) == 0) continue;
      out.push_back({clone, camera, &tracks.observation(track, slot, camera)});
    }
  }
}

bool linearize_sight(const Window& window, const Sight& sight, const InversePoint& point,
                     double inverse_sigma, LinearSight& row) {
  const WindowClone& clone = window.clone(sight.clone);
  const WindowCamera& camera = window.camera(sight.camera);
  CameraPose own;
  const CameraPose& pose =
      window.pose(sight.clone, sight.camera, sight.observation->uv.y(), own);  // (VF-24)
  row.clone = sight.clone;
  row.column = clone.column;
  row.camera = sight.camera;
  row.t_s = seconds_between(window.clone(0).t_ns, clone.t_ns);
  const Eigen::Vector3d p_C = pose.R_GtoC * point.seen_from(pose.p_CinG);
  Eigen::Vector2d uv;
  PixelJacobian J;
  IntrinsicsJacobian J_intrinsics;
  if (!project(camera.view, p_C, uv, J, camera.has_intrinsics ? &J_intrinsics : nullptr)) {
    return false;
  }
  row.residual = inverse_sigma * (sight.observation->uv - uv);
  J *= inverse_sigma;
  row.H_f.noalias() = J * pose.R_GtoC;  // (VF-4)
  row.by_rho.noalias() = row.H_f * (point.origin - pose.p_CinG);
  // (VF-5): h^T skew(d) = (h x d)^T.
  const Eigen::Vector3d d = point.seen_from(clone.p_IinG);
  Eigen::Matrix<double, 2, 3> H_f_skew;
  for (int i = 0; i < 2; ++i) H_f_skew.row(i) = row.H_f.row(i).cross(d.transpose());
  row.H_x.leftCols<3>().noalias() = H_f_skew * clone.R_GtoI.transpose();
  row.H_x.rightCols<3>() = -point.rho * row.H_f;
  if (camera.calibrates()) {
    set_calibration(camera, clone, pose, point, J, J_intrinsics, inverse_sigma, row);
  }
  return true;
}

void Feature::start(int max_sights, double sigma_px, double min_distance_m, bool exact) {
  set_sigma(sigma_px);
  exact_ = exact;
  min_distance_m_ = min_distance_m;
  distances_ = FoundDistances();
  sights_.reserve(static_cast<std::size_t>(max_sights));
  rays_.reserve(static_cast<std::size_t>(max_sights));
  linear_.reserve(static_cast<std::size_t>(max_sights));
  by_clones_.setZero(kPoseSize * max_sights);
  P_by_clones_.setZero(kPoseSize * max_sights);
  agrees_.reserve(static_cast<std::size_t>(max_sights));
  best_.reserve(static_cast<std::size_t>(max_sights));
}

int Feature::collect(const TrackStore& tracks, int track, const Window& window) {
  collect_sights(tracks, track, window, sights_);
  return static_cast<int>(sights_.size());
}

void Feature::set_point(const Eigen::Vector3d& p_FinG) {
  const double distance = p_FinG.norm();
  met_.point = {Eigen::Vector3d::Zero(), p_FinG / distance, 1. / distance};
  met_.basis = basis_across(met_.point.direction);
  met_.sigma_rho = 0.;
  met_.has_distance = true;
}

FeatureStatus Feature::triangulate(Window& window) {
  rays_.clear();
  CameraPose own;
  for (const Sight& sight : sights_) {
    const CameraPose& pose = window.pose(sight.clone, sight.camera, sight.observation->uv.y(), own);
    Ray& ray = rays_.emplace_back();
    ray.origin = pose.p_CinG;
    ray.direction.noalias() = pose.R_GtoC.transpose() * sight.observation->ray;
    ray.J.noalias() = sight.observation->J_ray * pose.R_GtoC;
  }
  const FeatureStatus status = visual::triangulate(rays_, sigma_px_, min_distance_m_, met_);
  if (status != FeatureStatus::kOk) return status;
  found_rho_ = met_.point.rho;
  found_variance_ = met_.sigma_rho * met_.sigma_rho;
  if (exact_) {
    if (!met_.has_distance) met_.point.rho = 0.;  // it would be whatever rounding makes it
    return status;
  }
  is_of_scene_ = is_of_scene(window);
  distances_.expect(is_of_scene_, met_);
  return status;
}

/// By a way that is hardly known all points are off together: they tell nothing of the scene, and
/// the scene nothing of them.
bool Feature::is_of_scene(Window& window) {
  constexpr double kKnown = 0.1;  // of rho
  if (window.knows_way()) return true;
  const double square = std::max(found_rho_ * found_rho_, distances_.mean_square());
  const auto by = rho_by_poses(window);
  auto P_by = P_by_clones_.head(by.size());
  P_by.noalias() = window.covariance().topLeftCorner(by.size(), by.size()) * by;
  return by.dot(P_by) < kKnown * kKnown * square;
}

Eigen::Ref<const Eigen::VectorXd> Feature::rho_by_poses(const Window& window) {
  auto by = by_clones_.head(window.clone_columns());
  by.setZero();
  const double rho = met_.point.rho;
  const int first = window.clone(sights_.front().clone).column;
  for (std::size_t i = 0; i < sights_.size(); ++i) {
    const WindowClone& clone = window.clone(sights_[i].clone);
    const RayDerivative ray = derivative_of(rays_[i], met_.point, met_.basis);
    const Eigen::Vector3d by_q = (met_.of_rho * ray.by_point.transpose() * ray.by_q).transpose();
    const Eigen::Vector3d d = met_.point.seen_from(clone.p_IinG);
    by.segment<3>(clone.column) -= clone.R_GtoI * by_q.cross(d);
    by.segment<3>(clone.column + 3) += rho * by_q;
    by.segment<3>(first + 3) -= rho * by_q;  // from there it counts
  }
  return by;
}

/// What the rays hardly tell beside what is known before teaches nothing.
void Feature::remember_distance() {
  const bool is_told = 2. * found_variance_ * visual::information_of_rho(min_distance_m_) < 1.;
  if (is_told && is_of_scene_) distances_.add(found_rho_, found_variance_);
}

int Feature::leave_out_strays() {
  const auto is_finite = [](const Ray& ray) { return ray.is_finite(); };
  if (!std::all_of(rays_.begin(), rays_.end(), is_finite)) return 0;  // no fault of the matches
  const int n = static_cast<int>(sights_.size());
  const int most = find_agreeing(rays_, kStraySigmas * sigma_px_, agrees_, best_);
  if (most < kLeastAgreeing || 2 * most <= n || most == n) return 0;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < sights_.size(); ++i) {
    if (best_[i]) sights_[kept++] = sights_[i];
  }
  sights_.resize(kept);
  return n - most;
}

FeatureStatus Feature::linearize(Window& window) {
  linear_.clear();
  const InversePoint& point = met_.point;
  Eigen::Vector3d off = Eigen::Vector3d::Zero();
  for (const Sight& sight : sights_) {
    LinearSight& row = linear_.emplace_back();
    if (!linearize_sight(window, sight, point, 1. / sigma_px_, row)) {
      return FeatureStatus::kNotVisible;
    }
    const WindowClone& clone = window.clone(sight.clone);
    off += clone.p_IinG_fej - clone.p_IinG;
  }
  // (VF-25): the point goes to the first estimates with the clones.
  off /= static_cast<double>(sights_.size());
  const Eigen::Vector3d turn =
      world_turn_of_point(point.direction + point.rho * (point.origin + off));
  for (LinearSight& row : linear_) {
    const WindowClone& clone = window.clone(row.clone);
    const Eigen::Vector2d seen = row.H_x * clone.world_turn + row.H_f * turn;
    make_blind(row.H_x, seen, clone.world_turn);
    row.H_f.leftCols<2>() = (row.H_f * met_.basis).eval();  // (VF-26)
    row.H_f.col(2) = row.by_rho;
  }
  has_plain_noise_ = true;
  second_order_ = 0.;
  if (!exact_) leave_to_noise(window);
  return FeatureStatus::kOk;
}

/// Where both the distance and how far the camera went are not known, their product, which rows do
/// not have, is noise (VF-27).
void Feature::leave_to_noise(Window& window) {
  constexpr double kPlain = 0.5;
  for (LinearSight& row : linear_) {
    const double sigma_m2 =
        window.way_variance(row.clone) + window.way_variance(linear_.front().clone);
    const double gain = row.H_f.leftCols<2>().norm();
    const double rho = met_.point.rho;
    second_order_ = std::max(second_order_, rho * rho * sigma_m2 * gain);  // (VF-30)
    const double variance = 0.5 * met_.sigma_rho * met_.sigma_rho * sigma_m2 * gain * gain;
    if (variance < kLeastNoise) continue;
    if (variance > kPlain) has_plain_noise_ = false;
    const double weight = 1. / std::sqrt(1. + variance);
    row.residual *= weight;
    row.H_f *= weight;
    row.H_x *= weight;
    row.calibration *= weight;
  }
}

}  // namespace viwo::visual

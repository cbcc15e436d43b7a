#include "feature.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "viwo/math/so3.hpp"

namespace viwo::visual {
namespace {

constexpr int kMaxIterations = 10;
/// Steps below this part of the distance end the refinement: far below any pixel noise, and the
/// rest is linear in the point, which is eliminated (VF-8).
constexpr double kStepTolerance = 1e-6;

/// A sight farther from the point of the others is none of it.
constexpr double kStraySigmas = 4.;
/// Two sights agree on a point whatever they see.
constexpr int kLeastAgreeing = 3;

/// Rows by the calibration (VF-6), (VF-15), `J` divided by the standard deviation.
void set_calibration(const WindowCamera& camera, const WindowClone& clone, const CameraPose& pose,
                     const Eigen::Vector3d& p_FinG, const PixelJacobian& J,
                     const IntrinsicsJacobian& J_intrinsics, double inverse_sigma,
                     LinearSight& row) {
  auto rows = row.calibration.transpose();
  rows.setZero();
  if (camera.has_extrinsics) {
    const Eigen::Vector3d turned = pose.R_GtoC * (p_FinG - pose.p_IinG);  // R_ItoC p_FinI
    rows.leftCols<3>().noalias() = J * skew(turned);
    rows.middleCols<3>(3) = J;
  }
  if (camera.has_intrinsics) rows.middleCols<8>(kIntrinsicsEntry) = inverse_sigma * J_intrinsics;
  if (camera.has_clock) {
    const Eigen::Vector3d w_IinG = clone.R_GtoI.transpose() * clone.w_IinI;
    rows.col(kClockEntry).noalias() =
        row.H_f * ((p_FinG - pose.p_IinG).cross(w_IinG) - clone.v_IinG);
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

bool linearize_sight(const Window& window, const Sight& sight, const Eigen::Vector3d& p_FinG,
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
  const Eigen::Vector3d p_C = pose.R_GtoC * (p_FinG - pose.p_CinG);
  Eigen::Vector2d uv;
  PixelJacobian J;
  IntrinsicsJacobian J_intrinsics;
  if (!project(camera.view, p_C, uv, J, camera.has_intrinsics ? &J_intrinsics : nullptr)) {
    return false;
  }
  row.residual = inverse_sigma * (sight.observation->uv - uv);
  J *= inverse_sigma;
  row.H_f.noalias() = J * pose.R_GtoC;  // (VF-4)
  // (VF-5): h^T skew(d) = (h x d)^T.
  const Eigen::Vector3d d = p_FinG - clone.p_IinG;
  Eigen::Matrix<double, 2, 3> H_f_skew;
  for (int i = 0; i < 2; ++i) H_f_skew.row(i) = row.H_f.row(i).cross(d.transpose());
  row.H_x.leftCols<3>().noalias() = H_f_skew * clone.R_GtoI.transpose();
  row.H_x.rightCols<3>() = -row.H_f;
  if (camera.calibrates()) {
    set_calibration(camera, clone, pose, p_FinG, J, J_intrinsics, inverse_sigma, row);
  }
  return true;
}

void Feature::start(int max_sights, double sigma_px, const TriangulationLimits& limits) {
  set_sigma(sigma_px);
  limits_ = limits;
  sights_.reserve(static_cast<std::size_t>(max_sights));
  rays_.reserve(static_cast<std::size_t>(max_sights));
  linear_.reserve(static_cast<std::size_t>(max_sights));
  agrees_.reserve(static_cast<std::size_t>(max_sights));
  best_.reserve(static_cast<std::size_t>(max_sights));
}

int Feature::collect(const TrackStore& tracks, int track, const Window& window) {
  collect_sights(tracks, track, window, sights_);
  return static_cast<int>(sights_.size());
}

FeatureStatus Feature::triangulate(const Window& window) {
  rays_.clear();
  CameraPose own;
  for (const Sight& sight : sights_) {
    const CameraPose& pose = window.pose(sight.clone, sight.camera, sight.observation->uv.y(), own);
    Ray& ray = rays_.emplace_back();
    ray.origin = pose.p_CinG;
    ray.direction.noalias() = pose.R_GtoC.transpose() * sight.observation->ray;
    ray.J.noalias() = sight.observation->J_ray * pose.R_GtoC;
  }
  FeatureStatus status = intersect_rays();
  if (status == FeatureStatus::kOk) status = refine();
  return status == FeatureStatus::kOk ? check_distance() : status;
}

/// Sights within kStraySigmas of the point, and in front of it; returns how many.
int Feature::mark_agreeing(const Eigen::Vector3d& point, std::vector<bool>& agrees) const {
  const double most_px = kStraySigmas / inverse_sigma_;
  agrees.assign(rays_.size(), false);
  int count = 0;
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    const Eigen::Vector3d q = point - rays_[i].origin;
    const double depth = rays_[i].direction.dot(q);
    if (!(depth > 0.)) continue;
    const Eigen::Vector2d e = rays_[i].J * q / depth;
    if (!(e.squaredNorm() < most_px * most_px)) continue;
    agrees[i] = true;
    ++count;
  }
  return count;
}

int Feature::leave_out_strays() {
  const auto is_finite = [](const Ray& ray) {
    return ray.origin.allFinite() && ray.direction.allFinite() && ray.J.allFinite();
  };
  if (!std::all_of(rays_.begin(), rays_.end(), is_finite)) return 0;  // no fault of the matches
  // The point of each pair of sights: that which most others see, too.
  int most = 0;
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    for (std::size_t j = i + 1; j < rays_.size(); ++j) {
      const Eigen::Vector3d& a = rays_[i].direction;
      const Eigen::Vector3d& b = rays_[j].direction;
      const Eigen::Vector3d o = rays_[j].origin - rays_[i].origin;
      const double ab = a.dot(b) / (a.norm() * b.norm());
      const double sine2 = 1. - ab * ab;
      if (!(sine2 * limits_.max_condition > 1.)) continue;
      const Eigen::Vector3d u = a.normalized();
      const Eigen::Vector3d v = b.normalized();
      const double along = (u.dot(o) - ab * v.dot(o)) / sine2;
      const int count = mark_agreeing(rays_[i].origin + along * u, agrees_);
      if (count <= most) continue;
      most = count;
      best_.swap(agrees_);
    }
  }
  const int n = static_cast<int>(sights_.size());
  if (most < kLeastAgreeing || 2 * most <= n || most == n) return 0;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < sights_.size(); ++i) {
    if (best_[i]) sights_[kept++] = sights_[i];
  }
  sights_.resize(kept);
  return n - most;
}

FeatureStatus Feature::intersect_rays() {
  // (VF-1), relative to the first origin: far from the global origin nothing is lost.
  const Eigen::Vector3d start = rays_.front().origin;
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const Ray& ray : rays_) {
    const Eigen::Vector3d& d = ray.direction;
    const Eigen::Vector3d o = ray.origin - start;
    A.noalias() -= d * d.transpose();
    A.diagonal().array() += 1.;
    b += o - d * d.dot(o);
  }
  if (!A.allFinite() || !b.allFinite()) return FeatureStatus::kParallax;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(A, Eigen::EigenvaluesOnly);
  const double smallest = eigen.eigenvalues()[0];
  // (VF-2)
  if (!(smallest * limits_.max_condition > eigen.eigenvalues()[2])) return FeatureStatus::kParallax;
  p_FinG_ = start + A.llt().solve(b);
  return p_FinG_.allFinite() ? FeatureStatus::kOk : FeatureStatus::kParallax;
}

FeatureStatus Feature::refine() {
  // Levenberg-Marquardt on (VF-3). `point` is the one under test, p_FinG_ the best so far.
  Eigen::Vector3d point = p_FinG_;
  Eigen::Matrix3d A_best = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b_best = Eigen::Vector3d::Zero();
  double cost_best = std::numeric_limits<double>::infinity();
  double damping = 0.;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    double cost = 0.;
    bool visible = true;
    for (const Ray& ray : rays_) {
      const Eigen::Vector3d q = point - ray.origin;
      const double depth = ray.direction.dot(q);
      visible = visible && depth > 0.;
      const double inverse_depth = 1. / depth;
      const Eigen::Vector2d e = ray.J * q * inverse_depth;
      const Eigen::Matrix<double, 2, 3> J = (ray.J - e * ray.direction.transpose()) * inverse_depth;
      cost += e.squaredNorm();
      A.noalias() += J.transpose() * J;
      b.noalias() -= J.transpose() * e;
    }
    if (visible && cost <= cost_best) {
      p_FinG_ = point;
      A_best = A;
      b_best = b;
      cost_best = cost;
      damping *= 0.1;
      if (damping < 1e-9) damping = 0.;
    } else if (iteration == 0) {
      return FeatureStatus::kNotVisible;
    } else {
      damping = damping > 0. ? 10. * damping : 1e-3;
    }
    Eigen::Matrix3d A_damped = A_best;
    A_damped.diagonal() *= 1. + damping;
    const Eigen::Vector3d step = A_damped.llt().solve(b_best);
    if (!step.allFinite()) return FeatureStatus::kParallax;
    const double distance = (p_FinG_ - rays_.front().origin).norm();
    point = p_FinG_ + step;
    if (step.norm() <= kStepTolerance * distance) break;
  }
  return FeatureStatus::kOk;
}

FeatureStatus Feature::check_distance() const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Ray& ray : rays_) nearest = std::min(nearest, (p_FinG_ - ray.origin).squaredNorm());
  nearest = std::sqrt(nearest);
  return nearest >= limits_.min_distance_m && nearest <= limits_.max_distance_m
             ? FeatureStatus::kOk
             : FeatureStatus::kDistance;
}

FeatureStatus Feature::linearize(const Window& window) {
  linear_.clear();
  Eigen::Vector3d off = Eigen::Vector3d::Zero();
  for (const Sight& sight : sights_) {
    LinearSight& row = linear_.emplace_back();
    if (!linearize_sight(window, sight, p_FinG_, inverse_sigma_, row)) {
      return FeatureStatus::kNotVisible;
    }
    const WindowClone& clone = window.clone(sight.clone);
    off += clone.p_IinG_fej - clone.p_IinG;
  }
  // (VF-25): the point goes to the first estimates with the clones.
  off /= static_cast<double>(sights_.size());
  const Eigen::Vector3d turn = world_turn_of_point(p_FinG_ + off);
  for (LinearSight& row : linear_) {
    const auto& of_clone = window.clone(row.clone).world_turn;
    const Eigen::Vector2d seen = row.H_x * of_clone + row.H_f * turn;
    row.H_x.leftCols<3>().noalias() -= seen * of_clone.head<3>().transpose();
  }
  return FeatureStatus::kOk;
}

}  // namespace viwo::visual

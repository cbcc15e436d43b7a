#include "triangulation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

namespace viwo::visual {
namespace {

constexpr int kMaxIterations = 10;
/// Radians of the rays: steps below end the refinement, far below any pixel noise, and the rest is
/// linear in the point, which is eliminated (VF-8).
constexpr double kStepTolerance = 1e-6;
/// Noise does not make more of rho.
constexpr double kSigmas = 4.;
/// Points that say how far others are: too few, and the last that count.
constexpr int kFewPoints = 20, kMostPoints = 300;

/// The problem at a point.
struct Normal {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double cost = 0.;
  bool visible = true;
};

Normal normal_at(std::span<const Ray> rays, const InversePoint& point,
                 const Eigen::Matrix<double, 3, 2>& basis, double information) {
  Normal n;
  for (const Ray& ray : rays) {
    const RayDerivative d = derivative_of(ray, point, basis);
    n.visible = n.visible && d.is_visible;
    n.cost += d.e.squaredNorm();
    n.A.noalias() += d.by_point.transpose() * d.by_point;
    n.b.noalias() -= d.by_point.transpose() * d.e;
  }
  n.A(2, 2) += information;
  n.b[2] -= information * point.rho;
  n.cost += information * point.rho * point.rho;
  return n;
}

void move(InversePoint& point, const Eigen::Matrix<double, 3, 2>& basis,
          const Eigen::Vector3d& step) {
  const Eigen::Vector3d direction = point.direction + basis * step.head<2>();
  const double norm = direction.norm();
  point.direction = direction / norm;
  point.rho = (point.rho + step[2]) / norm;
}

/// Next to all rays: as if distances were all alike, but in one step.
InversePoint next_to(std::span<const Ray> rays, double information) {
  InversePoint point{rays.front().origin, rays.front().direction, 0.};
  const auto basis = basis_across(point.direction);
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const Ray& ray : rays) {
    Eigen::Matrix<double, 2, 3> J;
    J.leftCols<2>().noalias() = ray.J * basis;
    J.col(2).noalias() = ray.J * (point.origin - ray.origin);
    A.noalias() += J.transpose() * J;
    b.noalias() -= J.transpose() * (ray.J * point.direction);
  }
  A(2, 2) += information;
  const Eigen::Vector3d step = A.llt().solve(b);
  if (step.allFinite()) move(point, basis, step);
  return point;
}

/// Rays that see a point within `most_px`, in front of them; returns how many. Ends where there
/// will not be more than `beaten`.
int mark_agreeing(std::span<const Ray> rays, const InversePoint& point, double most_px, int beaten,
                  std::vector<bool>& agrees) {
  agrees.assign(rays.size(), false);
  int possible = static_cast<int>(rays.size());
  for (std::size_t i = 0; i < rays.size() && possible > beaten; ++i) {
    const Eigen::Vector3d q = point.seen_from(rays[i].origin);
    const double depth = rays[i].direction.dot(q);
    const double within = most_px * depth;
    agrees[i] = depth > 0. && (rays[i].J * q).squaredNorm() < within * within;
    if (!agrees[i]) --possible;
  }
  return possible;
}

}  // namespace

Eigen::Matrix<double, 3, 2> basis_across(const Eigen::Vector3d& unit) {
  // The axis that is farthest from it.
  Eigen::Index axis = 0;
  unit.cwiseAbs().minCoeff(&axis);
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = unit.cross(Eigen::Vector3d::Unit(axis)).normalized();
  basis.col(1) = unit.cross(basis.col(0));
  return basis;
}

Eigen::Matrix3d MetRays::by_point() const {
  Eigen::Matrix3d T;
  T.topRows<2>() = point.rho * basis.transpose();
  T.row(2) = -point.rho * point.rho * point.direction.transpose();
  return T;
}

RayDerivative derivative_of(const Ray& ray, const InversePoint& point,
                            const Eigen::Matrix<double, 3, 2>& basis) {
  const Eigen::Vector3d apart = point.origin - ray.origin;
  const Eigen::Vector3d q = point.direction + point.rho * apart;
  const double depth = ray.direction.dot(q);
  const double inverse_depth = 1. / depth;
  RayDerivative d;
  d.is_visible = depth > 0.;
  d.e = ray.J * q * inverse_depth;
  d.by_q = (ray.J - d.e * ray.direction.transpose()) * inverse_depth;
  d.by_point.leftCols<2>().noalias() = d.by_q * basis;
  d.by_point.col(2).noalias() = d.by_q * apart;
  return d;
}

FeatureStatus triangulate(std::span<const Ray> rays, double sigma_px, double min_distance_m,
                          MetRays& out) {
  const double information = sigma_px * sigma_px * information_of_rho(min_distance_m);
  double farthest_m = 0.;
  for (const Ray& ray : rays) {
    if (!ray.is_finite()) return FeatureStatus::kBroken;
    farthest_m = std::max(farthest_m, (ray.origin - rays.front().origin).norm());
  }
  // Levenberg-Marquardt. `point` is the one under test, out.point the best so far.
  InversePoint point = next_to(rays, information);
  Normal best;
  best.cost = std::numeric_limits<double>::infinity();
  double damping = 0.;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const auto basis = basis_across(point.direction);
    const Normal now = normal_at(rays, point, basis, information);
    if (now.visible && now.cost <= best.cost) {
      out.point = point;
      out.basis = basis;
      best = now;
      damping = damping < 1e-8 ? 0. : 0.1 * damping;
    } else if (iteration == 0) {
      // Far away, along the first ray, it is before all cameras that look there.
      point = {rays.front().origin, rays.front().direction, 0.};
      continue;
    } else if (!std::isfinite(best.cost)) {
      return FeatureStatus::kNotVisible;
    } else {
      damping = damping > 0. ? 10. * damping : 1e-3;
    }
    Eigen::Matrix3d A = best.A;
    A.diagonal() *= 1. + damping;
    const Eigen::Vector3d step = A.llt().solve(best.b);
    if (!step.allFinite()) return FeatureStatus::kBroken;
    point = out.point;
    move(point, out.basis, step);
    if (std::hypot(step[0], step[1], step[2] * farthest_m) <= kStepTolerance) {
      out.point = point;  // so small a step is an improvement for sure, and A stays in its basis
      break;
    }
  }
  out.of_rho = best.A.inverse().row(2);
  if (!(out.of_rho[2] > 0.)) return FeatureStatus::kBroken;
  out.sigma_rho = sigma_px * std::sqrt(out.of_rho[2]);
  if (out.point.rho < -kSigmas * out.sigma_rho) return FeatureStatus::kNotVisible;  // behind
  out.has_distance = out.point.rho > kSigmas * out.sigma_rho;
  for (const Ray& ray : rays) {
    const double distance = out.point.seen_from(ray.origin).norm();  // times rho
    if (distance < out.point.rho * min_distance_m) return FeatureStatus::kNear;
  }
  return FeatureStatus::kOk;
}

void FoundDistances::add(double rho, double variance) {
  count_ = std::min(count_ + 1, kMostPoints);
  // The better it is told, beside how different points are, the more it says of them: of a wall, or
  // the horizon, as far as that difference is known itself.
  const double spread = std::max(this->variance(), noise_ * std::sqrt(2. / count_));
  const double weight = count_ > kFewPoints && spread > 0. ? spread / (spread + variance) : 1.;
  weight_ = (1. - 1. / kMostPoints) * weight_ + weight;
  const double part = weight / weight_;
  mean_ += part * (rho - mean_);
  second_ += part * (rho * rho - variance - second_);
  noise_ += part * (variance - noise_);
}

void FoundDistances::expect(bool of_scene, MetRays& met) const {
  double& rho = met.point.rho;
  const double variance = met.sigma_rho * met.sigma_rho;
  const auto is_stranger = [&](double about, double spread) {
    const double off = rho - about;
    return met.has_distance && off * off > kSigmas * kSigmas * (spread + variance);
  };
  if (!of_scene || count_ <= kFewPoints) {
    if (met.has_distance) return;
    met.sigma_rho = std::hypot(rho, met.sigma_rho);
    rho = 0.;
  } else if (variance > second_) {
    const double second = std::max(0., second_);
    if (is_stranger(0., second)) return;
    const double unsure = variance * std::sqrt(2. / count_);  // of second_
    met.sigma_rho = std::sqrt(std::min(variance, second + unsure));
    rho = 0.;
  } else {
    if (is_stranger(mean_, this->variance())) return;
    const double told = this->variance() / (this->variance() + variance);
    rho = mean_ + told * (rho - mean_);
    met.sigma_rho *= std::sqrt(told);
  }
}

int find_agreeing(std::span<const Ray> rays, double most_px, std::vector<bool>& agrees,
                  std::vector<bool>& best) {
  const int n = static_cast<int>(rays.size());
  int most = 0;
  // Those that are far apart first: they are likely to tell where the point is.
  for (std::size_t i = 0; i < rays.size(); ++i) {
    for (std::size_t j = rays.size() - 1; j > i; --j) {
      const Eigen::Vector3d& a = rays[i].direction;
      const Eigen::Vector3d& b = rays[j].direction;
      const Eigen::Vector3d apart = rays[j].origin - rays[i].origin;
      const double ab = a.dot(b);
      // Along a it is next to b: where both are alike, infinitely far.
      const double along = a.dot(apart) - ab * b.dot(apart), sine2 = 1. - ab * ab;
      const InversePoint point{rays[i].origin, along > 0. ? Eigen::Vector3d(along * a) : a,
                               along > 0. ? sine2 : 0.};
      const int count = mark_agreeing(rays, point, most_px, most, agrees);
      if (count <= most) continue;
      most = count;
      best.swap(agrees);
      if (most == n) return n;
    }
  }
  return most;
}

}  // namespace viwo::visual

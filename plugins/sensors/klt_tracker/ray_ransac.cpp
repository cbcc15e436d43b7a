#include "ray_ransac.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <random>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include "viwo/math/so3.hpp"

namespace viwo::klt {
namespace {

using Rays = std::span<const Eigen::Vector3d>;

constexpr std::size_t kMinPairs = 8;
constexpr std::size_t kSample = 5;
constexpr int kMinHypotheses = 16;
constexpr int kMaxHypotheses = 200;
constexpr double kConfidence = 0.995;
constexpr int kSolveSteps = 5;
constexpr int kPolishSteps = 3;
constexpr int kPolishRounds = 4;
/// Keeps the direction of translation where it is when the rays do not tell it.
constexpr double kNormalDamping = 1e-10;

/// Rotation that takes rays_1 next to rays_2, least squares over the pairs of `chosen` (Wahba).
Eigen::Matrix3d best_rotation(Rays rays_1, Rays rays_2, std::span<const std::size_t> chosen) {
  Eigen::Matrix3d B = Eigen::Matrix3d::Zero();
  for (const std::size_t i : chosen) B += rays_2[i] * rays_1[i].transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(B, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1., 1., 1.);
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.) signs.z() = -1.;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

/// Rotation of the pairs that agree best on one: near points move otherwise, false tracks anyhow.
Eigen::Matrix3d common_rotation(Rays rays_1, Rays rays_2) {
  std::vector<std::size_t> chosen(rays_1.size());
  std::iota(chosen.begin(), chosen.end(), std::size_t{0});
  Eigen::Matrix3d R = best_rotation(rays_1, rays_2, chosen);
  std::vector<double> error(rays_1.size());
  for (int i = 0; i < 2; ++i) {
    for (std::size_t k = 0; k < rays_1.size(); ++k) {
      error[k] = (rays_2[k] - R * rays_1[k]).squaredNorm();
    }
    const std::size_t half = rays_1.size() / 2;
    chosen.resize(rays_1.size());
    std::iota(chosen.begin(), chosen.end(), std::size_t{0});
    std::nth_element(chosen.begin(), chosen.begin() + static_cast<std::ptrdiff_t>(half),
                     chosen.end(), [&](std::size_t a, std::size_t b) {
                       return std::pair(error[a], a) < std::pair(error[b], b);
                     });
    chosen.resize(half);
    R = best_rotation(rays_1, rays_2, chosen);
  }
  return R;
}

/// Direction that is the nearest to all epipolar planes when the rotation is known, (KLT-8).
Eigen::Vector3d best_direction(const Eigen::Matrix3d& R, Rays rays_1, Rays rays_2,
                               std::span<const std::size_t> chosen) {
  Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
  for (const std::size_t i : chosen) {
    const Eigen::Vector3d n = (R * rays_1[i]).cross(rays_2[i]);
    N += n * n.transpose();
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(N);
  return solver.eigenvectors().col(0).normalized();
}

/// Gauss-Newton steps on the epipolar errors of the pairs of `chosen`, (KLT-9).
void improve(RelativeMotion& motion, Rays rays_1, Rays rays_2, std::span<const std::size_t> chosen,
             int steps) {
  for (int step = 0; step < steps; ++step) {
    Eigen::Vector3d b1 = motion.t.unitOrthogonal();
    const Eigen::Vector3d b2 = motion.t.cross(b1);
    Eigen::Matrix<double, 5, 5> A = Eigen::Matrix<double, 5, 5>::Identity() * kNormalDamping;
    Eigen::Matrix<double, 5, 1> b = Eigen::Matrix<double, 5, 1>::Zero();
    for (const std::size_t i : chosen) {
      const Eigen::Vector3d u = motion.R * rays_1[i];
      const Eigen::Vector3d f_t = rays_2[i].cross(motion.t);
      const Eigen::Vector3d n = u.cross(rays_2[i]);
      const double error = motion.t.dot(n);
      Eigen::Matrix<double, 5, 1> J;
      J << u.cross(f_t), n.dot(b1), n.dot(b2);
      const double weight = 1. / (f_t.squaredNorm() + motion.t.cross(u).squaredNorm() + 1e-12);
      A.noalias() += weight * J * J.transpose();
      b.noalias() -= weight * error * J;
    }
    const Eigen::Matrix<double, 5, 1> d = A.ldlt().solve(b);
    if (!d.allFinite()) return;
    motion.R = exp_so3(d.head<3>()) * motion.R;
    motion.t = (motion.t + d[3] * b1 + d[4] * b2).normalized();
  }
}

struct Score {
  double cost = 0.;  ///< sum of squared angles, each at most the squared threshold
  std::size_t inliers = 0;
};

Score score(const RelativeMotion& motion, Rays rays_1, Rays rays_2, double threshold_rad) {
  Score out;
  const double limit = threshold_rad * threshold_rad;
  for (std::size_t i = 0; i < rays_1.size(); ++i) {
    const double angle = epipolar_angle(motion, rays_1[i], rays_2[i]);
    const double squared = angle * angle;
    if (squared <= limit) ++out.inliers;
    out.cost += std::min(squared, limit);
  }
  return out;
}

std::vector<std::size_t> inliers_of(const RelativeMotion& motion, Rays rays_1, Rays rays_2,
                                    double threshold_rad) {
  std::vector<std::size_t> inliers;
  for (std::size_t i = 0; i < rays_1.size(); ++i) {
    if (epipolar_angle(motion, rays_1[i], rays_2[i]) <= threshold_rad) inliers.push_back(i);
  }
  return inliers;
}

/// Fits the motion to all pairs that agree with it, as long as that makes it better: a sample alone
/// has noise.
void polish(RelativeMotion& motion, Score& motion_score, Rays rays_1, Rays rays_2,
            double threshold_rad) {
  for (int round = 0; round < kPolishRounds; ++round) {
    RelativeMotion trial = motion;
    improve(trial, rays_1, rays_2, inliers_of(motion, rays_1, rays_2, threshold_rad), kPolishSteps);
    const Score trial_score = score(trial, rays_1, rays_2, threshold_rad);
    if (trial_score.cost >= motion_score.cost) return;
    motion = trial;
    motion_score = trial_score;
  }
}

/// Samples after which one without a false pair was drawn with kConfidence, (KLT-10).
int hypotheses_needed(std::size_t inliers, std::size_t pairs) {
  const double share = static_cast<double>(inliers) / static_cast<double>(pairs);
  const double clean = std::pow(share, static_cast<double>(kSample));
  if (clean > 1. - 1e-9) return kMinHypotheses;
  if (clean < 1e-9) return kMaxHypotheses;
  const double n = std::log(1. - kConfidence) / std::log(1. - clean);
  return std::clamp(static_cast<int>(std::min(n, 1e6)) + 1, kMinHypotheses, kMaxHypotheses);
}

std::array<std::size_t, kSample> draw(std::mt19937_64& random, std::size_t n) {
  std::array<std::size_t, kSample> sample{};
  for (std::size_t i = 0; i < kSample;) {
    sample[i] = static_cast<std::size_t>(random() % n);
    const auto end = sample.begin() + static_cast<std::ptrdiff_t>(i);
    if (std::find(sample.begin(), end, sample[i]) == end) ++i;
  }
  return sample;
}

}  // namespace

void straighten(std::span<Eigen::Vector3d> rays_1, std::span<Eigen::Vector3d> rays_2,
                std::span<const double> rows_1, std::span<const double> rows_2, double dt_s) {
  const Eigen::Vector3d rate = log_so3(common_rotation(rays_1, rays_2)) / dt_s;
  for (std::size_t i = 0; i < rays_1.size(); ++i) {
    rays_1[i] = exp_so3(-rows_1[i] * rate) * rays_1[i];
    rays_2[i] = exp_so3(-rows_2[i] * rate) * rays_2[i];
  }
}

double epipolar_angle(const RelativeMotion& motion, const Eigen::Vector3d& ray_1,
                      const Eigen::Vector3d& ray_2) {
  const Eigen::Vector3d n = motion.t.cross(motion.R * ray_1);
  // (KLT-7)
  const double scale = 0.5 * (n.squaredNorm() + motion.t.cross(ray_2).squaredNorm());
  return std::abs(ray_2.dot(n)) / std::sqrt(scale + 1e-24);
}

std::vector<std::uint8_t> epipolar_inliers(Rays rays_1, Rays rays_2, double threshold_rad,
                                           std::uint64_t seed, RelativeMotion* motion) {
  const std::size_t n = rays_1.size();
  if (n < kMinPairs) return std::vector<std::uint8_t>(n, 1);
  const Eigen::Matrix3d R = common_rotation(rays_1, rays_2);
  std::mt19937_64 random(seed);
  RelativeMotion best;
  Score best_score;
  int needed = kMaxHypotheses;
  for (int k = 0; k < needed; ++k) {
    const auto sample = draw(random, n);
    RelativeMotion trial{R, best_direction(R, rays_1, rays_2, sample)};
    improve(trial, rays_1, rays_2, sample, kSolveSteps);
    Score trial_score = score(trial, rays_1, rays_2, threshold_rad);
    if (k > 0 && trial_score.cost >= best_score.cost) continue;
    polish(trial, trial_score, rays_1, rays_2, threshold_rad);
    best = trial;
    best_score = trial_score;
    needed = std::min(needed, hypotheses_needed(best_score.inliers, n));
  }
  std::vector<std::uint8_t> flags(n, 0);
  for (const std::size_t i : inliers_of(best, rays_1, rays_2, threshold_rad)) flags[i] = 1;
  if (motion != nullptr) *motion = best;
  return flags;
}

}  // namespace viwo::klt

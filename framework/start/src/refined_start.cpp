#include "refined_start.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "visual_problem.hpp"
#include "viwo/math/median.hpp"

namespace viwo {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// What errs slowly (a lens that is not quite that of its model, a track that creeps) shows in no
/// residual of a short window: sights are not believed to be better, px.
constexpr double kLeastPx = 0.5;

/// Levenberg and Marquardt's descent. False: no step went down from where it must.
bool descend(const VisualProblem& problem, double sigma_px, int iterations, VisualEstimate& x,
             VisualNormals& n) {
  n = problem.linearise(x, sigma_px);
  double damping = 1e-4;
  for (int i = 0; i < iterations; ++i) {
    MatrixXd H = n.H;
    H.diagonal() *= 1. + damping;
    const Eigen::LLT<MatrixXd> llt(H);
    if (llt.info() != Eigen::Success) return false;
    const VectorXd dx = llt.solve(n.b);
    if (!dx.allFinite()) return false;
    const VisualEstimate y = problem.moved(x, dx, n);
    VisualNormals then = problem.linearise(y, sigma_px);
    if (!(then.cost < n.cost)) {
      damping *= 10.;
      if (damping > 1e4) break;
      continue;
    }
    const bool done = n.cost - then.cost < 1e-6 * n.cost;
    x = y;
    n = std::move(then);
    damping = std::max(damping * 0.1, 1e-9);
    if (done) break;
  }
  return std::isfinite(n.cost);
}

/// Leaves out the tracks whose sights are off by much more than those of the others.
void drop_outliers(VisualWindow& window, VisualEstimate& x, const VisualNormals& n) {
  std::vector<double> costs = n.track_cost;
  // Means of some ten sights each scatter little.
  const double limit = 6. * upper_median(costs);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < window.tracks.size(); ++i) {
    if (n.track_cost[i] > limit) continue;
    if (kept != i) {
      window.tracks[kept] = std::move(window.tracks[i]);
      x.points[kept] = x.points[i];
    }
    ++kept;
  }
  window.tracks.resize(kept);
  x.points.resize(kept);
}

/// Relative sigma of the distance of a point, such that a quarter of them is better: an error of
/// the scale is in all of them.
double sigma_of_scale(const VisualEstimate& x, const VisualNormals& n, const MatrixXd& P) {
  std::vector<double> sigmas;
  for (std::size_t i = 0; i < x.points.size(); ++i) {
    const Eigen::RowVectorXd by_rest = n.point_inverse[i].row(2) * n.point_with[i];
    const double variance = n.point_inverse[i](2, 2) + by_rest * P * by_rest.transpose();
    sigmas.push_back(std::sqrt(variance) / x.points[i].z());
  }
  const auto quarter = sigmas.begin() + static_cast<std::ptrdiff_t>(sigmas.size() / 4);
  std::nth_element(sigmas.begin(), quarter, sigmas.end());
  return *quarter;
}

}  // namespace

std::optional<RefinedStart> refine_start(VisualWindow& window, const LinearStart& linear,
                                         const Vector3d& gyro_bias,
                                         const VisualStartOptions& options) {
  const VisualProblem problem(window, options);
  VisualEstimate x = problem.initial(linear, gyro_bias);
  VisualNormals n;
  RefinedStart found;
  found.sigma_px = 1.;
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    if (!descend(problem, found.sigma_px, round == 0 ? 25 : 8, x, n)) return std::nullopt;
    if (round + 1 < kRounds) drop_outliers(window, x, n);
    // Each point takes three numbers, the motion some twenty.
    const double dof =
        2. * static_cast<double>(n.n_sights) - 3. * static_cast<double>(n.track_cost.size()) - 20.;
    if (dof < 20.) return std::nullopt;
    found.sigma_px *= std::sqrt(n.sight_cost / dof);
    found.sigma_px = std::max(found.sigma_px, kLeastPx);
  }
  n = problem.linearise(x, found.sigma_px);
  const Eigen::LLT<MatrixXd> llt(n.H);
  if (llt.info() != Eigen::Success) return std::nullopt;
  const MatrixXd P = llt.solve(MatrixXd::Identity(problem.size(), problem.size()));
  const Eigen::Index last = problem.imu_columns() - kImuSize;
  found.P = P.block<kImuSize, kImuSize>(last, last);
  found.P = 0.5 * (found.P + found.P.transpose()).eval();
  found.sigma_scale = sigma_of_scale(x, n, P);
  found.state = x.keys.back();
  found.n_tracks = window.tracks.size();
  found.imu_ratio = n.imu_cost / (9. * static_cast<double>(window.keys.size() - 1));
  if (!found.P.allFinite()) return std::nullopt;
  return found;
}

}  // namespace viwo

#include "residual_groups.hpp"

#include <algorithm>

#include <Eigen/Dense>

#include "viwo/math/chi2.hpp"

namespace viwo::calibration {
namespace {

double redundancy(const NoiseGroup& group, const Eigen::MatrixXd& P) {
  return group.residuals - (P * group.information).trace();
}

}  // namespace

Persistence persistence(const NoiseGroup& group) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(group.information);
  const Eigen::VectorXd& values = eigen.eigenvalues();
  const double smallest = 1e-9 * values[values.size() - 1];
  const auto n_batches = static_cast<double>(group.batches.size());
  Persistence out;
  double rank = 0.;
  for (int i = 0; i < values.size(); ++i) {
    if (!(values[i] > smallest)) continue;
    double squares = 0., all = 0.;
    for (const Eigen::VectorXd& gradient : group.batches) {
      const double along = eigen.eigenvectors().col(i).dot(gradient);
      squares += along * along;
      all += along;
    }
    ++rank;
    out.ratio += squares / values[i];
    out.squares += (n_batches * squares - all * all) / values[i];
  }
  if (rank > 0.) out.ratio /= rank;
  out.dof = rank * (n_batches - 1.);
  return out;
}

double variance_of(const NoiseGroup& group, const Eigen::MatrixXd& P) {
  constexpr double kLeastToSpare = 4.;
  const double spare = redundancy(group, P);
  return spare < kLeastToSpare || group.squares < 1e-12 ? 0. : group.squares / (spare - 2.);
}

double variance_of_parity(const Linearisation& at, const Eigen::MatrixXd& P) {
  constexpr double kChance = 0.001, kNothingToSpare = 0.01;
  const NoiseGroup& parity = at[index(ResidualKind::kParity)];
  const Persistence batches = persistence(parity);
  if (!(batches.dof > 0.) || !(batches.squares > 0.)) return variance_of(parity, P);
  // Where the reference is off for long, so are the wheels from the estimate.
  double expected = redundancy(parity, P);
  const Eigen::MatrixXd PN = P * parity.information * P;
  for (const ResidualKind kind : {ResidualKind::kYaw, ResidualKind::kPosition}) {
    const NoiseGroup& group = at[index(kind)];
    if (group.residuals == 0) continue;
    const double more = std::max(0., persistence(group).ratio - 1.);
    expected += more * PN.cwiseProduct(group.information).sum();
  }
  const double variance = batches.squares / batches.dof;
  if (expected < kNothingToSpare) return variance;
  const double most = variance * chi2_quantile(1. - kChance, expected);
  if (parity.squares > most) return parity.squares / expected;
  return (batches.squares + parity.squares) / (batches.dof + expected);
}

}  // namespace viwo::calibration

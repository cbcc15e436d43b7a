#include "viwo/series/wheel_calibration.hpp"

#include <algorithm>

#include <Eigen/Cholesky>

#include "viwo/wheel/drive_ranges.hpp"
#include "viwo/wheel/twist_solver.hpp"

namespace viwo::series {
namespace {

Explained explained(const ParityInformation& parity, const Intrinsics& x_WI) {
  Eigen::Index i = 0;
  const Intrinsics told = parity.Lambda.diagonal().cwiseMax(1e-12);
  const double most = parity.eta.cwiseAbs2().cwiseQuotient(told).maxCoeff(&i);
  // Copies of one reading contradict each other by rounding alone, of which nothing explains more
  // than all.
  const bool is_any = parity.chi2 > 1e-6 * parity.dof && most <= 1.001 * parity.chi2;
  return {static_cast<std::size_t>(i), x_WI[i] - parity.eta[i] / told[i],
          is_any ? most / parity.chi2 : 0.};
}

}  // namespace

Parity parity_of(const Wheels& wheels, const Intrinsics& x_WI) {
  TwistSolver solver(wheels.model, {});
  solver.set_intrinsics(x_WI);
  TwistSolution solution;
  ParityWatch watch(wheels.model);
  for (const EncoderSample& sample : wheels.samples) {
    watch.add(sample, x_WI, solver.solve(sample, solution) == Status::kOk ? &solution : nullptr);
  }
  return watch.total();
}

std::optional<Calibration> calibrated(const Wheels& wheels) {
  const WheelsView& view = wheels.prior.wheels;
  const int n = wheels.model->n_intrinsics();
  Calibration found{view.x_WI, IntrinsicMatrix::Zero(n, n), {}};
  const Intrinsics& sigma = wheels.prior.sigma_intrinsics;
  if (sigma.size() != n || wheels.model->n_rows() <= 3) return {};
  TwistSolver solver(wheels.model, {.noise_weighted = true});
  TwistSolution solution;
  ParityInformation parity;
  constexpr int kSteps = 3;
  constexpr std::size_t kMost = 4000;
  const std::size_t stride = std::max<std::size_t>(1, wheels.samples.size() / kMost);
  for (int step = 0; step < kSteps; ++step) {
    solver.set_intrinsics(found.x_WI);
    parity.reset(n);
    for (std::size_t i = 0; i < wheels.samples.size(); i += stride) {
      if (solver.solve(wheels.samples[i], solution) != Status::kOk) continue;
      const auto residual = solver.parity();
      const double dof = std::max(residual.dof(), 1);
      // As Student's t with few degrees of freedom: a liar has a bounded say.
      solver.add_parity(residual, 1. / (1. + residual.chi2() / (10. * dof)), parity);
    }
    if (step == 0) found.alone = explained(parity, view.x_WI);
    IntrinsicMatrix N = parity.Lambda;
    Intrinsics h = -parity.eta;
    for (int i = 0; i < n; ++i) {
      const double information = sigma[i] > 0. ? 1. / (sigma[i] * sigma[i]) : 1e18;
      N(i, i) += information;
      h[i] -= information * (found.x_WI[i] - view.x_WI[i]);
    }
    const Eigen::LDLT<IntrinsicMatrix> solve(N);
    const Intrinsics d = solve.solve(h);
    if (!d.allFinite()) return {};
    found.x_WI += d;
    found.P = solve.solve(IntrinsicMatrix::Identity(n, n));
  }
  return found;
}

bool moves(const EncoderSample& sample) {
  constexpr double kMoves_rad_per_s = 0.1;
  return fastest_of(sample) > kMoves_rad_per_s;
}

std::vector<EncoderSample> moving_samples(const Wheels& wheels, std::size_t most) {
  std::vector<const EncoderSample*> moving;
  for (const EncoderSample& sample : wheels.samples) {
    if (moves(sample)) moving.push_back(&sample);
  }
  const std::size_t stride = std::max<std::size_t>(1, moving.size() / most);
  std::vector<EncoderSample> samples;
  for (std::size_t i = 0; i < moving.size(); i += stride) samples.push_back(*moving[i]);
  return samples;
}

}  // namespace viwo::series

// Inverse kinematics by Newton's method, for models that do not offer their own.
#include <array>
#include <cmath>

#include <Eigen/QR>

#include "viwo/sim/encoder_simulator.hpp"

namespace viwo::sim {
namespace {

constexpr int kMaxSteps = 50;
constexpr int kMaxHalvings = 12;
constexpr double kTolerance = 1e-12;  // m/s

/// One problem b(y) - A(y) xi - slip = 0.
class InverseProblem {
 public:
  InverseProblem(const KinematicModel& model, const ModelDescription& description, const Twist& xi,
                 const Intrinsics& x_WI, const RowVector& slip)
      : model_(model), description_(description), xi_(xi), x_WI_(x_WI), slip_(slip) {
    rows_.A.setZero(description.n_rows, 3);
    rows_.b.setZero(description.n_rows);
  }

  /// Newton steps of minimum norm with step halving; true when the rows are satisfied.
  bool solve(EncoderSample& y) {
    RowVector r = residual(y);
    for (int i = 0; i < kMaxSteps; ++i) {
      if (!r.allFinite()) return false;
      if (r.lpNorm<Eigen::Infinity>() <= kTolerance) return true;
      if (!step(y, r)) return false;
    }
    return false;
  }

 private:
  RowVector residual(const EncoderSample& y) {
    if (model_.rows(y, x_WI_, false, rows_) != Status::kOk) {
      return RowVector::Constant(description_.n_rows, NAN);
    }
    return rows_.b - rows_.A * xi_ - slip_;
  }

  /// d residual / d channel, drive channels first; channels without a noise source stay zero.
  Eigen::MatrixXd jacobian(const EncoderSample& y, const RowVector& r) const {
    const auto m = description_.n_rows;
    const auto q = static_cast<Eigen::Index>(description_.noises.size());
    NoiseDerivatives by_noise;
    by_noise.J.setZero(m, q);
    by_noise.DtE.setZero(3, q);
    model_.noise_derivatives(y, x_WI_, rows_, rows_.b, xi_, r, by_noise);
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(m, description_.n_drive + description_.n_steer);
    for (Eigen::Index i = 0; i < q; ++i) {
      const NoiseSpec& spec = description_.noises[static_cast<std::size_t>(i)];
      if (spec.kind == NoiseKind::kSlip) continue;
      const int offset = spec.kind == NoiseKind::kSteer ? description_.n_drive : 0;
      J.col(offset + spec.channel) = by_noise.J.col(i);
    }
    return J;
  }

  bool step(EncoderSample& y, RowVector& r) {
    const Eigen::MatrixXd J = jacobian(y, r);
    const Eigen::VectorXd direction = -J.completeOrthogonalDecomposition().solve(r);
    double length = 1.;
    for (int i = 0; i < kMaxHalvings; ++i, length *= 0.5) {
      EncoderSample candidate = y;
      for (int k = 0; k < description_.n_drive; ++k) {
        candidate.drive_rad_per_s[static_cast<std::size_t>(k)] += length * direction[k];
      }
      for (int k = 0; k < description_.n_steer; ++k) {
        candidate.steer_rad[static_cast<std::size_t>(k)] +=
            length * direction[description_.n_drive + k];
      }
      const RowVector r_candidate = residual(candidate);
      if (r_candidate.norm() < r.norm()) {
        y = candidate;
        r = r_candidate;
        return true;
      }
    }
    residual(y);  // brings rows_ back to y
    return false;
  }

  const KinematicModel& model_;
  const ModelDescription& description_;
  const Twist xi_;
  const Intrinsics& x_WI_;
  const RowVector& slip_;
  RowSystem rows_;
};

}  // namespace

Status solve_inverse(const KinematicModel& model, const ModelDescription& description,
                     const Twist& xi, const Intrinsics& x_WI, const RowVector& slip,
                     EncoderSample& y) {
  InverseProblem problem(model, description, xi, x_WI, slip);
  // A steering angle square to the motion is a stationary point: other starts lead away from it.
  for (const double turn : {0., 0.4, -0.4, 1.2, -1.2, 2.5}) {
    EncoderSample start = y;
    for (int i = 0; i < description.n_steer; ++i) {
      start.steer_rad[static_cast<std::size_t>(i)] += turn;
    }
    if (problem.solve(start)) {
      y = start;
      return Status::kOk;
    }
  }
  return Status::kRejected;
}

}  // namespace viwo::sim

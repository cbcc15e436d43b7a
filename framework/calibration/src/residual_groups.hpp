// The residuals of a batch calibration by kind: how large their noise is, and whether it persists.
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "calibration_problem.hpp"

namespace viwo::calibration {

/// Residuals of one kind, and their information about all unknowns [shared, own of each
/// recording].
struct NoiseGroup {
  Eigen::MatrixXd information;  ///< J^T J
  double squares = 0.;
  int residuals = 0;
  std::vector<Eigen::VectorXd> batches;  ///< J^T r, of segments that follow each other
};

/// All residuals at a solution, by kind.
using Linearisation = std::array<NoiseGroup, kResidualKinds>;

inline std::size_t index(ResidualKind kind) { return static_cast<std::size_t>(kind); }

/// How the gradients of the batches scatter (CAL-14).
struct Persistence {
  /// By how much what is left adds up over time, where it would cancel if it were white: 1 for
  /// white noise.
  double ratio = 0.;
  /// About their mean: variance times a chi-square of so many degrees of freedom.
  double squares = 0., dof = 0.;
};

Persistence persistence(const NoiseGroup& group);

/// Squares over redundancy, less the two by which the variance of what is estimated is larger
/// where its noise is found in as few numbers (Student's t). What fits exactly, or has little to
/// spare, says nothing about its own size: 0.
/// `P`: covariance of the unknowns.
double variance_of(const NoiseGroup& group, const Eigen::MatrixXd& P);

/// What the residuals of the parity, of which there are few, and its batches, which are many, say
/// together; the residuals alone where chance does not let the two differ as much (CAL-17).
double variance_of_parity(const Linearisation& at, const Eigen::MatrixXd& P);

}  // namespace viwo::calibration

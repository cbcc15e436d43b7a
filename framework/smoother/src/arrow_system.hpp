// Normal equations of one recording: many unknowns of its own, of which each knows but few others,
// and a few that are shared by all recordings. Equations: docs/math/smoother.md.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

namespace viwo::smoother {

/// Which unknown: of the recording from 0 on, shared ones as ~0, ~1, ...
inline constexpr int shared(int index) { return ~index; }
/// None: what is held.
inline constexpr int kHeld = std::numeric_limits<int>::min();

class ArrowSystem {
 public:
  explicit ArrowSystem(int n_shared);

  /// Adds the cost dx^T Lambda dx - 2 eta^T dx of the unknowns `columns`, of which some may be
  /// the same; only the lower triangle of Lambda is read.
  void add(std::span<const int> columns, const Eigen::Ref<const Eigen::MatrixXd>& Lambda,
           const Eigen::Ref<const Eigen::VectorXd>& eta);

  /// Takes the recording's own unknowns out (SM-4). False when they are not determined.
  bool eliminate();
  /// After eliminate(): what is left of the shared ones.
  const Eigen::MatrixXd& Lambda() const { return Lambda_; }
  const Eigen::VectorXd& eta() const { return eta_; }
  /// After eliminate(): the own unknowns where the shared ones are `dx_shared` (SM-5).
  Eigen::VectorXd own(const Eigen::VectorXd& dx_shared) const;

 private:
  void gather();

  int n_own_ = 0;
  std::vector<Eigen::Triplet<double>> triplets_;  ///< of the own ones, not in own_ yet
  std::vector<Eigen::Triplet<double>> across_;    ///< own x shared
  std::vector<double> eta_own_;
  Eigen::SparseMatrix<double> own_;
  Eigen::MatrixXd Lambda_;
  Eigen::VectorXd eta_;
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> llt_;
  Eigen::MatrixXd by_shared_;  ///< own^-1 across
  Eigen::VectorXd alone_;      ///< own^-1 eta
};

}  // namespace viwo::smoother

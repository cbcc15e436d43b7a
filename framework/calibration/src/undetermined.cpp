#include "undetermined.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

namespace viwo::calibration {

std::vector<UndeterminedDirection> undetermined_of(const Eigen::MatrixXd& P,
                                                   const Eigen::MatrixXd& root,
                                                   const std::vector<int>& free,
                                                   const std::vector<IntrinsicSpec>& specs) {
  std::vector<UndeterminedDirection> out;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(P);
  for (Eigen::Index k = P.rows() - 1; k >= 0 && eigen.eigenvalues()[k] > 0.5; --k) {
    UndeterminedDirection direction;
    direction.sigma_ratio = std::sqrt(eigen.eigenvalues()[k]);
    const Eigen::VectorXd along = (root * eigen.eigenvectors().col(k)).normalized();
    for (Eigen::Index i = 0; i < P.rows(); ++i) {
      const auto index = static_cast<std::size_t>(free[static_cast<std::size_t>(i)]);
      direction.weights.emplace_back(specs[index].name, along[i]);
    }
    std::stable_sort(
        direction.weights.begin(), direction.weights.end(),
        [](const auto& a, const auto& b) { return std::abs(a.second) > std::abs(b.second); });
    out.push_back(std::move(direction));
  }
  return out;
}

}  // namespace viwo::calibration

#include "relinearisation.hpp"

#include <Eigen/LU>

#include "viwo/math/so3.hpp"

namespace viwo::visual {
namespace {

Eigen::MatrixXd information_of(const InformationFactor& factor) {
  const int size = factor.columns.size();
  return factor.Lambda.topLeftCorner(size, size).selfadjointView<Eigen::Lower>();
}

}  // namespace

Relinearisation::Relinearisation(const FilterView& prior, Window& window,
                                 const InformationFactor& factor)
    : clones_(prior.clones.begin(), prior.clones.end()), view_(prior) {
  const int size = window.size();
  const auto P = window.covariance().topLeftCorner(size, size);
  const Eigen::MatrixXd M = Eigen::MatrixXd::Identity(size, size) + information_of(factor) * P;
  dx_ = P * M.partialPivLu().solve(factor.eta.head(size));
  dx_.tail(size - window.clone_columns()).setZero();
  for (CloneState& clone : clones_) {
    const int index = clone.column < 0 ? -1 : window.clone_in_slot(clone.slot);
    if (index < 0) continue;
    const int column = window.clone(index).column;
    clone.R_GtoI = exp_so3(-dx_.segment<3>(column)) * clone.R_GtoI;
    clone.p_IinG += dx_.segment<3>(column + 3);
  }
  view_.clones = clones_;
}

void Relinearisation::move_back(InformationFactor& factor) const {
  factor.eta.head(dx_.size()) += information_of(factor) * dx_;
}

}  // namespace viwo::visual

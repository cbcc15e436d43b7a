// Numbers of state blocks outside of a filter.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "viwo/api/block.hpp"

namespace viwo::smoother {

/// `value` moved by an error `dx` of its entries: R = Exp(-dtheta) R_hat, numbers add.
void retract(const BlockSpec& spec, const Eigen::Ref<const Eigen::VectorXd>& dx,
             std::vector<double>& value);

/// The error that moves `from` to `to`.
Eigen::VectorXd difference(const BlockSpec& spec, const std::vector<double>& to,
                           const std::vector<double>& from);

}  // namespace viwo::smoother

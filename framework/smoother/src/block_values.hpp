// Numbers of state blocks outside of a filter.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "viwo/filter/state_blocks.hpp"

namespace viwo::smoother {

/// A declared block as it stands, in the layout of BlockSpec::value.
std::vector<double> value_of(const StateBlocks& blocks, std::size_t block);

/// `value` moved by an error `dx` of its entries: R = Exp(-dtheta) R_hat, numbers add.
void retract(const BlockSpec& spec, const Eigen::Ref<const Eigen::VectorXd>& dx,
             std::vector<double>& value);

/// The error that moves `from` to `to`.
Eigen::VectorXd difference(const BlockSpec& spec, const std::vector<double>& to,
                           const std::vector<double>& from);

}  // namespace viwo::smoother

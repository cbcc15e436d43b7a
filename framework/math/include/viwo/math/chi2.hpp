// Chi-square quantiles, for gates and consistency bounds.
#pragma once

#include <boost/math/distributions/chi_squared.hpp>

namespace viwo {

/// x with P(chi2_dof <= x) = probability; probability in (0, 1), dof >= 1.
inline double chi2_quantile(double probability, double dof) {
  return boost::math::quantile(boost::math::chi_squared(dof), probability);
}

}  // namespace viwo

#include "viwo/sim/quintic_spline.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "viwo/api/status.hpp"

namespace viwo::sim {
namespace {

constexpr int kOrder = 6;  // functions that are not zero within an interval
using Weights = std::array<double, kOrder>;

struct Basis {
  Weights value{};
  Weights rate{};          // per interval
  Weights acceleration{};  // per interval squared
};

double at_or_zero(const Weights& w, int j) {
  return j >= 0 && j < kOrder ? w[static_cast<std::size_t>(j)] : 0.;
}

/// The functions that are not zero within an interval, u in [0, 1] along it: the recursion of
/// Cox and de Boor for knots one apart (SIM-2).
Basis basis_at(double u) {
  std::array<Weights, kOrder> by_degree{};
  by_degree[0][0] = 1.;
  for (int k = 1; k < kOrder; ++k) {
    const Weights& lower = by_degree[static_cast<std::size_t>(k - 1)];
    for (int j = 0; j <= k; ++j) {
      by_degree[static_cast<std::size_t>(k)][static_cast<std::size_t>(j)] =
          ((u - j + k) * at_or_zero(lower, j - 1) + (j + 1 - u) * at_or_zero(lower, j)) / k;
    }
  }
  Basis basis;
  basis.value = by_degree[5];
  for (int j = 0; j < kOrder; ++j) {
    const auto i = static_cast<std::size_t>(j);
    basis.rate[i] = at_or_zero(by_degree[4], j - 1) - at_or_zero(by_degree[4], j);
    basis.acceleration[i] = at_or_zero(by_degree[3], j - 2) - 2. * at_or_zero(by_degree[3], j - 1) +
                            at_or_zero(by_degree[3], j);
  }
  return basis;
}

struct Place {
  Eigen::Index interval;
  double u;
};

Place place_of(double t_s, double begin_s, double spacing_s, Eigen::Index n_intervals) {
  const double along = (t_s - begin_s) / spacing_s;
  const double interval = std::clamp(std::floor(along), 0., static_cast<double>(n_intervals - 1));
  return {static_cast<Eigen::Index>(interval), along - interval};
}

/// Normal equations, of which only the lower band is kept: entry (i + d, i) in band(d, i).
struct NormalEquations {
  Eigen::Matrix<double, kOrder, Eigen::Dynamic> band;
  Eigen::Matrix<double, Eigen::Dynamic, 6> right;

  explicit NormalEquations(Eigen::Index n) {
    band.setZero(kOrder, n);
    right.setZero(n, 6);
  }

  void add_row(Eigen::Index first, const double* weights, int n, double importance) {
    for (int a = 0; a < n; ++a) {
      for (int b = 0; b <= a; ++b) {
        band(a - b, first + b) += importance * weights[a] * weights[b];
      }
    }
  }

  Eigen::Matrix<double, Eigen::Dynamic, 6> solve() const {
    std::vector<Eigen::Triplet<double>> entries;
    for (Eigen::Index i = 0; i < band.cols(); ++i) {
      for (Eigen::Index d = 0; d < kOrder && i + d < band.cols(); ++d) {
        entries.emplace_back(static_cast<int>(i + d), static_cast<int>(i), band(d, i));
      }
    }
    Eigen::SparseMatrix<double> matrix(band.cols(), band.cols());
    matrix.setFromTriplets(entries.begin(), entries.end());
    // The band needs no other order of the unknowns.
    const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower,
                               Eigen::NaturalOrdering<int>>
        cholesky(matrix);
    Eigen::Matrix<double, Eigen::Dynamic, 6> solution;
    if (cholesky.info() == Eigen::Success) solution = cholesky.solve(right);
    if (solution.rows() == 0 || !solution.allFinite()) {
      throw InputError("the poses do not determine a spline (gaps longer than its knot spacing?)");
    }
    return solution;
  }
};

}  // namespace

QuinticSpline QuinticSpline::fit(const std::vector<double>& times_s,
                                 const Eigen::Matrix<double, 6, Eigen::Dynamic>& values,
                                 const SplineFit& options) {
  if (times_s.empty() || values.cols() != static_cast<Eigen::Index>(times_s.size()) ||
      !(options.knot_spacing_s > 0.) || !(options.end_s > options.begin_s)) {
    throw InputError("a spline needs samples, a length and a knot spacing");
  }
  QuinticSpline spline(options.begin_s, options.knot_spacing_s);
  const auto n_intervals = static_cast<Eigen::Index>(
      std::ceil((options.end_s - options.begin_s) / options.knot_spacing_s - 1e-9));
  NormalEquations equations(n_intervals + 5);
  // Relative to the first sample, so that what does not move at all comes out exactly.
  const Vector6d origin = values.col(0);
  for (std::size_t k = 0; k < times_s.size(); ++k) {
    const Place place = place_of(times_s[k], options.begin_s, options.knot_spacing_s, n_intervals);
    if (!(place.u >= -1e-6 && place.u <= 1. + 1e-6)) {
      throw InputError("a sample lies outside of the spline");
    }
    const Basis basis = basis_at(place.u);
    equations.add_row(place.interval, basis.value.data(), kOrder, 1.);  // (SIM-3)
    const Vector6d value = values.col(static_cast<Eigen::Index>(k)) - origin;
    for (int j = 0; j < kOrder; ++j) {
      equations.right.row(place.interval + j) +=
          basis.value[static_cast<std::size_t>(j)] * value.transpose();
    }
  }
  if (options.smoothing > 0.) {
    constexpr std::array kThirdDifference{-1., 3., -3., 1.};
    for (Eigen::Index i = 0; i + 3 < n_intervals + 5; ++i) {
      equations.add_row(i, kThirdDifference.data(), 4, options.smoothing);
    }
  }
  spline.controls_ = equations.solve().transpose();
  spline.controls_.colwise() += origin;
  return spline;
}

QuinticSpline::Point QuinticSpline::at(double t_s) const {
  const double slack = 1e-9 * spacing_s_;
  if (!(t_s >= begin_s() - slack && t_s <= end_s() + slack)) {
    throw std::out_of_range("the trajectory has no time " + std::to_string(t_s) + " s");
  }
  const Place place = place_of(t_s, begin_s_, spacing_s_, n_intervals());
  const Basis basis = basis_at(place.u);
  const auto controls = controls_.middleCols<kOrder>(place.interval);
  const auto weighted = [&controls](const Weights& weights) -> Vector6d {
    return controls * Eigen::Map<const Vector6d>(weights.data());
  };
  return {weighted(basis.value), weighted(basis.rate) / spacing_s_,
          weighted(basis.acceleration) / (spacing_s_ * spacing_s_)};
}

}  // namespace viwo::sim

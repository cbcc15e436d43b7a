// Six functions of time as one uniform quintic B-spline: four times continuously differentiable,
// with analytic derivatives.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace viwo::sim {

using Vector6d = Eigen::Matrix<double, 6, 1>;

struct SplineFit {
  double begin_s = 0.;         ///< the spline covers begin_s to at least end_s
  double end_s = 0.;           ///< > begin_s
  double knot_spacing_s = 0.;  ///< > 0
  /// Weight of the squared third differences of the control points against the squared deviations
  /// from the samples: what decides where there are no samples. 0: none.
  double smoothing = 0.;
};

class QuinticSpline {
 public:
  struct Point {
    Vector6d value;
    Vector6d rate;          ///< per second
    Vector6d acceleration;  ///< per second squared
  };

  /// Linear least squares through samples (`values`: one column for each of `times_s`). The
  /// constant zero comes out as exactly that, and so does any other constant. InputError when the
  /// samples leave a control point undetermined, or are not finite.
  static QuinticSpline fit(const std::vector<double>& times_s,
                           const Eigen::Matrix<double, 6, Eigen::Dynamic>& values,
                           const SplineFit& options);

  double begin_s() const { return begin_s_; }
  double end_s() const { return begin_s_ + spacing_s_ * static_cast<double>(n_intervals()); }

  /// std::out_of_range outside of begin_s() .. end_s().
  Point at(double t_s) const;

 private:
  QuinticSpline(double begin_s, double spacing_s) : begin_s_(begin_s), spacing_s_(spacing_s) {}

  Eigen::Index n_intervals() const { return controls_.cols() - 5; }

  double begin_s_;
  double spacing_s_;
  Eigen::Matrix<double, 6, Eigen::Dynamic> controls_;
};

}  // namespace viwo::sim

// What a quantity of the intervals before tells of the next one.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include <Eigen/Core>

namespace viwo::wheel_odometry {

/// How a vector goes with itself `kLag` intervals before, over the latest ones: a weight of `kept`
/// for each interval that follows.
template <int kSize, std::size_t kLag>
class Lagged {
 public:
  using Vector = Eigen::Matrix<double, kSize, 1>;

  void add(const Vector& now, double kept) {
    products_ = kept * products_ + now.dot(before());
    squares_ = kept * squares_ + before().squaredNorm();
    std::shift_right(latest_.begin(), latest_.end(), 1);
    latest_.front() = now;
  }

  /// With itself kLag intervals before, summed.
  double products() const { return products_; }
  /// The same over the squares of what was before.
  double correlation() const { return products_ / squares_; }
  /// What of before() is to be expected of the vector that follows, at most all of it.
  double share() const { return std::min(correlation(), 1.); }
  /// The one kLag intervals before that which follows.
  const Vector& before() const { return latest_.back(); }

 private:
  static std::array<Vector, kLag> none() {
    std::array<Vector, kLag> zeros;
    zeros.fill(Vector::Zero());
    return zeros;
  }

  std::array<Vector, kLag> latest_ = none();  ///< the newest first
  double products_ = 0., squares_ = 0.;
};

}  // namespace viwo::wheel_odometry

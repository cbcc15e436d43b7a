// Series of a run that may go on for days: a number of points that has a bound.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace viwo {

/// Keeps all points until there are `most`; then every second one, every fourth, ... of all that
/// came, evenly.
template <class T>
class BoundedSeries {
 public:
  explicit BoundedSeries(std::size_t most) : most_(most) {}

  void add(T point) {
    if (n_++ % stride_ != 0) return;
    points_.push_back(std::move(point));
    if (points_.size() < most_) return;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < points_.size(); i += 2) points_[kept++] = std::move(points_[i]);
    points_.resize(kept);
    stride_ *= 2;
  }
  const std::vector<T>& points() const { return points_; }

 private:
  std::size_t most_;
  std::uint64_t n_ = 0;
  std::uint64_t stride_ = 1;
  std::vector<T> points_;
};

}  // namespace viwo

// Mean rates over the cells of a grid in time, of what holds over times of its own.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/series/recording.hpp"

namespace viwo::series {

class RateGrid {
 public:
  static constexpr std::int64_t kCellNs = 10'000'000;
  static constexpr double kCell_s = 1e-9 * kCellNs;

  RateGrid() = default;
  /// From `begin_ns` to `end_ns`; turns that are longer than 0.2 s, and than two and a
  /// half as long as usual, are gaps.
  RateGrid(std::int64_t begin_ns, std::int64_t end_ns, std::span<const Turn> turns);

  std::size_t size() const { return rates_.size(); }
  std::int64_t begin_ns() const { return begin_ns_; }
  /// Of a cell; NaN where nothing is known.
  const Eigen::Vector3d& operator[](std::size_t cell) const { return rates_[cell]; }
  bool has(std::size_t cell) const { return rates_[cell].allFinite(); }

 private:
  std::int64_t begin_ns_ = 0;
  std::vector<Eigen::Vector3d> rates_;
};

/// Their median length, s; 0 for none.
double period_of(std::span<const Turn> turns);

/// Rate of the gyro in I, between its readings.
std::vector<Turn> turns_of(std::span<const ImuSample> imu);
/// About the vertical, as z, between headings.
std::vector<Turn> turns_of(std::span<const HeadingSample> headings);
/// Of a trajectory, in the frame of its body.
std::vector<Turn> turns_of(const Trajectory& poses);
/// Twists [v_x, v_y, omega] of O instead of rates, shifted by what the configuration says of the
/// clock.
std::vector<Turn> twists_of(const Wheels& wheels);
/// About the z axis of O.
std::vector<Turn> turns_of(const Wheels& wheels);

/// The same with every rate multiplied by R from the left.
std::vector<Turn> rotated(std::vector<Turn> turns, const Eigen::Matrix3d& R);
/// The component along `axis` alone, as z.
std::vector<Turn> about(std::vector<Turn> turns, const Eigen::Vector3d& axis);
std::vector<Turn> shifted(std::vector<Turn> turns, double seconds);

/// What a gyro says of the turns about the vertical, as z; of an IMU whose accelerometer has no
/// direction about what the mounting has for it.
struct YawRates {
  std::string label;
  std::vector<Turn> turns;
};
/// Of the IMU, and of all that integrate for themselves.
std::vector<YawRates> yaw_rates_of(const Recording& recording, const WheelsPrior& prior);

/// The time of grids: that of the IMU, or of the first wheels that gave samples; empty without
/// them.
struct Span {
  std::int64_t begin_ns = 0, end_ns = 0;
};
Span span_of(const Recording& recording);

}  // namespace viwo::series

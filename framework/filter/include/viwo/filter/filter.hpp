// The filter: inertial state, ring of clones, calibration blocks and their covariance. Knows
// nothing of cameras or wheels beyond where their errors stand in the state.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/update.hpp"
#include "viwo/filter/covariance.hpp"
#include "viwo/filter/held_directions.hpp"

namespace viwo {

struct FilterOptions {
  int clones = 11;  ///< kept between epochs; one more exists during an update
  bool first_estimates = true;
  ImuNoise imu_noise;
  double gravity_m_per_s2 = 9.81;
};

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Vector8d = Eigen::Matrix<double, 8, 1>;

/// A camera with the prior of its calibration; all-zero sigmas hold a block.
struct CameraPrior {
  CameraView camera;
  Vector6d sigma_extrinsics = Vector6d::Zero();  ///< rad x 3, m x 3
  Vector8d sigma_intrinsics = Vector8d::Zero();  ///< px x 4, 1 x 4
};

/// A wheel set with the prior of its calibration; all-zero sigmas hold a block, single zeros hold
/// an entry.
struct WheelsPrior {
  std::string name;  ///< in front of its parameters; "" for nothing
  WheelsView wheels;
  Vector6d sigma_extrinsics = Vector6d::Zero();  ///< rad x 3, m x 3
  double sigma_time_offset_s = 0.;
  Intrinsics sigma_intrinsics;
};

/// An inertial state to start from.
struct ImuPrior {
  std::int64_t t_ns = 0;
  ImuView state;  ///< first estimates are ignored
  ImuMatrix P = ImuMatrix::Zero();
};

class Filter {
 public:
  /// Allocates all that is ever needed. std::invalid_argument for priors that are negative or not
  /// finite, and for sizes that do not fit.
  Filter(const FilterOptions& options, std::vector<CameraPrior> cameras,
         std::vector<WheelsPrior> wheels);

  void initialize(const ImuPrior& prior);
  bool initialized() const { return t_ns_ != kNever; }

  /// Moves the inertial state to the stamp of the last sample; the first one is at t_ns(). Returns
  /// the transition (identity, without noise, for no samples).
  ImuTransition propagate(std::span<const ImuSample> samples);
  /// Appends the present pose; `sample` is the IMU reading at t_ns(). There must be room (drop the
  /// oldest clone first).
  void clone(const ImuSample& sample);
  void drop_oldest_clone();
  /// True when the oldest clone is to leave: as many exist as fit, or as the limit allows.
  bool window_full() const { return clones_.size() >= std::min(slots_.size(), window_limit_); }
  /// Makes the window shorter than there is room for; at least 2.
  void limit_window(std::size_t clones) { window_limit_ = std::max<std::size_t>(clones, 2); }

  /// Applies a factor and corrects the estimate.
  FactorResult apply(const ResidualFactor& factor);
  FactorResult apply(const InformationFactor& factor);
  /// What of the calibration of the wheels the factors to come are to leave alone.
  HeldDirections& held() { return held_; }
  const HeldDirections& held() const { return held_; }
  /// What the last apply() corrected the estimate by; zero unless its factor was applied.
  const Eigen::VectorXd& correction() const { return dx_; }

  /// Why the filter cannot go on; empty as long as it can.
  std::string failure() const;

  std::int64_t t_ns() const { return t_ns_; }
  const FilterOptions& options() const { return options_; }
  const ImuView& imu() const { return imu_; }
  std::span<const CloneView> clones() const { return clones_; }
  std::span<const CameraView> cameras() const { return cameras_; }
  std::span<const WheelsView> wheels() const { return wheels_; }
  const Eigen::MatrixXd& covariance() const { return covariance_.matrix(); }
  int size() const { return covariance_.size(); }
  /// What an update of the wheel set `wheels` (-1: of none) sees.
  FilterView view(int wheels) const;

 private:
  static constexpr std::int64_t kNever = -1;
  static int state_size(const FilterOptions& options, std::span<const CameraPrior> cameras,
                        std::span<const WheelsPrior> wheels);
  int place(const Eigen::VectorXd& sigma, int& next);
  template <class Factor>
  FactorResult apply_factor(const Factor& factor);
  void correct();

  FilterOptions options_;
  std::int64_t t_ns_ = kNever;
  ImuView imu_;
  std::vector<CloneView> clones_;  // oldest first
  std::vector<bool> slots_;        // taken
  std::size_t window_limit_ = std::numeric_limits<std::size_t>::max();
  std::vector<CameraView> cameras_;
  std::vector<WheelsView> wheels_;
  Covariance covariance_;
  HeldDirections held_;
  Eigen::VectorXd dx_;
  bool covariance_failed_ = false;
};

}  // namespace viwo

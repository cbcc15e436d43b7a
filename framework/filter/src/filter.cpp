#include "viwo/filter/filter.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "viwo/math/arrays.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

int count_unless_held(const Eigen::VectorXd& sigma) {
  if (!sigma.allFinite() || (sigma.array() < 0.).any()) {
    throw std::invalid_argument("a prior sigma is negative or not finite");
  }
  return sigma.isZero(0.) ? 0 : static_cast<int>(sigma.size());
}

/// R <- Exp(-dtheta) R; exactly R for no correction.
void turn(Eigen::Matrix3d& R, const Eigen::Vector3d& dtheta) {
  if (!dtheta.isZero(0.)) R = normalized_rotation(exp_so3(-dtheta) * R);
}

}  // namespace

int Filter::state_size(const FilterOptions& options, std::span<const CameraPrior> cameras,
                       std::span<const WheelsPrior> wheels) {
  if (options.clones < 2 || options.clones > 100) {
    throw std::invalid_argument("the number of clones must be within 2 .. 100");
  }
  int size = kImuSize + kPoseSize * (options.clones + 1);
  for (const CameraPrior& prior : cameras) {
    size += count_unless_held(prior.sigma_extrinsics) + count_unless_held(prior.sigma_intrinsics);
  }
  for (const WheelsPrior& prior : wheels) {
    if (prior.sigma_intrinsics.size() != prior.wheels.x_WI.size()) {
      throw std::invalid_argument("each intrinsic of a wheel set needs a prior sigma");
    }
    size += count_unless_held(prior.sigma_extrinsics) + (prior.sigma_time_offset_s > 0. ? 1 : 0) +
            count_unless_held(prior.sigma_intrinsics);
  }
  return size;
}

int Filter::place(const Eigen::VectorXd& sigma, int& next) {
  const int count = count_unless_held(sigma);
  if (count == 0) return -1;
  const int column = next;
  covariance_.set_block(column, sigma.cwiseAbs2().asDiagonal());
  next += count;
  return column;
}

Filter::Filter(const FilterOptions& options, std::vector<CameraPrior> cameras,
               std::vector<WheelsPrior> wheels)
    : options_(options),
      slots_(static_cast<std::size_t>(std::max(options.clones, 0)) + 1, false),
      covariance_(state_size(options, cameras, wheels)),
      dx_(Eigen::VectorXd::Zero(covariance_.size())) {
  clones_.reserve(slots_.size());
  int next = kImuSize + kPoseSize * (options.clones + 1);
  for (CameraPrior& prior : cameras) {
    prior.camera.extrinsics_column = place(prior.sigma_extrinsics, next);
    prior.camera.intrinsics_column = place(prior.sigma_intrinsics, next);
    cameras_.push_back(prior.camera);
  }
  held_ = HeldDirections(next, size() - next);  // the wheels come last
  for (WheelsPrior& prior : wheels) {
    prior.wheels.extrinsics_column = place(prior.sigma_extrinsics, next);
    prior.wheels.time_offset_column =
        place(Eigen::VectorXd::Constant(1, prior.sigma_time_offset_s), next);
    prior.wheels.intrinsics_column = place(prior.sigma_intrinsics, next);
    wheels_.push_back(prior.wheels);
  }
}

void Filter::initialize(const ImuPrior& prior) {
  t_ns_ = prior.t_ns;
  imu_ = prior.state;
  imu_.R_GtoI_fej = imu_.R_GtoI;
  imu_.p_IinG_fej = imu_.p_IinG;
  imu_.v_IinG_fej = imu_.v_IinG;
  clones_.clear();
  std::fill(slots_.begin(), slots_.end(), false);
  covariance_.set_block(0, prior.P);
}

ImuTransition Filter::propagate(std::span<const ImuSample> samples) {
  if (samples.empty()) return {ImuMatrix::Identity(), ImuMatrix::Zero()};
  if (!options_.first_estimates) {
    imu_.R_GtoI_fej = imu_.R_GtoI;
    imu_.p_IinG_fej = imu_.p_IinG;
    imu_.v_IinG_fej = imu_.v_IinG;
  }
  const ImuTransition transition =
      viwo::propagate(samples, options_.imu_noise, options_.gravity_m_per_s2, imu_);
  covariance_.propagate(transition);
  t_ns_ = samples.back().t_ns;
  return transition;
}

void Filter::clone(const ImuSample& sample) {
  const auto free = std::find(slots_.begin(), slots_.end(), false);
  if (free == slots_.end()) throw std::logic_error("no room for another clone");
  *free = true;
  CloneView clone;
  clone.t_ns = t_ns_;
  clone.slot = static_cast<int>(free - slots_.begin());
  clone.column = kImuSize + kPoseSize * clone.slot;
  clone.R_GtoI = clone.R_GtoI_fej = imu_.R_GtoI;
  clone.p_IinG = clone.p_IinG_fej = imu_.p_IinG;
  clone.w_IinI = to_vector(sample.gyro_rad_per_s) - imu_.gyro_bias;
  clone.v_IinG = imu_.v_IinG;
  clones_.push_back(clone);
  covariance_.clone_pose(clone.column);
}

void Filter::drop_oldest_clone() {
  if (clones_.empty()) return;
  const CloneView& oldest = clones_.front();
  slots_[static_cast<std::size_t>(oldest.slot)] = false;
  covariance_.clear_block(oldest.column, kPoseSize);
  clones_.erase(clones_.begin());
}

template <class Factor>
FactorResult Filter::apply_factor(const Factor& factor) {
  held_.before(covariance_.matrix());
  const FactorResult result = covariance_.apply(factor, dx_);
  if (result == FactorResult::kApplied) {
    covariance_.hold(held_, dx_);
    correct();
  }
  return result;
}

FactorResult Filter::apply(const ResidualFactor& factor) { return apply_factor(factor); }

FactorResult Filter::apply(const InformationFactor& factor) {
  const FactorResult result = apply_factor(factor);
  if (result == FactorResult::kFailed) covariance_failed_ = true;
  return result;
}

void Filter::correct() {
  turn(imu_.R_GtoI, dx_.segment<3>(kThetaColumn));
  imu_.p_IinG += dx_.segment<3>(kPositionColumn);
  imu_.v_IinG += dx_.segment<3>(kVelocityColumn);
  imu_.gyro_bias += dx_.segment<3>(kGyroBiasColumn);
  imu_.accel_bias += dx_.segment<3>(kAccelBiasColumn);
  for (CloneView& clone : clones_) {
    turn(clone.R_GtoI, dx_.segment<3>(clone.column));
    clone.p_IinG += dx_.segment<3>(clone.column + 3);
    if (!options_.first_estimates) {
      clone.R_GtoI_fej = clone.R_GtoI;
      clone.p_IinG_fej = clone.p_IinG;
    }
  }
  for (CameraView& camera : cameras_) {
    if (camera.extrinsics_column >= 0) {
      turn(camera.R_ItoC, dx_.segment<3>(camera.extrinsics_column));
      camera.p_IinC += dx_.segment<3>(camera.extrinsics_column + 3);
    }
    if (camera.intrinsics_column >= 0)
      camera.intrinsics += dx_.segment<8>(camera.intrinsics_column);
  }
  for (WheelsView& wheels : wheels_) {
    if (wheels.extrinsics_column >= 0) {
      turn(wheels.R_ItoO, dx_.segment<3>(wheels.extrinsics_column));
      wheels.p_IinO += dx_.segment<3>(wheels.extrinsics_column + 3);
    }
    if (wheels.time_offset_column >= 0) wheels.t_OtoI_s += dx_[wheels.time_offset_column];
    if (wheels.intrinsics_column >= 0) {
      wheels.x_WI += dx_.segment(wheels.intrinsics_column, wheels.x_WI.size());
    }
  }
}

std::string Filter::failure() const {
  if (covariance_failed_) return "the covariance of the clones is not positive definite any more";
  const auto& P = covariance_.matrix();
  const bool finite = imu_.R_GtoI.allFinite() && imu_.p_IinG.allFinite() &&
                      imu_.v_IinG.allFinite() && imu_.gyro_bias.allFinite() &&
                      imu_.accel_bias.allFinite() && P.diagonal().allFinite();
  if (!finite) return "the estimate or its covariance is not finite any more";
  if ((P.diagonal().array() < 0.).any()) return "a variance is negative";
  for (const WheelsView& wheels : wheels_) {
    if (!wheels.x_WI.allFinite() || !wheels.R_ItoO.allFinite() || !wheels.p_IinO.allFinite() ||
        !std::isfinite(wheels.t_OtoI_s)) {
      return "the calibration of the wheels is not finite any more";
    }
  }
  return "";
}

FilterView Filter::view(int wheels) const {
  FilterView view;
  view.imu = imu_;
  view.clones = clones_;
  view.cameras = cameras_;
  if (wheels >= 0) view.wheels = &wheels_[static_cast<std::size_t>(wheels)];
  view.imu_noise = options_.imu_noise;
  view.gravity_m_per_s2 = options_.gravity_m_per_s2;
  view.oldest_leaves = window_full();
  view.size = covariance_.size();
  view.covariance_data = covariance_.matrix().data();
  view.covariance_stride = covariance_.size();
  return view;
}

}  // namespace viwo

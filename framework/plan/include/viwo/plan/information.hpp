// What encoders of a motion will tell a batch calibration of the intrinsics, before it is driven.
// Equations: docs/math/plan.md.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include <Eigen/Core>

#include "viwo/api/params.hpp"
#include "viwo/wheel/preintegration.hpp"

namespace viwo::plan {

/// What is known of the motion beside the wheels, and how noisy all of it is.
struct KnowledgeParams {
  bool gyro = true;
  double sigma_gyro_rad_per_s_sqrt_hz = 1e-3;
  double prior_sigma_gyro_bias_rad_per_s = 0.02;
  bool distance = false;
  double sigma_distance_m = 0.005;
  double wheel_noise_scale = 1.;

  void bind(ParamBinder& b);
};

/// Sigmas of the intrinsics before a drive; 0 where the gauge holds one, which puts what it may be
/// off by into the others (CAL-18).
Intrinsics sigma_before(const WheelModel& model);

/// Information adds up over a drive. Unknowns are the intrinsics and the bias of the gyro, in units
/// of their prior sigmas.
struct Information {
  Eigen::MatrixXd N;     ///< of parity and turns (PL-1)
  Eigen::VectorXd path;  ///< derivative of the path of O, m

  static Information zero(int n_intrinsics);
  Information& operator+=(const Information& other);
  Information& operator*=(double factor);
};

/// Information of encoder samples at the nominal intrinsics. Holds scratch memory: one object per
/// thread.
class WheelInformation {
 public:
  WheelInformation(std::shared_ptr<const WheelModel> model, const KnowledgeParams& known);

  /// Of the samples between two stamps, which they must cover (std::logic_error).
  Information of(std::span<const EncoderSample> samples, std::int64_t begin_ns,
                 std::int64_t end_ns);

  /// What is known before a drive, instead of the prior of the model: covariance of the intrinsics,
  /// zero of those that are held. InputError where that is none.
  void set_known(const Eigen::MatrixXd& P);
  /// Covariance of the unknowns in prior units after a drive (PL-2).
  Eigen::MatrixXd covariance(const Information& drive) const;
  /// Sigmas of the intrinsics, 0 where the gauge holds one.
  Intrinsics sigma(const Information& drive) const;

  const WheelModel& model() const { return *model_; }
  const KnowledgeParams& known() const { return known_; }

 private:
  void add_turns_and_parity(std::span<const EncoderSample> samples, std::int64_t begin_ns,
                            std::int64_t end_ns, Information& out);
  void add_path(std::span<const EncoderSample> samples, std::int64_t begin_ns, std::int64_t end_ns,
                Information& out);

  std::shared_ptr<const WheelModel> model_;
  KnowledgeParams known_;
  Preintegrator preintegrator_;
  PreintegratedPose segment_;
  Eigen::MatrixXd before_;  ///< information without a drive, in prior units
};

}  // namespace viwo::plan

// The wheels as an instrument: what they measure over an interval for given intrinsics.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include <Eigen/Core>

#include "interval.hpp"
#include "viwo/wheel/preintegration.hpp"

namespace viwo::wheel_odometry {

/// Encoder samples, and the interval of the wheel clock that is meant.
struct Readings {
  std::span<const EncoderSample> samples;
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
};

/// For the derivative by time, ns: the rates of a few encoder samples are averaged.
inline constexpr std::int64_t kShiftNs = 50'000'000;

inline bool is_finite(const PreintegratedPose& pose) {
  return pose.g.allFinite() && pose.P_g.allFinite();
}

class Instrument {
 public:
  Instrument(std::shared_ptr<const WheelModel> model, const PreintegrationOptions& options)
      : preintegrator_(model, options), shifted_(std::move(model), options) {}

  const WheelModel& model() const { return preintegrator_.model(); }

  /// The weights of the rows stay there whatever the intrinsics.
  void set_weights_at(const Intrinsics& x_WI) {
    preintegrator_.set_intrinsics(x_WI);
    shifted_.set_intrinsics(x_WI);
  }

  /// Nothing where samples do not cover the interval.
  std::optional<PreintegratedPose> pose(const Readings& y, const Intrinsics& x_WI) {
    return integrate(preintegrator_, y, x_WI);
  }

  /// Of the encoders themselves, whose rates are less noisy than those of the IMU (WO-13); `pose`
  /// is that of the interval. From the clones where samples are missing.
  Rate rate(const Readings& y, const Point& at, const PreintegratedPose& pose) {
    const auto before =
        integrate(shifted_, {y.samples, y.begin_ns - kShiftNs, y.end_ns - kShiftNs}, at.x_WI);
    if (before && before->g.allFinite() && before->bridged_s == 0.) {
      return {(pose.g - before->g) / (1e-9 * kShiftNs), true};
    }
    return {wheel_motion::relative_pose_jacobian(at.first, at.last, at.mount)
                .col(wheel_motion::kTimeOffset),
            false};
  }

 private:
  static std::optional<PreintegratedPose> integrate(Preintegrator& preintegrator, const Readings& y,
                                                    const Intrinsics& x_WI) {
    preintegrator.move_intrinsics(x_WI);
    std::optional<PreintegratedPose> pose(std::in_place);
    if (!preintegrator.integrate(y.samples, y.begin_ns, y.end_ns, *pose)) pose.reset();
    return pose;
  }

  Preintegrator preintegrator_, shifted_;
};

}  // namespace viwo::wheel_odometry

// The wheels as an instrument: what they measure over an interval for given intrinsics.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include <Eigen/Core>

#include "interval.hpp"
#include "viwo/math/se2.hpp"
#include "viwo/wheel/preintegration.hpp"

namespace viwo::wheel_odometry {

/// Encoder samples, and the interval of the wheel clock that is meant.
struct Readings {
  std::span<const EncoderSample> samples;
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
};

inline bool is_finite(const PreintegratedPose& pose) {
  return pose.g.allFinite() && pose.P_g.allFinite();
}

class Instrument {
 public:
  Instrument(std::shared_ptr<const WheelModel> model, const PreintegrationOptions& options)
      : preintegrator_(model, options), part_(std::move(model), options) {}

  const WheelModel& model() const { return preintegrator_.model(); }

  /// The weights of the rows stay there whatever the intrinsics.
  void set_weights_at(const Intrinsics& x_WI) {
    preintegrator_.set_intrinsics(x_WI);
    part_.set_intrinsics(x_WI);
  }

  /// Nothing where samples do not cover the interval.
  std::optional<PreintegratedPose> pose(const Readings& y, const Intrinsics& x_WI) {
    return integrate(preintegrator_, y, x_WI);
  }

  /// How `pose`, that of the interval, changes when both ends move on: by how much the last third
  /// was faster than the first, whose noise is not in `pose` (WO-13). Nothing where samples are
  /// missing, or so few that a third is not made of its own.
  std::optional<Eigen::Vector3d> rate(const Readings& y, const Intrinsics& x_WI,
                                      const PreintegratedPose& pose) {
    const std::int64_t third_ns = (y.end_ns - y.begin_ns) / 3;
    const auto first = integrate(part_, {y.samples, y.begin_ns, y.begin_ns + third_ns}, x_WI);
    const auto last = integrate(part_, {y.samples, y.end_ns - third_ns, y.end_ns}, x_WI);
    const auto is_whole = [](const std::optional<PreintegratedPose>& part) {
      return part && is_finite(*part) && part->bridged_s == 0. && part->duration_s > 0.;
    };
    if (pose.samples < kFewestSamples || !is_whole(first) || !is_whole(last)) return std::nullopt;
    const Eigen::Vector3d u0 = log_se2(first->g) / first->duration_s;
    const Eigen::Vector3d u1 = log_se2(last->g) / last->duration_s;
    // They are those of the middles of the thirds.
    return moved_on(pose.g, 1.25 * u0 - 0.25 * u1, 1.25 * u1 - 0.25 * u0);
  }

 private:
  static constexpr std::int64_t kFewestSamples = 6;

  /// d/dt of the pose g of a frame that moves with the twists u0 at its beginning, u1 at its end.
  static Eigen::Vector3d moved_on(const Eigen::Vector3d& g, const Eigen::Vector3d& u0,
                                  const Eigen::Vector3d& u1) {
    Eigen::Vector3d rate;
    rate[0] = u1[0] - u0[0];
    rate.tail<2>() = R2(g[0]) * u1.tail<2>() - u0.tail<2>() - u0[0] * (J2() * g.tail<2>());
    return rate;
  }

  static std::optional<PreintegratedPose> integrate(Preintegrator& preintegrator, const Readings& y,
                                                    const Intrinsics& x_WI) {
    preintegrator.move_intrinsics(x_WI);
    std::optional<PreintegratedPose> pose(std::in_place);
    if (!preintegrator.integrate(y.samples, y.begin_ns, y.end_ns, *pose)) pose.reset();
    return pose;
  }

  Preintegrator preintegrator_, part_;
};

}  // namespace viwo::wheel_odometry

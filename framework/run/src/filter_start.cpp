#include "filter_start.hpp"

#include <algorithm>
#include <optional>
#include <string_view>

#include "viwo/math/arrays.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/setup/start_streams.hpp"
#include "viwo/sim/random.hpp"
#include "viwo/start/moving_start.hpp"
#include "viwo/start/standstill_start.hpp"
#include "viwo/start/visual_start.hpp"

namespace viwo {
namespace {

using Eigen::Vector3d;

/// Start at the first state of the reference, off by draws from the prior if asked for.
ImuPrior start_from_reference(const FilterSetup& setup, const StateSample& truth,
                              std::uint64_t seed) {
  const StartSetup& start = setup.start;
  sim::RandomStream random(seed, sim::Stream::kStartError);
  ImuPrior prior;
  prior.t_ns = truth.t_ns;
  const auto place = [&](int column, double sigma) {
    Vector3d error;
    for (int i = 0; i < 3; ++i) error[i] = start.state_error_scale * sigma * random.gaussian();
    prior.P.diagonal().segment<3>(column).setConstant(sigma * sigma);
    return error;
  };
  const Vector3d turn = place(kThetaColumn, start.sigma_orientation_rad);
  prior.state.R_GtoI = exp_so3(turn) * R_GtoI(truth);
  prior.state.p_IinG = to_vector(truth.p_IinG_m) - place(kPositionColumn, start.sigma_position_m);
  prior.state.v_IinG =
      to_vector(truth.v_IinG_m_per_s) - place(kVelocityColumn, start.sigma_velocity_m_per_s);
  prior.state.gyro_bias = to_vector(truth.gyro_bias_rad_per_s) -
                          place(kGyroBiasColumn, start.sigma_gyro_bias_rad_per_s);
  prior.state.accel_bias = to_vector(truth.accel_bias_m_per_s2) -
                           place(kAccelBiasColumn, start.sigma_accel_bias_m_per_s2);
  return prior;
}

/// What all ways to start without a reference are told.
StartOptions start_options(const FilterSetup& setup) {
  StartOptions options;
  options.window_s = setup.start.window_s;
  options.noise = setup.options.filter.imu_noise;
  options.gravity_m_per_s2 = setup.options.filter.gravity_m_per_s2;
  options.sigma_position_m = setup.start.sigma_position_m;
  options.sigma_yaw_rad = setup.start.sigma_orientation_rad;
  options.sigma_gyro_bias_rad_per_s = setup.start.sigma_gyro_bias_rad_per_s;
  options.sigma_accel_bias_m_per_s2 = setup.start.sigma_accel_bias_m_per_s2;
  return options;
}

/// What a rest looks like to all that can see it.
Initializer from_standstill(const Estimator& estimator, const FilterSetup& setup) {
  std::vector<StreamId> wheels;
  for (std::size_t i = 0; i < setup.wheels.size(); ++i) wheels.push_back(estimator.extra(i));
  StandstillOptions options{start_options(setup)};
  for (const CameraPrior& camera : setup.cameras) {
    options.t_CtoI_s.push_back(camera.camera.image_offset_s());
  }
  for (const auto& set : setup.wheels) options.t_OtoI_s.push_back(set.prior.wheels.t_OtoI_s);
  std::optional<StreamId> tracks;
  if (tracks_of(setup.streams) != nullptr) tracks = estimator.extra(wheels.size());
  return [options, wheels, tracks](const StartData& data) {
    std::vector<std::span<const EncoderSample>> encoders;
    for (const StreamId id : wheels) encoders.push_back(data.samples<EncoderSample>(id));
    const auto images =
        tracks ? data.samples<FeatureSample>(*tracks) : std::span<const FeatureSample>();
    return start_from_standstill(data.imu, encoders, options, images);
  };
}

/// From the motion of the first wheel set.
Initializer from_wheels(const Estimator& estimator, const FilterSetup& setup) {
  MovingStartOptions options{start_options(setup)};
  options.sigma_velocity_m_per_s = setup.start.sigma_velocity_m_per_s;
  options.model = setup.wheels.front().model;
  options.wheels = setup.wheels.front().prior;
  options.P_wheels = setup.wheels.front().P_before();
  return [options, wheels = estimator.extra(0)](const StartData& data) {
    return start_from_motion(data.imu, data.samples<EncoderSample>(wheels), options);
  };
}

/// Without wheels: from a rest, which images do not need to have a scale for, or else from what
/// they say of the motion.
Initializer from_images(const Estimator& estimator, const FilterSetup& setup) {
  VisualStartOptions options{start_options(setup)};
  options.cameras = setup.cameras;
  options.correlations = setup.options.filter.correlations;
  // It takes as long as some images.
  constexpr std::int64_t kPeriodNs = 200'000'000;
  return [options, rest = from_standstill(estimator, setup), tracks = estimator.extra(0),
          next_ns = std::int64_t{0},
          last = std::string_view()](const StartData& data) mutable -> StartAttempt {
    if (data.imu.empty()) return rest(data);
    if (StartAttempt standing = rest(data); standing.prior) return standing;
    if (data.imu.back().t_ns < next_ns) return no_start(last);
    next_ns = data.imu.back().t_ns + kPeriodNs;
    StartAttempt moving = start_from_images(data.imu, data.samples<FeatureSample>(tracks), options);
    last = moving.obstacle;
    return moving;
  };
}

Initializer from_motion(const Estimator& estimator, const FilterSetup& setup) {
  if (!setup.wheels.empty()) return from_wheels(estimator, setup);
  if (!setup.cameras.empty() && tracks_of(setup.streams) != nullptr) {
    return from_images(estimator, setup);
  }
  throw InputError(
      "estimator.start: moving needs wheels, or cameras and an update that takes their tracks - "
      "choose standstill or reference");
}

}  // namespace

Eigen::Matrix3d R_GtoI(const StateSample& state) {
  return to_quaternion(state.q_ItoG_xyzw).normalized().toRotationMatrix().transpose();
}

void start(Estimator& estimator, const RunSetup& run, const RunData& data, std::int64_t from_ns) {
  const FilterSetup& setup = *run.filter;
  if (setup.start.given) return estimator.start(*setup.start.given);
  const auto states = data.states();
  const auto first =
      std::find_if(states.begin(), states.end(),
                   [from_ns](const StateSample& state) { return state.t_ns >= from_ns; });
  switch (setup.start.mode) {
    case StartMode::kReference:
      if (first == states.end()) {
        throw InputError(
            "estimator.start: reference needs a sensor that gives reference states; without one "
            "choose start: standstill or moving");
      }
      estimator.start(start_from_reference(setup, *first, run.seed));
      return;
    case StartMode::kStandstill:
      estimator.start(from_standstill(estimator, setup));
      return;
    case StartMode::kMoving:
      estimator.start(from_motion(estimator, setup));
      return;
  }
}

}  // namespace viwo

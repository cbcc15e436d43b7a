#include "viwo/sim/imu_simulator.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <Eigen/Geometry>

#include "viwo/math/stamp.hpp"
#include "viwo/sim/encoder_simulator.hpp"
#include "viwo/sim/random.hpp"

namespace viwo::sim {
namespace {

using Eigen::Vector3d;

/// Three numbers at a time.
class VectorStream {
 public:
  VectorStream(std::uint64_t seed, Stream purpose) : stream_(seed, purpose) {}
  Vector3d draw(double sigma) {
    Vector3d out;
    for (double& x : out) x = sigma * stream_.gaussian();
    return out;
  }

 private:
  RandomStream stream_;
};

std::array<double, 3> to_array(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// Number of the last sample.
std::int64_t last_sample(const ImuSimulation& options) {
  std::int64_t k = static_cast<std::int64_t>(options.duration_s * options.rate_hz);
  const std::int64_t end_ns = to_ns(options.duration_s);
  while (sample_time_ns(k, options.rate_hz) < end_ns) ++k;
  return k;
}

}  // namespace

double imu_end_s(const ImuSimulation& options) {
  return static_cast<double>(sample_time_ns(last_sample(options), options.rate_hz)) * 1e-9;
}

SimulatedImu simulate_imu(const BodyTrajectory& trajectory, const Mounting& mounting,
                          const ImuSimulation& options, std::uint64_t seed) {
  VectorStream gyro_noise(seed, Stream::kGyroNoise), accel_noise(seed, Stream::kAccelNoise);
  VectorStream gyro_walk(seed, Stream::kGyroWalk), accel_walk(seed, Stream::kAccelWalk);
  VectorStream first(seed, Stream::kInitialBias);
  const ImuNoise densities = options.noise ? options.densities : ImuNoise{0., 0., 0., 0.};
  const double on = options.noise ? 1. : 0.;
  const double root = std::sqrt(options.rate_hz);
  const Vector3d g_inG(0., 0., options.gravity_m_per_s2);
  ImuBias bias{options.gyro_bias + first.draw(on * options.sigma_gyro_bias_rad_per_s),
               options.accel_bias + first.draw(on * options.sigma_accel_bias_m_per_s2)};
  SimulatedImu out;
  const std::int64_t last = last_sample(options);
  for (std::int64_t k = 0; k <= last; ++k) {
    const std::int64_t t_ns = sample_time_ns(k, options.rate_hz);
    const BodyMotion at = trajectory.imu(static_cast<double>(t_ns) * 1e-9, mounting);
    const Vector3d gyro = at.w_BwrtG_inB + bias.gyro +  // (SIM-8)
                          gyro_noise.draw(densities.gyro_rad_per_s_sqrt_hz * root);
    const Vector3d accel = at.R_BtoG.transpose() * (at.a_BinG + g_inG) + bias.accel +
                           accel_noise.draw(densities.accel_m_per_s2_sqrt_hz * root);
    out.samples.push_back({options.start_ns + t_ns, to_array(gyro), to_array(accel)});
    out.biases.push_back(bias);
    bias.gyro += gyro_walk.draw(densities.gyro_walk_rad_per_s2_sqrt_hz / root);
    bias.accel += accel_walk.draw(densities.accel_walk_m_per_s3_sqrt_hz / root);
  }
  return out;
}

StateSample true_state(const BodyTrajectory& trajectory, const Mounting& mounting,
                       const SimulatedImu& imu, std::int64_t start_ns, std::int64_t t_ns) {
  const BodyMotion at = trajectory.imu(seconds_between(start_ns, t_ns), mounting);
  const Eigen::Quaterniond q(at.R_BtoG);
  StateSample out;
  out.t_ns = t_ns;
  out.q_ItoG_xyzw = {q.x(), q.y(), q.z(), q.w()};
  out.p_IinG_m = to_array(at.p_BinG);
  out.v_IinG_m_per_s = to_array(at.v_BinG);
  if (imu.samples.empty()) return out;
  const auto after = std::lower_bound(
      imu.samples.begin(), imu.samples.end(), t_ns,
      [](const ImuSample& sample, std::int64_t stamp) { return sample.t_ns < stamp; });
  const auto n = static_cast<std::size_t>(after - imu.samples.begin());
  const std::size_t right = std::min(n, imu.samples.size() - 1);
  const std::size_t left = right == 0 ? 0 : right - 1;
  const double length_s = seconds_between(imu.samples[left].t_ns, imu.samples[right].t_ns);
  const double ratio =
      length_s > 0. ? std::clamp(seconds_between(imu.samples[left].t_ns, t_ns) / length_s, 0., 1.)
                    : 0.;
  const auto mix = [ratio](const Vector3d& a, const Vector3d& b) {
    return to_array((1. - ratio) * a + ratio * b);
  };
  out.gyro_bias_rad_per_s = mix(imu.biases[left].gyro, imu.biases[right].gyro);
  out.accel_bias_m_per_s2 = mix(imu.biases[left].accel, imu.biases[right].accel);
  return out;
}

}  // namespace viwo::sim

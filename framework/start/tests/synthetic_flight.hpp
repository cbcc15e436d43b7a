// A flight before a cloud of points, by formulas of its own: what its IMU reads and its cameras
// see. Nothing of the framework's simulation is in it.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <Eigen/Dense>

#include "viwo/camera/camera_chain.hpp"
#include "viwo/start/visual_start.hpp"

namespace viwo::testing {

struct FlightOptions {
  double duration_s = 1.3;
  double amplitude_m = 0.3;  ///< of each axis; 0: it hovers, or flies straight on
  double turn_rad = 0.3;     ///< amplitude of roll, pitch and yaw
  Eigen::Vector3d cruise_m_per_s = Eigen::Vector3d::Zero();
  double sigma_px = 0.5;
  double noise = 1.;        ///< times the configured one
  double biases = 1.;       ///< sigmas
  double calibration = 1.;  ///< prior sigmas by which the cameras are wrong
  double relative = 1.;     ///< part of these by which a camera is wrong against the first
  double outliers = 0.;     ///< share of sights that are off by up to 50 px
  std::int64_t begin_ns = 7'000'000'000;
};

class Flight {
 public:
  Flight(const VisualStartOptions& prior, const FlightOptions& options, std::uint64_t seed)
      : prior_(prior), options_(options), engine_(seed) {
    for (int axis = 0; axis < 3; ++axis) {
      phase_[axis] = M_PI * uniform();
      turn_phase_[axis] = M_PI * uniform();
      hertz_[axis] = 0.6 + 0.3 * uniform();
      turn_hertz_[axis] = 0.5 + 0.3 * uniform();
    }
    gyro_bias = options.biases * prior.sigma_gyro_bias_rad_per_s * normal3();
    accel_bias = options.biases * prior.sigma_accel_bias_m_per_s2 * normal3();
    for (const CameraPrior& camera : prior.cameras) cameras_.push_back(wrong(camera));
    for (int i = 0; i < 80; ++i) {
      points_.emplace_back(3. + 1.5 * uniform(), 2.5 * uniform(), 1.5 * uniform());
    }
    make_imu();
    make_tracks();
  }

  std::vector<ImuSample> imu;
  std::vector<FeatureSample> tracks;
  Eigen::Vector3d gyro_bias, accel_bias;  ///< at the end

  Eigen::Vector3d position(double t) const { return moved(t, 0); }
  Eigen::Vector3d velocity(double t) const { return moved(t, 1); }
  /// I: x forward to the points, z up.
  Eigen::Matrix3d R_ItoG(double t) const {
    Eigen::Vector3d angle;
    for (int i = 0; i < 3; ++i) {
      angle[i] = options_.turn_rad * std::sin(2. * M_PI * turn_hertz_[i] * t + turn_phase_[i]);
    }
    using Eigen::AngleAxisd;
    return (AngleAxisd(angle.z(), Eigen::Vector3d::UnitZ()) *
            AngleAxisd(angle.y(), Eigen::Vector3d::UnitY()) *
            AngleAxisd(angle.x(), Eigen::Vector3d::UnitX()))
        .toRotationMatrix();
  }
  double seconds(std::int64_t t_ns) const {
    return static_cast<double>(t_ns - options_.begin_ns) * 1e-9;
  }

 private:
  double uniform() { return std::uniform_real_distribution<double>(-1., 1.)(engine_); }
  double normal() { return normal_(engine_); }
  Eigen::Vector3d normal3() { return {normal(), normal(), normal()}; }

  /// Derivative of the position.
  Eigen::Vector3d moved(double t, int derivative) const {
    Eigen::Vector3d p = derivative == 0   ? Eigen::Vector3d(options_.cruise_m_per_s * t)
                        : derivative == 1 ? options_.cruise_m_per_s
                                          : Eigen::Vector3d::Zero();
    for (int i = 0; i < 3; ++i) {
      const double w = 2. * M_PI * hertz_[i];
      p[i] += options_.amplitude_m * std::pow(w, derivative) *
              std::sin(w * t + phase_[i] + 0.5 * M_PI * derivative);
    }
    return p;
  }

  CameraPrior wrong(const CameraPrior& camera) {
    CameraPrior out = camera;
    CameraView& view = out.camera;
    const double scale = options_.calibration;
    const Eigen::Matrix3d& R_ItoC = camera.camera.R_ItoC;
    const Eigen::Vector3d turn =
        scale * camera.sigma_extrinsics.head<3>().cwiseProduct(turns_.next(R_ItoC, normal3()));
    view.R_ItoC =
        Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()).toRotationMatrix() * view.R_ItoC;
    view.p_IinC +=
        scale * camera.sigma_extrinsics.tail<3>().cwiseProduct(shifts_.next(R_ItoC, normal3()));
    for (int i = 0; i < 8; ++i) {
      view.intrinsics[i] += scale * camera.sigma_intrinsics[i] * normal();
    }
    if (cameras_.empty()) later_s_ = scale * camera.sigma_clock_s * normal();
    view.t_CtoI_s += later_s_;
    return out;
  }

  void make_imu() {
    constexpr double kHz = 200.;
    const double root = std::sqrt(kHz);
    const ImuNoise& noise = prior_.noise;
    const int n = static_cast<int>(options_.duration_s * kHz) + 1;
    for (int i = 0; i < n; ++i) {
      const double t = i / kHz;
      constexpr double kStep = 1e-5;
      const Eigen::AngleAxisd turned(R_ItoG(t - kStep).transpose() * R_ItoG(t + kStep));
      const Eigen::Vector3d rate = turned.angle() * turned.axis() / (2. * kStep);
      const Eigen::Vector3d up(0., 0., prior_.gravity_m_per_s2);
      const Eigen::Vector3d force = R_ItoG(t).transpose() * (moved(t, 2) + up);
      const double scale = options_.noise;
      if (i > 0) {
        gyro_bias += scale * noise.gyro_walk_rad_per_s2_sqrt_hz / root * normal3();
        accel_bias += scale * noise.accel_walk_m_per_s3_sqrt_hz / root * normal3();
      }
      ImuSample& sample = imu.emplace_back();
      sample.t_ns = options_.begin_ns + std::int64_t{5'000'000} * i;
      put(rate + gyro_bias + scale * noise.gyro_rad_per_s_sqrt_hz * root * normal3(),
          sample.gyro_rad_per_s);
      put(force + accel_bias + scale * noise.accel_m_per_s2_sqrt_hz * root * normal3(),
          sample.accel_m_per_s2);
    }
  }

  void make_tracks() {
    for (std::int64_t at_ns = 100'000'000; seconds_of(at_ns) < options_.duration_s - 0.05;
         at_ns += 50'000'000) {
      for (std::size_t c = 0; c < cameras_.size(); ++c) {
        FeatureSample& image = tracks.emplace_back();
        image.camera = static_cast<int>(c);
        image.t_ns = options_.begin_ns + at_ns;
        see(cameras_[c].camera, seconds_of(at_ns) + cameras_[c].camera.t_CtoI_s, image);
      }
    }
  }

  /// Without distortion.
  void see(const CameraView& camera, double first_row_s, FeatureSample& image) {
    for (std::size_t i = 0; i < points_.size(); ++i) {
      Eigen::Vector3d p_C;
      double u = 0., v = 0.5 * camera.height_px;
      // The row that sees a point is the one that it is seen in.
      for (int k = 0; k < (camera.line_delay_s > 0. ? 10 : 1); ++k) {
        const double t = first_row_s + v * camera.line_delay_s;
        const Eigen::Vector3d p_I = R_ItoG(t).transpose() * (points_[i] - position(t));
        p_C = camera.R_ItoC * p_I + camera.p_IinC;
        u = camera.intrinsics[0] * p_C.x() / p_C.z() + camera.intrinsics[2];
        v = camera.intrinsics[1] * p_C.y() / p_C.z() + camera.intrinsics[3];
      }
      const double du = options_.sigma_px * normal(), dv = options_.sigma_px * normal();
      if (p_C.z() < 0.3 || u < 0. || v < 0. || u > camera.width_px || v > camera.height_px)
        continue;
      const bool is_outlier = 0.5 * (uniform() + 1.) < options_.outliers;
      const double off = is_outlier ? 50. : 0.;
      image.points.push_back(
          {static_cast<std::int64_t>(i), u + du + off * uniform(), v + dv + off * uniform()});
    }
  }

  static double seconds_of(std::int64_t ns) { return static_cast<double>(ns) * 1e-9; }
  static void put(const Eigen::Vector3d& from, std::array<double, 3>& to) {
    to = {from.x(), from.y(), from.z()};
  }

  const VisualStartOptions& prior_;
  FlightOptions options_;
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
  Eigen::Vector3d phase_, turn_phase_, hertz_, turn_hertz_;
  std::vector<CameraPrior> cameras_;  // as they are
  double later_s_ = 0.;
  ChainedErrors turns_{options_.relative}, shifts_{options_.relative};
  std::vector<Eigen::Vector3d> points_;
};

/// One camera that looks along the x axis of I, or two side by side.
inline VisualStartOptions flight_cameras(int n) {
  VisualStartOptions options;
  for (int c = 0; c < n; ++c) {
    CameraPrior prior;
    prior.camera.width_px = 752;
    prior.camera.height_px = 480;
    prior.camera.intrinsics.head<4>() << 458., 457., 367., 248.;
    prior.camera.R_ItoC << 0., -1., 0., 0., 0., -1., 1., 0., 0.;
    prior.camera.p_IinC = Eigen::Vector3d(0.05 - 0.11 * c, 0.02, -0.03);
    prior.camera.t_CtoI_s = 0.004;
    prior.sigma_extrinsics << 0.002, 0.002, 0.002, 0.003, 0.003, 0.003;
    prior.sigma_intrinsics.head<4>().setConstant(0.5);
    prior.sigma_clock_s = 0.001;
    options.cameras.push_back(prior);
  }
  return options;
}

}  // namespace viwo::testing

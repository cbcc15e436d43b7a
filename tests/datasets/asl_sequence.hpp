// A sequence of the EuRoC or the TUM-VI dataset, file by file as these publish it, of a motion and
// surroundings that are known: a rig stands, then swings among bright spots.
#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "viwo/api/filter_view.hpp"
#include "viwo/camera/camera_model.hpp"
#include "viwo/image/image_file.hpp"

namespace viwo {

class AslSequence {
 public:
  static constexpr double kRest_s = 1.5;
  static constexpr double kGravity = 9.81;
  static constexpr std::int64_t kBegin_ns = 1'403'715'273'262'142'976;  ///< of V1_01_easy
  static constexpr const char* kStateHeader =
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
      "q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], "
      "b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], "
      "b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]";
  static constexpr const char* kMocapHeader =
      "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], "
      "q_RS_y [], q_RS_z []";
  static constexpr const char* kImuHeader =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]";

  AslSequence(std::vector<CameraView> cameras, double duration_s)
      : cameras_(std::move(cameras)), duration_s_(duration_s) {
    // Camera 0 looks along the x axis of G, level, when the rig stands.
    Eigen::Matrix3d R_CtoG;
    R_CtoG << 0., 0., 1., -1., 0., 0., 0., -1., 0.;
    R_ItoG_at_rest_ = R_CtoG * cameras_[0].R_ItoC;
    std::mt19937_64 rng(7);
    std::uniform_real_distribution<double> along(2.5, 7.), across(-5., 5.), up(-3., 3.);
    std::uniform_real_distribution<double> brightness(80., 200.);
    for (int i = 0; i < 500; ++i) {
      const Eigen::Vector3d p(along(rng), across(rng), up(rng));
      spots_.push_back({p, brightness(rng)});
    }
  }

  double duration_s() const { return duration_s_; }

  /// imu0/data.csv, at 200 Hz.
  void write_imu(const std::filesystem::path& mav0) const {
    std::ofstream out = open(mav0 / "imu0", kImuHeader);
    for (int i = 0; i <= static_cast<int>(200. * duration_s_); ++i) {
      const Motion m = motion(0.005 * i);
      const Eigen::Matrix3d R_GtoI = m.R_ItoG.transpose();
      const Eigen::Vector3d w = R_GtoI * Eigen::Vector3d(0., 0., m.yaw_rate) + gyro_bias();
      const Eigen::Vector3d f = R_GtoI * (m.a + Eigen::Vector3d(0., 0., kGravity));
      out << kBegin_ns + 5'000'000LL * i << ',' << w.x() << ',' << w.y() << ',' << w.z() << ','
          << f.x() << ',' << f.y() << ',' << f.z() << "\r\n";
    }
  }

  /// state_groundtruth_estimate0/data.csv (EuRoC), from 0.3 s on.
  void write_states(const std::filesystem::path& mav0) const {
    write_truth(mav0 / "state_groundtruth_estimate0", kStateHeader, true);
  }
  /// mocap0/data.csv (TUM-VI).
  void write_mocap(const std::filesystem::path& mav0) const {
    write_truth(mav0 / "mocap0", kMocapHeader, false);
  }

  /// camN/data.csv and camN/data/*.png, at 20 Hz.
  void write_images(const std::filesystem::path& mav0) const {
    for (std::size_t camera = 0; camera < cameras_.size(); ++camera) {
      const std::filesystem::path folder = mav0 / ("cam" + std::to_string(camera));
      std::ofstream out = open(folder, "#timestamp [ns],filename");
      std::filesystem::create_directories(folder / "data");
      for (int i = 0; i <= static_cast<int>(20. * duration_s_); ++i) {
        const std::string stamp = std::to_string(kBegin_ns + 50'000'000LL * i);
        write_png(folder / "data" / (stamp + ".png"), render(cameras_[camera], 0.05 * i));
        out << stamp << ',' << stamp << ".png\r\n";
      }
    }
  }

  /// A bias as that of EuRoC's gyro.
  static Eigen::Vector3d gyro_bias() { return {-0.002, 0.021, 0.077}; }

 private:
  struct Spot {
    Eigen::Vector3d p_G;
    double brightness;
  };
  struct Motion {
    Eigen::Vector3d p, v, a;  ///< of I in G
    Eigen::Matrix3d R_ItoG;
    double yaw_rate;
  };

  /// A (1 - cos) for each axis and for the yaw, behind the rest: all derivatives are known.
  Motion motion(double t_s) const {
    const double t = std::max(0., t_s - kRest_s);
    const bool moves = t_s > kRest_s;
    const Eigen::Vector3d A(0.25, 0.4, 0.2), w(1.3, 1.1, 1.7);
    Motion m{};
    for (int i = 0; i < 3; ++i) {
      m.p[i] = A[i] * (1. - std::cos(w[i] * t));
      m.v[i] = A[i] * w[i] * std::sin(w[i] * t);
      m.a[i] = moves ? A[i] * w[i] * w[i] * std::cos(w[i] * t) : 0.;
    }
    const double yaw = 0.15 * (1. - std::cos(0.9 * t));
    m.yaw_rate = 0.15 * 0.9 * std::sin(0.9 * t);
    m.R_ItoG = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * R_ItoG_at_rest_;
    return m;
  }

  Image render(const CameraView& camera, double t_s) const {
    constexpr double kSigma_px = 2.5;
    constexpr int kReach_px = 9;
    const Motion m = motion(t_s);
    std::vector<double> sum(static_cast<std::size_t>(camera.width_px * camera.height_px), 20.);
    for (const Spot& spot : spots_) {
      const Eigen::Vector3d p_I = m.R_ItoG.transpose() * (spot.p_G - m.p);
      Eigen::Vector2d uv;
      const Eigen::Vector3d p_C = camera.R_ItoC * p_I + camera.p_IinC;
      if (p_C.z() < 0.1 || !project(camera, p_C, uv)) continue;
      if (!in_image(camera, uv)) continue;
      const int u0 = static_cast<int>(uv.x()), v0 = static_cast<int>(uv.y());
      for (int v = std::max(0, v0 - kReach_px); v <= std::min(camera.height_px - 1, v0 + kReach_px);
           ++v) {
        for (int u = std::max(0, u0 - kReach_px);
             u <= std::min(camera.width_px - 1, u0 + kReach_px); ++u) {
          const double r2 = (Eigen::Vector2d(u, v) - uv).squaredNorm();
          sum[static_cast<std::size_t>(v * camera.width_px + u)] +=
              spot.brightness * std::exp(-0.5 * r2 / (kSigma_px * kSigma_px));
        }
      }
    }
    Image image{camera.width_px, camera.height_px, {}};
    for (const double grey : sum) {
      image.pixels.push_back(static_cast<std::uint8_t>(std::min(255., grey + 0.5)));
    }
    return image;
  }

  /// A table with Windows' line ends, as most of EuRoC's have.
  static std::ofstream open(const std::filesystem::path& folder, const std::string& header) {
    std::filesystem::create_directories(folder);
    std::ofstream out(folder / "data.csv", std::ios::binary);
    out << header << "\r\n" << std::setprecision(12);
    return out;
  }

  void write_truth(const std::filesystem::path& folder, const char* header, bool states) const {
    std::ofstream out = open(folder, header);
    for (int i = 30; i <= static_cast<int>(100. * duration_s_); ++i) {
      const Motion m = motion(0.01 * i);
      const Eigen::Quaterniond q(m.R_ItoG);
      out << kBegin_ns + 10'000'000LL * i << ',' << m.p.x() << ',' << m.p.y() << ',' << m.p.z()
          << ',' << q.w() << ',' << q.x() << ',' << q.y() << ',' << q.z();
      if (states) {
        const Eigen::Vector3d b = gyro_bias();
        out << ',' << m.v.x() << ',' << m.v.y() << ',' << m.v.z() << ',' << b.x() << ',' << b.y()
            << ',' << b.z() << ",0,0,0";
      }
      out << "\r\n";
    }
  }

  std::vector<CameraView> cameras_;
  double duration_s_;
  Eigen::Matrix3d R_ItoG_at_rest_;
  std::vector<Spot> spots_;
};

}  // namespace viwo

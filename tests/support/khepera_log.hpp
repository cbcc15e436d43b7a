// The tuples of Censi et al. (T-RO 2013) as logs: a differential drive with a laser.
#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iomanip>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "viwo/math/se2.hpp"

namespace viwo::testing {

/// Writes intervals {T, phi_l, phi_r, sm} one after the other, as logs of angles and of poses, and
/// a run of them, run.yaml.
inline void write_khepera_log(const std::filesystem::path& tuples,
                              const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  std::ofstream wheels(folder / "wheels.csv"), poses(folder / "poses.csv");
  wheels << std::setprecision(17) << "#timestamp_ns,drive_1 [rad],drive_2 [rad]\n";
  poses << std::setprecision(17)
        << "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], "
           "q_RS_y [], q_RS_z []\n";
  std::int64_t t_ns = 1'000'000'000;
  double left = 0., right = 0.;
  Eigen::Vector3d pose = Eigen::Vector3d::Zero();
  const auto write = [&] {
    wheels << t_ns << "," << left << "," << right << "\n";
    poses << t_ns << "," << pose[1] << "," << pose[2] << ",0," << std::cos(pose[0] / 2.) << ",0,0,"
          << std::sin(pose[0] / 2.) << "\n";
  };
  write();
  std::ifstream in(tuples);
  for (nlohmann::json one; (in >> std::ws).good() && in >> one;) {
    const double T = one["T"];
    t_ns += std::llround(1e9 * T);
    left += one["phi_l"].get<double>() * T;
    right += one["phi_r"].get<double>() * T;
    const auto& sm = one["sm"];
    pose = compose(pose, Eigen::Vector3d(sm[2], sm[0], sm[1]));
    write();
  }
  std::ofstream(folder / "run.yaml")
      << "sensors:\n"
         "  wheels0: {type: asl_encoders, path: wheels.csv, drive_input: angle, max_gap_s: 5}\n"
         "  laser0: {type: asl_pose, path: poses.csv}\n"
         "kinematics: {type: differential, radius_left_m: 0.021, radius_right_m: 0.021, "
         "baseline_m: 0.09, prior_sigma_radius_m: 0.002, prior_sigma_baseline_m: 0.01}\n"
         "evaluation: {reference_max_gap_s: 5}\n";
}

}  // namespace viwo::testing

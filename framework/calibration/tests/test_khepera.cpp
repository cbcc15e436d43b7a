// A calibration that was published: the differential drive of Censi et al. (T-RO 2013), three
// mountings of its laser, against theirs.
#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "registry.hpp"
#include "viwo/calibration/calibrate.hpp"
#include "viwo/math/se2.hpp"

namespace viwo {
namespace {

using namespace calibration;
using nlohmann::json;

const std::filesystem::path kTuples =
    std::filesystem::path(VIWO_TEST_SHARED_DIR) / "data" / "real" / "censi_khepera_tuples";

/// Writes intervals {T, phi_l, phi_r, sm} one after the other, as logs of angles and of poses.
void write_log(const std::filesystem::path& tuples, const std::filesystem::path& folder) {
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
  for (json one; (in >> std::ws).good() && in >> one;) {
    const double T = one["T"];
    t_ns += std::llround(1e9 * T);
    left += one["phi_l"].get<double>() * T;
    right += one["phi_r"].get<double>() * T;
    const auto& sm = one["sm"];
    pose = compose(pose, Eigen::Vector3d(sm[2], sm[0], sm[1]));
    write();
  }
}

class Khepera : public ::testing::TestWithParam<const char*> {};

TEST_P(Khepera, IsCalibratedAsPublished) {
  if (!std::filesystem::exists(kTuples)) GTEST_SKIP() << "no recordings at " << kTuples;
  const std::string name = GetParam();
  const auto folder = std::filesystem::path(::testing::TempDir()) / ("viwo_khepera_" + name);
  write_log(kTuples / (name + ".tuple"), folder);
  std::ofstream(folder / "run.yaml")
      << "sensors:\n"
         "  wheels0: {type: asl_encoders, path: wheels.csv, drive_input: angle, max_gap_s: 5}\n"
         "  laser0: {type: asl_pose, path: poses.csv}\n"
         "kinematics: {type: differential, radius_left_m: 0.021, radius_right_m: 0.021, "
         "baseline_m: 0.09, prior_sigma_radius_m: 0.002, prior_sigma_baseline_m: 0.01}\n"
         "evaluation: {reference_max_gap_s: 5}\n";
  // How the laser was turned is known to half a radian.
  const double mounted = name == "lstraight" ? 0. : M_PI / 2.;
  std::ofstream(folder / "calibration.yaml")
      << "calibration: khepera\nbase: run.yaml\nestimate_extrinsics: true\n"
         "prior_sigma_extrinsics_m: 0.05\nprior_sigma_extrinsics_rad: 0.5\n"
         "extrinsics_x_m_y_m_yaw_rad: [0, 0, "
      << mounted << "]\n\n";
  auto setup = read_calibration_setup(folder / "calibration.yaml", {}, testing::registry());
  const CalibrationResult result = calibrate(setup);
  EXPECT_TRUE(result.is_trusted()) << ::testing::PrintToString(result.doubts);

  json published;
  std::ifstream(kTuples / (name + "_results.json")) >> published;
  const auto sigma = [&](int i) { return std::sqrt(published["covariance"][i][i].get<double>()); };
  const CalibrationEstimate& found = result.all;
  EXPECT_NEAR(found.x_WI[0], published["l_diam"].get<double>() / 2., 3. * sigma(0));
  EXPECT_NEAR(found.x_WI[1], published["r_diam"].get<double>() / 2., 3. * sigma(1));
  EXPECT_NEAR(found.x_WI[2], published["axle"].get<double>(), 3. * sigma(2));
  // Theirs is the laser in O.
  const Eigen::Vector3d E(found.extrinsics[2], found.extrinsics[0], found.extrinsics[1]);
  const Eigen::Vector3d laser = between(E, Eigen::Vector3d::Zero());
  EXPECT_NEAR(laser[1], published["l_x"].get<double>(), 3. * sigma(3));
  EXPECT_NEAR(laser[2], published["l_y"].get<double>(), 3. * sigma(4));
  EXPECT_NEAR(wrap_angle(laser[0] - published["l_theta"].get<double>()), 0., 3. * sigma(5));
  // A third of what a fit without (CAL-15) takes for noise, which is 7 to 13 mm.
  EXPECT_LT(found.noise.position_m, 0.007 / 3.);
  EXPECT_GT(found.weighed_down, 0);
}

INSTANTIATE_TEST_SUITE_P(Mountings, Khepera, ::testing::Values("l90", "lmov", "lstraight"));

}  // namespace
}  // namespace viwo

// The whole filter on bases other than the paper's: is its pose honest, and does it find the wheels
// from a wrong start. Each check also meets a filter that is wrong about its wheels, and sees it.
//
// One instant over the seeds: the sum of NEES there is chi-square with 6 degrees of freedom per
// seed; the squared error of one intrinsic over its variance is so with one degree of freedom.
#include <cmath>
#include <sstream>

#include <gtest/gtest.h>

#include "filter_runs.hpp"
#include "viwo/eval/consistency.hpp"

namespace viwo {
namespace {

constexpr int kSeeds = 6;
constexpr double kErrorProbability = 0.001;
const std::vector<double> kInstants{10., 20., 29.5};

struct Base {
  const char* name;
  const char* experiment;
  const char* variant;
  int estimated;       ///< wheel intrinsics
  double improvement;  ///< what is left of the error of each at most, rms over the seeds / prior
  std::vector<std::string> broken;  ///< assignments that make the filter wrong about its wheels
};

/// With less noise assumed than there is the gates leave out what does not fit.
std::vector<std::string> with_open_gates(std::vector<std::string> assignments) {
  for (const char* update : {"wheel_odometry", "wheel_parity"}) {
    assignments.push_back(std::string("updates.") + update + ".gate_probability=0");
    assignments.push_back(std::string("updates.") + update + ".find_noise=false");
  }
  return assignments;
}

void PrintTo(const Base& base, std::ostream* out) { *out << base.name; }

std::vector<RunResult> runs_of(const Base& base, const std::vector<std::string>& more = {}) {
  std::vector<std::string> assignments{"sensors.simulator0.duration_s=30"};
  assignments.insert(assignments.end(), more.begin(), more.end());
  return testing::variant_runs(base.experiment, base.variant, kSeeds, std::move(assignments));
}

bool is_intrinsic(const std::string& name) {
  return !name.starts_with("theta_") && !name.starts_with("p_IinO") && name != "t_OtoI";
}

/// Empty when the pose is consistent at all instants and no intrinsic is further off than it
/// claims, else what is not.
std::string inconsistency(const std::vector<RunResult>& runs) {
  const std::string pose = testing::inconsistency_of_pose(runs, kInstants);
  if (pose.starts_with("a run ended early")) return pose;
  std::ostringstream out;
  out << pose;
  const int n = static_cast<int>(runs.size());
  const auto count = runs.front().calibration.size();
  const auto single =
      eval::mean_nees_bounds(1, n, 1. - kErrorProbability / static_cast<double>(count));
  for (std::size_t k = 0; k < count; ++k) {
    double mean = 0.;
    for (const auto& run : runs) {
      const auto& track = run.calibration[k];
      if (track.sigma.back() == 0.) continue;
      mean += std::pow(track.final_error / track.sigma.back(), 2) / n;
    }
    const std::string& name = runs.front().calibration[k].name;
    if (!is_intrinsic(name) || mean < single.high) continue;
    out << name << ": NEES " << mean << " above " << single.high << "\n";
  }
  return out.str();
}

class FilterOn : public ::testing::TestWithParam<Base> {};

INSTANTIATE_TEST_SUITE_P(
    , FilterOn,
    ::testing::Values(
        Base{"ackermann",
             "calibrate_ackermann",
             "rear_and_centre",
             5,
             0.2,
             {"kinematics.wheel_base_m=0.35", "kinematics.prior_sigma_length_m=0.001"}},
        Base{"ackermann_all_wheels",
             "calibrate_ackermann",
             "all_and_centre",
             7,
             0.2,
             {"kinematics.steer_offset_rad=0.05", "kinematics.prior_sigma_steer_offset_rad=0.002"}},
        Base{"skid_steer",
             "calibrate_skid_steer",
             "held_frame",
             3,
             0.2,
             {"kinematics.y_icr_right_m=-0.2", "kinematics.prior_sigma_icr_m=0.002"}},
        Base{"skid_steer_with_known_mounting",
             "calibrate_skid_steer",
             "known_mounting",
             5,
             0.2,
             {"kinematics.x_icr_m=0.1", "kinematics.prior_sigma_icr_m=0.005"}},
        Base{"mecanum", "calibrate_mecanum", "full", 9, 0.35,
             with_open_gates({"kinematics.sigma_drive_rad_per_s=3e-5",
                              "kinematics.sigma_slip_m_per_s=3e-5"})},
        Base{"three_swerve_wheels", "calibrate_swerve", "three_wheels", 9, 0.3,
             with_open_gates({"kinematics.sigma_steer_rad=1e-4",
                              "kinematics.sigma_lateral_m_per_s=1e-4"})},
        Base{"six_swerve_wheels", "calibrate_swerve", "six_wheels", 21, 0.3,
             with_open_gates({"kinematics.sigma_steer_rad=1e-4",
                              "kinematics.sigma_lateral_m_per_s=1e-4"})}),
    [](const auto& test) { return test.param.name; });

TEST_P(FilterOn, IsConsistentWhileTheCalibrationIsFound) {
  EXPECT_EQ(inconsistency(runs_of(GetParam())), "");
}

TEST_P(FilterOn, FindsEveryIntrinsicFromAWrongStart) {
  const auto runs = runs_of(GetParam());
  int estimated = 0;
  for (std::size_t k = 0; k < runs.front().calibration.size(); ++k) {
    const auto& first = runs.front().calibration[k];
    if (!is_intrinsic(first.name) || first.sigma.front() == 0.) continue;
    ++estimated;
    double square = 0.;
    for (const auto& run : runs) square += std::pow(run.calibration[k].final_error, 2) / kSeeds;
    EXPECT_LT(std::sqrt(square), GetParam().improvement * first.sigma.front()) << first.name;
  }
  EXPECT_EQ(estimated, GetParam().estimated);
}

TEST_P(FilterOn, CheckSeesAFilterThatIsWrongAboutItsWheels) {
  const std::string seen = inconsistency(runs_of(GetParam(), GetParam().broken));
  EXPECT_NE(seen, "");
  EXPECT_EQ(seen.find("a run ended early"), std::string::npos) << seen;
}

}  // namespace
}  // namespace viwo

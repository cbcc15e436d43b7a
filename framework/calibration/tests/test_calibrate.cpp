// Batch calibration of simulated robots: the truth comes out, with honest sigmas, and what the data
// cannot determine is named.
#include <filesystem>
#include <fstream>
#include <iostream>

#include <Eigen/Dense>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibration_text.hpp"
#include "simulated_calibration.hpp"
#include "told.hpp"
#include "viwo/calibration_report/calibration_output.hpp"
#include "viwo/eval/consistency.hpp"
#include "viwo/math/chi2.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

using namespace calibration;
using testing::fit_all;
using testing::fit_of;
using testing::registry;
using testing::setup_of;
using testing::simulated;
using testing::truth_of;

TEST(Calibrate, FindsTheTrueIntrinsicsWithHonestSigmas) {
  const int seeds = 12;
  constexpr int kFree = 13;
  double nees = 0., sum_of_first_radius = 0.;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    // Small noise: lateral slip n shortens what a wheel rolls by n^2/v, at the default sizes as
    // much as the sigma of a radius (docs/math/wheel_odometry.md).
    std::vector<std::string> small_noise;
    for (const char* section : {"kinematics.", "sensors.simulator0.robot."}) {
      for (const char* sigma :
           {"sigma_drive_rad_per_s=", "sigma_steer_rad=", "sigma_lateral_m_per_s="}) {
        small_noise.push_back(std::string(section) + sigma + "0.0001");
      }
    }
    const auto setup = setup_of({"icr_sweep", "figure_eight"}, seed, small_noise);
    const auto estimate = fit_all(setup);
    const WheelsView there = truth_of(setup, seed);
    const Intrinsics& truth = there.x_WI;
    const Intrinsics prior = setup.recordings[0].setup.model->prior_sigma();
    EXPECT_TRUE(estimate.converged);
    EXPECT_TRUE(estimate.undetermined.empty());
    std::vector<int> free;
    for (int i = 0; i < 16; ++i) {
      if (prior[i] == 0.) {
        EXPECT_NEAR(estimate.x_WI[i], truth[i], 1e-9) << "held";
        EXPECT_EQ(estimate.sigma[i], 0.);
        continue;
      }
      EXPECT_LT(estimate.sigma[i], 0.1 * prior[i]) << i;
      free.push_back(i);
    }
    ASSERT_EQ(free.size(), std::size_t{kFree});
    const Eigen::VectorXd error = (estimate.x_WI - truth)(free).cwiseQuotient(estimate.sigma(free));
    nees += error.dot(estimate.correlations(free, free).ldlt().solve(error));
    sum_of_first_radius += error[0];
    const Eigen::Vector3d O_in_body = -there.R_ItoO.transpose() * there.p_IinO;
    const double yaw = -log_so3(there.R_ItoO).z();
    EXPECT_LT((estimate.extrinsics - Eigen::Vector3d(O_in_body.x(), O_in_body.y(), yaw)).norm(),
              1e-3);
  }
  // 99 % of a chi-square.
  std::cout << "NEES " << nees / seeds << "\n";
  EXPECT_GT(nees, chi2_quantile(0.005, seeds * kFree));
  EXPECT_LT(nees, chi2_quantile(0.995, seeds * kFree));
  // Likewise. Straight lines between the poses cut corners, and made the radii, which are as wrong
  // as one, 1.6 sigmas too small.
  EXPECT_LT(std::abs(sum_of_first_radius), 2.58 * std::sqrt(seeds));
}

TEST(Calibrate, FindsTheGainsOfTheSteeringWhereTheyAreAskedFor) {
  const std::vector<std::string> with_gains{"kinematics.prior_sigma_steer_gain=0.02",
                                            "sensors.simulator0.robot.prior_sigma_steer_gain=0.02"};
  const auto setup = setup_of({"icr_sweep", "figure_eight"}, 1, with_gains);
  const auto estimate = fit_all(setup);
  const Intrinsics truth = truth_of(setup, 1).x_WI;
  ASSERT_EQ(truth.size(), 20);
  EXPECT_GT(truth.tail(4).norm(), 0.01);
  EXPECT_LT((estimate.x_WI - truth).tail(4).cwiseAbs().maxCoeff(), 0.002);
  // A model without them takes the gains for something else.
  const auto without = fit_all(setup_of({"icr_sweep", "figure_eight"}, 1, {with_gains[1]}));
  EXPECT_EQ(without.x_WI.size(), 16);
  EXPECT_GT(without.noise.parity_scale, 2. * estimate.noise.parity_scale);
}

TEST(Calibrate, FindsTheClockOffset) {
  auto setup = setup_of({"icr_sweep"}, 1, {"sensors.simulator0.time_offset_s=0.013"});
  setup.options.prior_sigma_clock_offset_s = 0.05;
  const auto estimate = fit_all(setup);
  EXPECT_NEAR(estimate.clock_offset_s[0], 0.013, 1e-3);
}

/// Share of the null directions that lies in the intrinsics whose name starts with `prefix`.
std::set<std::string> undetermined_names(const CalibrationEstimate& estimate, double ratio) {
  std::set<std::string> names;
  for (const auto& direction : estimate.undetermined) {
    if (direction.sigma_ratio < ratio) continue;
    for (const auto& [name, weight] : direction.weights) {
      if (std::abs(weight) > 0.3) names.insert(name);
    }
  }
  return names;
}

TEST(Calibrate, NamesThePositionsThatAStraightDriveCannotTell) {
  const auto estimate = fit_all(setup_of({"straight"}, 1));
  EXPECT_EQ(estimate.undetermined.size(), 6u) << "the positions of three wheels";
  for (const std::string& name : undetermined_names(estimate, 0.9)) {
    EXPECT_TRUE(name[0] == 'x' || name[0] == 'y') << name;
  }
}

TEST(Calibrate, NamesTheSteeringOffsetsThatRollingRowsCannotTell) {
  const auto redundant = fit_all(setup_of({"straight", "figure_eight"}, 1));
  const auto drive_only = fit_all(
      setup_of({"straight", "figure_eight"}, 1, {"kinematics.type=four_wis_wid_drive_only"}));
  EXPECT_TRUE(redundant.undetermined.empty());
  EXPECT_THAT(undetermined_names(drive_only, 0.7),
              ::testing::IsSupersetOf({"delta_o2", "delta_o3", "delta_o4"}));
}

TEST(Calibrate, ReadsItsFileLeavesOutAndWritesACalibrationThatARunIncludes) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / "viwo_calibrate";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "run.yaml")
      << config::to_yaml(simulated("'{motion}'", {"sensors.simulator0.true_intrinsics_scale=1"}));
  std::ofstream(folder / "calibration.yaml")
      << "calibration: test\nbase: run.yaml\nset: {odometry.twist: noise_weighted}\n"
         "leave_out_by: [motion]\nreport_by: [motion]\nsegment_s: 2\nestimate_extrinsics: true\n"
         "motions: [icr_sweep, figure_eight]\n";
  auto setup = read_calibration_setup(folder / "calibration.yaml", {}, registry());
  testing::Told told;
  const auto result = calibrate(setup, told);
  EXPECT_EQ(told.total(), 3);
  for (const char* fit :
       {"all recordings: ", "without motion figure_eight: ", "without motion icr_sweep: "}) {
    EXPECT_THAT(told.text(), ::testing::HasSubstr(fit));
  }
  ASSERT_EQ(result.left_out.size(), 1u);
  EXPECT_EQ(result.left_out[0].by, "motion");
  ASSERT_EQ(result.left_out[0].runs.size(), 2u);
  for (const ValidationRun& run : result.left_out[0].runs) {
    EXPECT_LT(run.calibrated.accuracy->end_m, 0.1 * run.nominal.accuracy->end_m);
  }
  write_calibration(folder / "out", result);
  const auto included = testing::run(simulated(
      "circle", {"sensors.simulator0.true_intrinsics_scale=1",
                 "kinematics.calibration=" + (folder / "out" / "calibration.yaml").string()}));
  const auto nominal =
      testing::run(simulated("circle", {"sensors.simulator0.true_intrinsics_scale=1"}));
  EXPECT_LT(included.accuracy->end_m, 0.1 * nominal.accuracy->end_m);
}

TEST(Calibrate, TellsWhatIsPredictedWithoutAMotionWhereNobodyAsksForSigmas) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / "viwo_calibrate_by_default";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "run.yaml") << config::to_yaml(simulated("'{motion}'", {}));
  std::ofstream(folder / "calibration.yaml")
      << "calibration: test\nbase: run.yaml\nset: {odometry.twist: noise_weighted}\n"
         "segment_s: 2\nmotions:\n  - {motion: icr_sweep, repetition: 1}\n"
         "  - {motion: figure_eight, repetition: 2}\n";
  const auto read = [&](const std::vector<std::string>& assignments) {
    return read_calibration_setup(folder / "calibration.yaml", assignments, registry());
  };
  auto setup = read({});
  const CalibrationResult result = calibrate(setup);
  ASSERT_EQ(result.left_out.size(), 1u);  // repetitions are motions here
  EXPECT_EQ(result.left_out[0].by, "motion");
  EXPECT_EQ(result.left_out[0].runs.size(), 2u);
  EXPECT_GT(result.left_out[0].spread.maxCoeff(), 0.);
  EXPECT_EQ(result.all.sigma, result.sigma_of_fit);
  EXPECT_TRUE(read({"leave_out_by=[]"}).leave_out_by.empty());
  const auto asked = read({"leave_out_by=[repetition]"});
  EXPECT_TRUE(asked.leave_out_is_asked);
  EXPECT_EQ(asked.leave_out_by, std::vector<std::string>{"repetition"});
}

TEST(Calibrate, LeavesSigmasCorrelationsAndTheReferencesPlaceAndClockToRuns) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / "viwo_calibrated_reference";
  std::filesystem::remove_all(folder);
  CalibrationSetup setup = setup_of({"icr_sweep", "figure_eight"}, 1);
  setup.options.estimate_extrinsics = true;
  setup.options.extrinsics_x_m_y_m_yaw_rad = {0.001, 0., 0.};
  setup.options.prior_sigma_clock_offset_s = 0.01;
  const CalibrationResult result = calibrate(setup);
  write_calibration(folder, result);
  const CalibrationFile file = read_calibration(folder / "calibration.yaml");
  const CalibrationEntry& x = *find(file.reference, "x_OinB");
  EXPECT_EQ(x.estimate, result.all.extrinsics[0]);
  EXPECT_EQ(x.sigma, result.all.extrinsics_sigma[0]);
  EXPECT_EQ(x.nominal, 0.001);
  const CalibrationEntry& clock = *find(file.reference, "t_OtoB");
  const auto& offsets = result.all.clock_offset_s;
  EXPECT_GE(clock.estimate, std::min(offsets[0], offsets[1]));
  EXPECT_LE(clock.estimate, std::max(offsets[0], offsets[1]));
  EXPECT_GE(clock.sigma, std::abs(offsets[0] - offsets[1]) / std::sqrt(2.) - 1e-12);
  // All but the three that the gauge holds.
  EXPECT_EQ(file.correlations.entries.size(), 13u);
  EXPECT_GT((file.correlations.matrix - Eigen::MatrixXd::Identity(13, 13)).norm(), 0.1);
  for (const CalibrationEntry& entry : file.intrinsics) {
    const int i = setup.recordings.front().setup.model->find(entry.name);
    EXPECT_EQ(entry.sigma, result.all.sigma[i]) << entry.name;
  }
  const auto run = simulated("circle", {"calibration=" + (folder / "calibration.yaml").string()});
  const RunSetup taken = read_run(run, registry());
  EXPECT_EQ(taken.extrinsics, result.all.extrinsics);
  EXPECT_EQ(taken.reference_time_offset_s, clock.estimate);
}

TEST(Calibrate, KnowsNoMoreThanRecordingsThatAreLeftOutTell) {
  CalibrationSetup setup = setup_of({"icr_sweep", "figure_eight", "circle"}, 1);
  setup.leave_out_by = {"motion"};
  const CalibrationResult result = calibrate(setup);
  const Intrinsics of_fit = fit_all(setup).sigma;
  const auto n = static_cast<int>(setup.recordings.size());
  Eigen::MatrixXd without(of_fit.size(), n);
  for (int left_out = 0; left_out < n; ++left_out) {
    std::vector<std::size_t> used;
    for (int i = 0; i < n; ++i) {
      if (i != left_out) used.push_back(static_cast<std::size_t>(i));
    }
    without.col(left_out) = fit_of(setup, used).x_WI;
  }
  const Eigen::VectorXd mean = without.rowwise().mean();
  int larger = 0;
  for (int i = 0; i < of_fit.size(); ++i) {
    const double jackknife =
        std::sqrt((n - 1.) / n * (without.row(i).array() - mean[i]).square().sum());
    EXPECT_NEAR(result.left_out[0].spread[i], jackknife, 1e-9) << i;
    EXPECT_EQ(result.sigma_of_fit[i], of_fit[i]) << i;
    const double spread = of_fit[i] > 0. ? result.left_out[0].spread[i] : 0.;  // 0: held
    EXPECT_EQ(result.all.sigma[i], std::max(of_fit[i], spread)) << i;
    if (spread > of_fit[i]) ++larger;
  }
  EXPECT_GT(larger, 0);
  EXPECT_LT(larger, of_fit.size());
}

TEST(Calibrate, FindsHowTheWheelsWander) {
  const auto found = [](std::vector<std::string> assignments) {
    assignments.emplace_back("sensors.simulator0.duration_s=200");
    auto setup = setup_of({"icr_sweep", "figure_eight"}, 1, assignments);
    return calibrate(setup).wander;
  };
  const WheelWander wanders = found({"sensors.simulator0.intrinsics_wander=0.5",
                                     "sensors.simulator0.intrinsics_wander_time_s=1"});
  EXPECT_NEAR(wanders.sigma, 0.5, 0.1);
  EXPECT_NEAR(wanders.time_s, 1., 0.5);
}

TEST(Calibrate, FindsNoWanderInNoise) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    auto setup =
        setup_of({"icr_sweep", "figure_eight"}, seed, {"sensors.simulator0.duration_s=40"});
    EXPECT_EQ(calibrate(setup).wander.sigma, 0.) << seed;
  }
}

TEST(Calibrate, DoesNotTellATimeOfWanderBeyondWhatItCompares) {
  WheelWander wander;
  wander.sigma = 0.5;
  wander.time_s = 2.;
  wander.lag_s = {0.2, 10.};
  EXPECT_NE(wander_text(wander).find("0.5 prior sigmas, for 2 s: "), std::string::npos);
  wander.time_s = 39.5;
  EXPECT_NE(wander_text(wander).find("for longer than the 10 s that are compared"),
            std::string::npos);
}

}  // namespace
}  // namespace viwo

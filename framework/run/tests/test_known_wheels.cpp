// What a filter knows of its wheels before it starts, where the gauge holds some of their entries:
// starts that are drawn, robots that are drawn, and a robot whose first wheel is off (CAL-18).
#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include <Eigen/Dense>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "simulated.hpp"
#include "true_calibration.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/wheel/held_gauge.hpp"

namespace viwo {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

const std::string kRobot =
    "{type: four_wis_wid, x_m: [0.3, -0.3, -0.3, 0.3], y_m: [0.25, 0.25, -0.25, -0.25], "
    "radius_m: 0.05, prior_sigma_radius_m: 0.001, prior_sigma_position_m: 0.001, "
    "prior_sigma_steer_offset_rad: 0.02, sigma_drive_rad_per_s: 0.02, sigma_steer_rad: 0.002, "
    "sigma_lateral_m_per_s: 0.003";

const std::string kMountSigmas =
    ", sigma_p_IinO_m: [0.02, 0.02, 0.02], sigma_R_ItoO_rad: [0.02, 0.02, 0.02]";

/// The IMU sits off O and is turned.
RunSetup swerve(const std::string& simulator, const std::string& robot, const std::string& wheels,
                const std::string& estimator, std::uint64_t seed,
                const std::string& sigmas = kMountSigmas) {
  const std::string mount = "p_IinO_m: [0.2, -0.1, 0.15], rpy_ItoO_rad: [0, 0, 0.7], ";
  const std::string text =
      "sensors: {simulator0: {type: simulator, features: 0, ground: flat, " + mount + simulator +
      ", robot: " + kRobot + robot + "}}}\nkinematics: " + kRobot + "}\nwheels: {" + mount +
      wheels + sigmas + "}\nestimator: {start: reference, max_epoch_s: 0.1, " + estimator +
      "}\nupdates: {wheel_odometry: {}, wheel_parity: {}, planar_motion: {}}\n";
  return read_run(config::parse(text, "run.yaml"), testing::registry(), seed);
}

TEST(HeldGauge, BringsATruthOfAnotherFrameIntoTheOneThatTheEstimateHolds) {
  RunSetup setup = swerve("duration_s: 0.1", "", "hold_gauge: true", "clones: 2", 1);
  const WheelModel& model = *setup.model;
  WheelsView here;
  here.x_WI = model.nominal();
  here.R_ItoO = exp_so3({0.02, -0.01, 0.3});
  here.p_IinO = {0.1, -0.05, 0.2};
  // The same base told in a frame that is turned by 0.2 rad and shifted.
  const Eigen::Vector3d g(0.2, 0.03, -0.02);
  WheelsView there = here;
  ASSERT_EQ(model.model().move_frame(g, there.x_WI), Status::kOk);
  there.R_ItoO = exp_so3({0., 0., -0.2}) * here.R_ItoO;
  there.p_IinO = exp_so3({0., 0., -0.2}) * (here.p_IinO - Eigen::Vector3d(0.03, -0.02, 0.));
  EXPECT_GT((there.x_WI - here.x_WI).norm(), 0.1);
  ASSERT_TRUE(move_to_held_gauge(model, here.x_WI, there));
  EXPECT_LT((there.x_WI - here.x_WI).norm(), 1e-9);
  EXPECT_LT((there.R_ItoO - here.R_ItoO).norm(), 1e-9);
  EXPECT_LT((there.p_IinO - here.p_IinO).norm(), 1e-9);
}

// Of a skid-steered base two entries place O, which cannot be turned about itself.
TEST(HeldGauge, MovesABaseOfWhichTwoEntriesPlaceIt) {
  const RunSetup setup = read_run(
      config::parse("sensors: {simulator0: {type: simulator, features: 0, duration_s: 0.1, "
                    "robot: &robot {type: skid_steer, radius_left_m: 0.1, radius_right_m: 0.1, "
                    "y_icr_left_m: 0.31, y_icr_right_m: -0.28}}}\nkinematics: *robot\n",
                    "run.yaml"),
      testing::registry(), 1);
  const WheelModel& model = *setup.model;
  WheelsView here;
  here.x_WI = model.nominal();
  here.p_IinO = {0.1, -0.05, 0.2};
  WheelsView there = here;
  there.x_WI[model.find("x_icr")] += 0.03;
  there.x_WI[model.find("y_icr_left")] += 0.02;
  ASSERT_TRUE(move_to_held_gauge(model, here.x_WI, there));
  EXPECT_EQ(there.x_WI[model.find("x_icr")], here.x_WI[model.find("x_icr")]);
  EXPECT_NEAR(there.x_WI[model.find("y_icr_right")], here.x_WI[model.find("y_icr_right")] - 0.02,
              1e-9);
  EXPECT_LT((there.p_IinO - here.p_IinO + Eigen::Vector3d(0.03, 0.02, 0.)).norm(), 1e-9);
  EXPECT_EQ(there.R_ItoO, here.R_ItoO);
}

/// Errors of the start, [x_WI, theta_ItoO, p_IinO].
Eigen::VectorXd errors_at_start(const WheelSet& set, const std::map<std::string, double>& truth) {
  const auto [mount, clock, intrinsics] = wheels_blocks(set.prior);
  const auto n = static_cast<Eigen::Index>(intrinsics.entries.size());
  Eigen::VectorXd is(n + 6), start(n + 6);
  start << set.prior.wheels.x_WI, Eigen::Vector3d::Zero(), set.prior.wheels.p_IinO;
  Eigen::Index i = 0;
  for (const BlockSpec* block : {&intrinsics, &mount}) {
    for (const BlockEntry& entry : block->entries) is[i++] = truth.at(entry.name);
  }
  Eigen::VectorXd off = start - is;
  const Eigen::Matrix3d R = exp_so3(Eigen::Vector3d(is.segment<3>(n)));
  off.segment<3>(n) = log_so3(R * set.prior.wheels.R_ItoO.transpose());
  return off;
}

struct Consistency {
  double mean_square = 0.;  ///< of the errors in units of what is known, per free entry
  double held = 0.;         ///< the largest error of what is held
};

/// Of the starts of `count` seeds.
template <class MakeSetup>
Consistency consistency_of(const MakeSetup& setup_of, int count) {
  Consistency out;
  for (int seed = 1; seed <= count; ++seed) {
    RunSetup setup = setup_of(static_cast<std::uint64_t>(seed));
    const WheelSet& set = setup.filter->wheels.front();
    const auto truth = true_calibration(*setup.filter, collect(setup).calibration);
    const Eigen::VectorXd off = errors_at_start(set, truth);
    const Eigen::MatrixXd P = set.P_before();
    std::vector<Eigen::Index> free;
    for (Eigen::Index i = 0; i < off.size(); ++i) {
      if (P(i, i) > 0.) {
        free.push_back(i);
      } else {
        out.held = std::max(out.held, std::abs(off[i]));
      }
    }
    const Eigen::VectorXd e = off(free);
    out.mean_square += e.dot(P(free, free).ldlt().solve(e)) /
                       (static_cast<double>(free.size()) * static_cast<double>(count));
  }
  return out;
}

constexpr int kSeeds = 200;
/// Of a mean of squares of 19 gaussians over the seeds: three sigmas.
const double kChance = 3. * std::sqrt(2. / (19. * kSeeds));

TEST(KnownWheels, AreWhereStartsAreDrawn) {
  const auto drawn = [](const std::string& wheels) {
    return consistency_of(
        [&](std::uint64_t seed) {
          return swerve("duration_s: 0.1", "", wheels, "calibration_error_scale: 1", seed);
        },
        kSeeds);
  };
  for (const char* wheels : {"held_are_exact: false", "held_are_exact: true"}) {
    const Consistency found = drawn(wheels);
    EXPECT_NEAR(found.mean_square, 1., kChance) << wheels;
    EXPECT_LT(found.held, 1e-9) << wheels;
  }
}

TEST(KnownWheels, LeaveAnAxisThatIsHeldWhereItIs) {
  const Consistency found = consistency_of(
      [&](std::uint64_t seed) {
        return swerve("duration_s: 0.1", "", "held_are_exact: false", "calibration_error_scale: 1",
                      seed, ", sigma_p_IinO_m: [0, 0.02, 0.02], sigma_R_ItoO_rad: [0.02, 0.02, 0]");
      },
      kSeeds);
  EXPECT_LT(found.held, 1e-9);
  EXPECT_NEAR(found.mean_square, 1., 1.1 * kChance);  // 17 entries
}

TEST(KnownWheels, AreWhereRobotsAreDrawn) {
  const std::string as_known =
      "duration_s: 0.1, true_intrinsics_scale: 1, true_sigma_p_IinO_m: [0.02, 0.02, 0.02], "
      "true_sigma_R_ItoO_rad: [0.02, 0.02, 0.02]";
  const auto drawn = [&](const std::string& wheels) {
    return consistency_of(
        [&](std::uint64_t seed) { return swerve(as_known, "", wheels, "clones: 2", seed); },
        kSeeds);
  };
  const Consistency found = drawn("held_are_exact: false");
  EXPECT_NEAR(found.mean_square, 1., kChance);
  EXPECT_LT(found.held, 1e-9);
  // Whoever takes the first wheel of such robots for exact is too sure of all others.
  EXPECT_GT(drawn("held_are_exact: true").mean_square, 2.);
  // Where nothing is held each entry is known by itself.
  EXPECT_NEAR(drawn("hold_gauge: false").mean_square, 1., kChance);
}

/// The same swerve with intrinsics of a calibration.yaml, known to `sigma` but for the held ones.
FilterSetup calibrated_swerve(const std::string& mount_in_file) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "known_wheels";
  std::filesystem::create_directories(folder);
  RunSetup nominal = swerve("duration_s: 0.1", "", "hold_gauge: true", "clones: 2", 1);
  const WheelModel& model = *nominal.model;
  std::ofstream file(folder / "calibration.yaml");
  file << "model: four_wis_wid\ntwist: plain\nintrinsics:\n";
  for (int i = 0; i < model.n_intrinsics(); ++i) {
    const IntrinsicSpec& spec = model.description().intrinsics[static_cast<std::size_t>(i)];
    file << "  " << spec.name << ": {estimate: " << spec.nominal
         << ", sigma: " << (spec.gauge_fixed ? 0. : 1e-4) << "}\n";
  }
  file << mount_in_file;
  file.close();
  config::Node run = nominal.resolved;
  run.set("calibration", config::Node::scalar_of((folder / "calibration.yaml").string()));
  return *read_run(run, testing::registry(), 1).filter;
}

// The file knows how the wheels are placed in the frame that the first one holds; how the IMU is
// placed in it a drawing does not say any better than where that wheel is.
TEST(KnownWheels, OfAFileLeaveTheMountToTheDrawing) {
  const FilterSetup setup = calibrated_swerve("");
  const WheelSet& set = setup.wheels.front();
  const int x_2 = set.model->find("x_2");
  EXPECT_DOUBLE_EQ(set.prior.sigma_intrinsics[x_2], 1e-4);
  EXPECT_EQ(set.prior.sigma_intrinsics[set.model->find("delta_o1")], 0.);
  EXPECT_NEAR(set.prior.sigma_extrinsics[2], std::hypot(0.02, 0.02), 1e-6);
  EXPECT_EQ(set.prior.sigma_extrinsics[0], 0.02);
  const auto& entries = setup.options.filter.correlations.entries;
  EXPECT_THAT(entries, ElementsAre("theta_ItoO_z", "p_IinO_x", "p_IinO_y"));
}

TEST(KnownWheels, OfAFileWithTheMountAreThoseOfTheFile) {
  std::string mount = "mount:\n";
  for (const char* name : {"theta_ItoO_x", "theta_ItoO_y", "theta_ItoO_z"}) {
    mount += std::string("  ") + name + ": {estimate: 0.1, sigma: 0.003, unit: rad}\n";
  }
  for (const char* name : {"p_IinO_x", "p_IinO_y", "p_IinO_z"}) {
    mount += std::string("  ") + name + ": {estimate: 0.1, sigma: 0.003, unit: m}\n";
  }
  const FilterSetup setup = calibrated_swerve(mount);
  for (const double sigma : setup.wheels.front().prior.sigma_extrinsics) {
    EXPECT_DOUBLE_EQ(sigma, 0.003);
  }
  EXPECT_THAT(setup.options.filter.correlations.entries, IsEmpty());
}

/// The largest error of a minute of a figure eight, in sigmas, of a robot whose first zero is off
/// by two of its prior sigmas.
double worst_sigmas(const std::string& wheels) {
  RunSetup setup = swerve("motion: figure_eight, duration_s: 60, sigma_gyro_bias_rad_per_s: 0.005",
                          ", steer_offset_rad: [0.04, 0, 0, 0]", wheels, "clones: 11", 1);
  const RunData data = collect(setup);
  const RunResult result = viwo::run(setup, data);
  double worst = 0.;
  for (const CalibrationTrack& track : result.calibration) {
    if (track.sigma.back() > 0.) {
      worst = std::max(worst, std::abs(track.final_error) / track.sigma.back());
    }
  }
  return worst;
}

TEST(KnownWheels, OfARobotWhoseFirstZeroIsOffAreFound) {
  EXPECT_LT(worst_sigmas("held_are_exact: false"), 4.);
  EXPECT_GT(worst_sigmas("held_are_exact: true"), 5.);
}

}  // namespace
}  // namespace viwo

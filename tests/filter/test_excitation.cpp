// The monitor of excitation in runs of the simulated robot: what it warns of, and what holding does
// when a sweep from which everything is learned ends in a long straight line.
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "filter_runs.hpp"
#include "message_of.hpp"
#include "viwo/eval/consistency.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

using Eigen::VectorXd;

constexpr int kSeeds = 10;

std::vector<std::string> moving(const std::string& motion, const std::string& ground,
                                std::vector<std::string> more = {}) {
  more.push_back("sensors.simulator0.motion=" + motion);
  more.push_back("sensors.simulator0.ground=" + ground);
  return more;
}

std::vector<std::string> warnings(const std::vector<std::string>& assignments) {
  const auto runs = testing::variant_runs("paper_accuracy", "bad_init_calib_on", 1, assignments);
  EXPECT_EQ(runs.front().status, RunStatus::kOk) << runs.front().cause;
  EXPECT_FALSE(runs.front().monitor.t_s.empty());
  std::vector<std::string> out;
  for (const auto& warning : runs.front().monitor.warnings) out.push_back(warning.text);
  return out;
}

using Texts = std::vector<std::string>;
const std::string kFlat =
    "flat ground for 5 s: theta_ItoO_x, theta_ItoO_y, p_IinO_z cannot be learned - drive over "
    "slopes or hold them";
const std::string kSteady =
    "constant speed and turn rate for 5 s: t_OtoI cannot be learned - speed up, slow down or steer";

TEST(Excitation, SweepIsFineOnUnevenGroundAndAFigureEightButForItsEnds) {
  EXPECT_EQ(warnings(moving("icr_sweep", "uneven")), Texts{});
  EXPECT_EQ(warnings(moving("figure_eight", "uneven")), Texts{kSteady});
}

TEST(Excitation, OnFlatGroundTheyHideWhatNeedsSlopes) {
  EXPECT_EQ(warnings(moving("icr_sweep", "flat")), Texts{kFlat});
  EXPECT_EQ(warnings(moving("figure_eight", "flat")), Texts{kFlat});
  EXPECT_EQ(warnings(moving(
                "icr_sweep", "flat",
                {"wheels.sigma_p_IinO_m=[0.1, 0.1, 0]", "wheels.sigma_R_ItoO_rad=[0, 0, 0.01]"})),
            Texts{});
}

TEST(Excitation, NamesWhatAStraightLineACircleAndARestHide) {
  const std::vector<std::string> short_run{"sensors.simulator0.duration_s=15"};
  EXPECT_EQ(warnings(moving("straight", "flat", short_run)),
            (Texts{"no yaw rate for 5 s: p_IinO_x, p_IinO_y, x_2..x_4, y_2..y_4 cannot be learned "
                   "- turn",
                   kFlat, kSteady}));
  EXPECT_EQ(warnings(moving("circle", "uneven", short_run)),
            (Texts{"constant steering or radius of turn for 5 s: theta_ItoO_z, r_1..r_4, x_2..x_4, "
                   "y_2..y_4, delta_o2..delta_o4 cannot be told apart - change it while turning",
                   kSteady}));
  EXPECT_EQ(warnings(moving("stationary", "flat", short_run)),
            (Texts{"standing still for 5 s: theta_ItoO_x, theta_ItoO_y, theta_ItoO_z, p_IinO_x, "
                   "p_IinO_y, p_IinO_z, t_OtoI, r_1..r_4, x_2..x_4, y_2..y_4, "
                   "delta_o2..delta_o4 cannot be learned - drive"}));
}

TEST(Excitation, WorksForAnyKinematicModel) {
  const std::string differential =
      "={type: differential, radius_left_m: 0.1, radius_right_m: 0.1, baseline_m: 0.4, "
      "sigma_drive_rad_per_s: 0.005}";
  EXPECT_EQ(warnings(moving("straight", "uneven",
                            {"sensors.simulator0.duration_s=15", "kinematics" + differential,
                             "sensors.simulator0.robot" + differential})),
            (Texts{"no yaw rate for 5 s: p_IinO_x, p_IinO_y, baseline cannot be learned - turn",
                   kSteady}));
}

/// What a parameter did over the seeds.
struct Outcome {
  double nees = 0.;   ///< mean at the end
  double moved = 0.;  ///< largest change in the straight, in sigmas at its beginning
};

/// In the straight: after the two seconds into it and a window.
constexpr double kStraightS = 28.;

/// With all that is measured taken for motion, noise too: what holding is to cure.
std::map<std::string, Outcome> outcomes(const std::string& ground, bool hold) {
  const auto runs = testing::variant_runs(
      "paper_accuracy", "true_init_calib_on", kSeeds,
      moving("sweep_then_straight", ground,
             {"estimator.calibration_error_scale=1",
              // What is known of one entry says nothing of another.
              "wheels.held_are_exact=true",
              std::string("estimator.hold_unexcited=") + (hold ? "true" : "false"),
              "updates.wheel_odometry.motion_sigmas=0", "updates.wheel_parity.motion_sigmas=0"}));
  std::map<std::string, Outcome> out;
  for (const RunResult& run : runs) {
    EXPECT_EQ(run.status, RunStatus::kOk) << run.cause;
    const auto at = static_cast<std::size_t>(
        std::lower_bound(run.epoch_t_s.begin(), run.epoch_t_s.end(), kStraightS) -
        run.epoch_t_s.begin());
    EXPECT_NEAR(run.epoch_t_s.at(at), kStraightS, 1.);
    const bool holds = run.monitor.held.back() > 0;
    EXPECT_EQ(holds, hold);
    for (const auto& track : run.calibration) {
      if (track.sigma.back() == 0.) continue;
      Outcome& outcome = out[track.name];
      outcome.nees += std::pow(track.final_error / track.sigma.back(), 2) / kSeeds;
      outcome.moved = std::max(
          outcome.moved, std::abs(track.estimate.back() - track.estimate[at]) / track.sigma[at]);
    }
  }
  EXPECT_EQ(out.size(), 20u);
  return out;
}

TEST(Excitation, HeldParametersStayPutAndConsistentInALongStraightOnUnevenGround) {
  const auto bounds = eval::mean_nees_bounds(1, kSeeds, 0.99);
  const auto held = outcomes("uneven", true);
  for (const auto& [name, outcome] : held) {
    EXPECT_GT(outcome.nees, bounds.low) << name;
    EXPECT_LT(outcome.nees, bounds.high) << name;
  }
  const auto free = outcomes("uneven", false);
  for (const char* name : {"x_2", "x_3", "x_4"}) {
    EXPECT_LT(held.at(name).moved, 0.2) << name;
    EXPECT_GT(free.at(name).moved, 3. * held.at(name).moved) << name;
  }
  // What a straight line tells is still learned.
  EXPECT_GT(held.at("r_1").moved, 1.);
}

TEST(Excitation, HoldingKeepsTheFilterConsistentOnFlatGroundWhereNoiseLooksLikeATilt) {
  const auto bounds = eval::mean_nees_bounds(1, kSeeds, 0.99);
  const auto held = outcomes("flat", true);
  for (const auto& [name, outcome] : held) {
    EXPECT_GT(outcome.nees, bounds.low) << name;
    EXPECT_LT(outcome.nees, bounds.high) << name;
  }
  const auto free = outcomes("flat", false);
  for (const char* name : {"p_IinO_x", "p_IinO_y", "p_IinO_z", "theta_ItoO_x", "theta_ItoO_y",
                           "t_OtoI", "x_2", "x_3", "x_4", "y_2", "y_3", "y_4"}) {
    EXPECT_LT(held.at(name).moved, 0.2) << name;
    EXPECT_GT(free.at(name).moved, 1.5 * held.at(name).moved) << name;
  }
  EXPECT_GT(free.at("p_IinO_z").nees, 10.);
}

/// Calibration of the only wheel set.
WheelsView wheels_of(const FilterSetup& setup, const Filter& filter) {
  const auto specs = wheels_blocks(setup.wheels.front().prior);
  const auto id = [&](std::size_t k) {
    const auto all = filter.blocks().specs();
    const auto found = std::find_if(
        all.begin(), all.end(), [&](const BlockSpec& spec) { return spec.name == specs[k].name; });
    return BlockId{static_cast<int>(found - all.begin())};
  };
  return WheelsBlocks{nullptr, id(0), id(1), id(2), {}, 0.}.view(filter.view());
}

/// dtheta and additive, from one estimate to the next.
VectorXd change(const WheelsView& from, const WheelsView& to) {
  VectorXd d(7 + from.x_WI.size());
  d << -log_so3(to.R_ItoO * from.R_ItoO.transpose()), to.p_IinO - from.p_IinO,
      to.t_OtoI_s - from.t_OtoI_s, to.x_WI - from.x_WI;
  return d;
}

TEST(Excitation, HeldDirectionsOfARunDoNotMoveAtAll) {
  auto setup = testing::run_setup(
      "runs/viwo_swerve.yaml",
      moving("sweep_then_straight", "uneven",
             {"estimator.hold_unexcited=true", "sensors.simulator0.duration_s=40"}));
  const auto data = collect(setup);
  Estimator estimator = testing::make_estimator(setup, data.states().front());
  double largest_held = 0., largest_other = 0.;
  int steps = 0;
  WheelsView before = wheels_of(*setup.filter, estimator.filter());
  for (const testing::Given& given : testing::in_time_order(data)) {
    testing::add(estimator, setup, given);
    while (estimator.step()) {
      const ExcitationMonitor& monitor = estimator.monitors()[0];
      const WheelsView now = wheels_of(*setup.filter, estimator.filter());
      const VectorXd all = change(before, now);
      before = now;
      const auto columns = monitor.information().columns();
      // Once the window is full, an epoch with news has the directions of the epochs to come.
      const double t_s = seconds_between(data.states().front().t_ns, estimator.filter().t_ns());
      if (t_s < kStraightS || monitor.has_news()) continue;
      EXPECT_GE(monitor.unexcited(), 6);
      ++steps;
      VectorXd scaled(static_cast<Eigen::Index>(columns.size()));
      for (Eigen::Index i = 0; i < scaled.size(); ++i) {
        const int column = columns[static_cast<std::size_t>(i)];
        scaled[i] = all[column - now.extrinsics_column] / monitor.information().sigma()[i];
      }
      const VectorXd along = monitor.information().directions().transpose() * scaled;
      largest_held = std::max(largest_held, along.head(monitor.unexcited()).cwiseAbs().maxCoeff());
      largest_other = std::max(largest_other, along.tail(13).cwiseAbs().maxCoeff());
    }
  }
  EXPECT_GT(steps, 40);
  // Not to the bit: the factors of an epoch turn the mount one after the other.
  EXPECT_LT(largest_held, 1e-6);
  EXPECT_GT(largest_other, 1e-3);
}

TEST(Excitation, HoldingWithoutTheMonitorIsRefused) {
  EXPECT_THAT(testing::error_of([] {
                testing::run_setup("runs/viwo_swerve.yaml",
                                   {"estimator.hold_unexcited=true", "estimator.monitor=false"});
              }),
              ::testing::HasSubstr("estimator.hold_unexcited needs estimator.monitor"));
}

}  // namespace
}  // namespace viwo

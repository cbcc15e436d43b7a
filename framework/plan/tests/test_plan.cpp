// Plans: they keep to the floor, and a calibration of what they drive reaches the goals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibrated.hpp"
#include "drives.hpp"
#include "message_of.hpp"
#include "simulated.hpp"
#include "viwo/log/table_reader.hpp"
#include "viwo/log/tum.hpp"
#include "viwo/sim/drive_params.hpp"

namespace viwo {
namespace {

using plan::Plan;
using plan::PlanSetup;
using ::testing::AllOf;
using testing::differential_plan;
using testing::error_of;
using ::testing::HasSubstr;
using testing::own_folder;
using testing::swerve_plan;
using testing::written;

/// The largest reach of the base over the floor's edges in plan.csv, m, and of its speed over the
/// limit, m/s; below zero where it keeps to them.
struct Excess {
  double floor_m = -1e9, speed_m_per_s = -1e9;
};

Excess excess_of(const std::filesystem::path& csv, const plan::LimitParams& limits) {
  log::TableReader table(csv);
  Excess out;
  const auto at = [&](const char* name) { return table.number(table.column(name)); };
  while (table.next()) {
    out.floor_m =
        std::max({out.floor_m, std::abs(at("x_m")) + limits.base_radius_m - 0.5 * limits.floor_x_m,
                  std::abs(at("y_m")) + limits.base_radius_m - 0.5 * limits.floor_y_m});
    out.speed_m_per_s =
        std::max(out.speed_m_per_s, std::hypot(at("v_x_m_per_s"), at("v_y_m_per_s")) +
                                        limits.base_radius_m * std::abs(at("omega_rad_per_s")) -
                                        limits.max_speed_m_per_s);
  }
  return out;
}

TEST(Plan, ReachesItsGoalsOnFloorsOfAnyShapeAndNeverLeavesThem) {
  for (const auto& floor : {std::pair{"3", "3"}, {"6", "0.7"}, {"0.8", "5"}, {"0.8", "0.8"}}) {
    const PlanSetup setup = swerve_plan(
        {std::string("floor_x_m=") + floor.first, std::string("floor_y_m=") + floor.second});
    const Plan plan = make_plan(setup);
    EXPECT_TRUE(plan.reached) << floor.first << " x " << floor.second << ": " << plan.why_not;
    const auto folder = own_folder();
    write_plan(folder, setup, plan);
    const Excess excess = excess_of(folder / "plan.csv", setup.params);
    EXPECT_LE(excess.floor_m, 0.) << floor.first << " x " << floor.second;
    EXPECT_LE(excess.speed_m_per_s, 0.) << floor.first << " x " << floor.second;
    // The same plan on a floor that is smaller than what it uses would be found out.
    plan::LimitParams smaller = setup.params;
    smaller.floor_x_m = smaller.floor_y_m = 0.45;
    EXPECT_GT(excess_of(folder / "plan.csv", smaller).floor_m, 0.);
  }
}

TEST(Plan, IsForAnyBase) {
  for (const char* distance : {"distance=false", "distance=true"}) {
    const Plan plan = make_plan(differential_plan({distance}));
    EXPECT_TRUE(plan.reached) << distance << ": " << plan.why_not;
  }
  const auto car =
      written(own_folder() / "car.yaml",
              "plan: car\nbase_radius_m: 1\nfloor_x_m: 30\nfloor_y_m: 20\nmin_turn_radius_m: 2\n"
              "max_speed_m_per_s: 2\nkinematics: {type: ackermann, wheel_base_m: 1, track_m: 0.6, "
              "radius_m: 0.15, prior_sigma_radius_m: 0.01}\n"
              "goals: {r_rear_left: 1 %, r_rear_right: 1 %}\ndistance: true\n");
  const Plan plan = make_plan(plan::read_plan_setup(car, {}, testing::registry()));
  EXPECT_TRUE(plan.reached) << plan.why_not;
}

TEST(Plan, OfTheInformationSaysWhatItsPiecesTell) {
  const PlanSetup setup = swerve_plan();
  const Plan plan = make_plan(setup);
  plan::WheelInformation wheels(setup.model, setup.params);
  const auto samples =
      plan::exact_encoders(*setup.model, twist_of(plan), plan.duration_s(), setup.params.rate_hz);
  const Intrinsics sigma =
      wheels.sigma(wheels.of(samples, samples.front().begin_ns, samples.back().end_ns));
  // Segments and cells are cut elsewhere than piece by piece.
  for (const plan::Goal& goal : setup.goals) {
    EXPECT_NEAR(sigma[goal.intrinsic], plan.pieces.back().sigma[goal.intrinsic],
                0.02 * sigma[goal.intrinsic]);
  }
}

TEST(Plan, DrivenInSimulationCalibratesAsWellAsItSays) {
  const PlanSetup setup = swerve_plan();
  const Plan plan = make_plan(setup);
  const auto folder = own_folder();
  write_plan(folder, setup, plan);
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const auto ratio_after = [&](double duration_s, double* most_wrong) {
      auto drive = testing::driven(folder / "plan.csv", seed, duration_s);
      const auto estimate = testing::calibrated(drive);
      const auto errors = testing::errors_in_goals(setup, drive, estimate);
      if (most_wrong != nullptr) *most_wrong = errors.cwiseAbs().maxCoeff();
      return worst_goal(setup.goals, estimate.sigma).ratio;
    };
    double most_wrong = 0.;
    // Noise that is found in a drive of seconds is found to some ten percent.
    EXPECT_LT(ratio_after(plan.duration_s(), &most_wrong), 1.3) << seed;
    EXPECT_LT(most_wrong, 4.) << seed;
    // A third of the drive is not enough.
    EXPECT_GT(ratio_after(plan.duration_s() / 3., nullptr), 1.3) << seed;
  }
}

TEST(Plan, InAFileIsTheMotionThatASimulatorDrives) {
  const PlanSetup setup = swerve_plan();
  const Plan plan = make_plan(setup);
  const auto folder = own_folder();
  write_plan(folder, setup, plan);
  const auto twist = twist_of(plan);
  const sim::PlanarMotion motion = sim::motion_from("file", folder / "plan.csv", {});
  for (double t_s = -1.; t_s < plan.duration_s() + 1.; t_s += 0.013) {
    EXPECT_LT((motion.twist(t_s) - twist(t_s)).cwiseAbs().maxCoeff(), 1e-4) << t_s;
  }
  sim::PoseIntegrator integrator(motion);
  const Eigen::Vector3d end = compose(plan.pieces.back().start, plan.pieces.back().piece.end());
  EXPECT_LT((integrator.advance_to(plan.duration_s()) - end).norm(), 1e-4);
  const Trajectory poses = log::read_tum(folder / "plan.tum");
  EXPECT_LT((planar(poses.back()).tail<2>() - end.tail<2>()).norm(), 1e-4);
}

TEST(MotionFile, IsRefusedWhereItIsNone) {
  const auto folder = own_folder();
  const auto refusal = [&](const std::string& text) {
    const auto file = written(folder / "motion.csv", text);
    return error_of([&] { sim::motion_from("file", file, {}); });
  };
  const std::string header = "time_s,v_x_m_per_s,v_y_m_per_s,omega_rad_per_s\n";
  std::string rows = header;
  for (int k = 0; k <= 40; ++k) rows += std::to_string(0.01 * k) + ",0,0,0\n";
  EXPECT_EQ(refusal(rows), "");
  EXPECT_THAT(refusal(rows + "0.3,0,0,0\n"), HasSubstr("motion.csv:43"));
  EXPECT_THAT(refusal(rows + "0.41,nan,0,0\n"), HasSubstr("is not finite"));
  EXPECT_THAT(refusal(rows + "0.41,1e200,0,0\n0.42,0,0,0\n"), HasSubstr("faster than any robot"));
  EXPECT_THAT(refusal(rows + "0.41,1,0,0\n"), HasSubstr("ends at rest"));
  EXPECT_THAT(refusal(rows + "9,0,0,0\n"), HasSubstr("evenly spaced"));
  EXPECT_THAT(refusal(header + "0,0,0,0\n"), HasSubstr("at least 20 rows"));
  EXPECT_THAT(refusal("time_s,v_x_m_per_s\n0,0\n"), HasSubstr("v_y_m_per_s"));
  EXPECT_THAT(error_of([] { sim::motion_from("file", "", {}); }), HasSubstr("needs it"));
  EXPECT_THAT(error_of([] { sim::motion_from("circle", "a.csv", {}); }),
              HasSubstr("goes with motion: file"));
}

TEST(PlanFile, IsRefusedWithWhatIsWrongInIt) {
  const auto refusal = [](const std::vector<std::string>& assignments) {
    return error_of([&] { swerve_plan(assignments); });
  };
  EXPECT_EQ(refusal({}), "");
  EXPECT_THAT(refusal({"floor_x_m=0.4"}), HasSubstr("no room for a base of base_radius_m 0.2"));
  for (const char* value : {"0", "-1", ".nan", ".inf", "fast"}) {
    for (const char* key : {"max_speed_m_per_s", "max_acceleration_m_per_s2", "floor_y_m",
                            "max_yaw_rate_rad_per_s", "base_radius_m"}) {
      EXPECT_THAT(refusal({std::string(key) + "=" + value}), HasSubstr(key)) << value;
    }
  }
  EXPECT_THAT(refusal({"max_sped_m_per_s=1"}), HasSubstr("did you mean 'max_speed_m_per_s'"));
  EXPECT_THAT(refusal({"goals={radius: 1 %}"}), HasSubstr("no intrinsic 'radius'"));
  EXPECT_THAT(refusal({"goals={delt_o: 0.1}"}), HasSubstr("did you mean 'delta_o'"));
  EXPECT_THAT(refusal({"goals={r: -1 %}"}), HasSubstr("above 0"));
  EXPECT_THAT(refusal({"goals={r: 1 mm}"}), HasSubstr("'1 %'"));
  EXPECT_THAT(refusal({"goals={delta_o1: 0.001}"}), HasSubstr("it is held"));
  EXPECT_THAT(refusal({"goals={}"}), HasSubstr("'goals' must say"));
  EXPECT_THAT(refusal({"kinematics={type: four_wis_wi}"}), HasSubstr("four_wis_wid"));
}

TEST(PlanFile, WithGoalsThatNoMotionReachesSaysWhy) {
  const auto refusal = [](const std::vector<std::string>& assignments) {
    const PlanSetup setup = swerve_plan(assignments);
    return error_of([&] { make_plan(setup); });
  };
  const std::string places = "kinematics.prior_sigma_position_m=0.01";
  EXPECT_THAT(refusal({places}), AllOf(HasSubstr("goals: r_"), HasSubstr("however long the drive"),
                                       HasSubstr("distance: true), would")));
  EXPECT_EQ(refusal({places, "distance=true"}), "");
  EXPECT_THAT(refusal({"max_speed_m_per_s=1e-9"}), HasSubstr("none within ten minutes"));
  // Wheels so good that the information is large: the scale is no better known for it.
  EXPECT_THAT(refusal({places, "wheel_noise_scale=0.001"}), HasSubstr("distance: true), would"));
  const PlanSetup blind = differential_plan({"gyro=false", "goals={baseline: 0.01 %}"});
  EXPECT_THAT(error_of([&] { make_plan(blind); }),
              AllOf(HasSubstr("baseline"), HasSubstr("There is no gyro"),
                    ::testing::Not(HasSubstr("would"))));
}

TEST(Plan, ThatTakesTooLongSaysSo) {
  const Plan plan = make_plan(swerve_plan({"max_path_m=2"}));
  EXPECT_FALSE(plan.reached);
  EXPECT_THAT(plan.why_not, HasSubstr("max_path_m"));
  EXPECT_LE(plan.cost_m(), 2.);
}

}  // namespace
}  // namespace viwo

// By how much a plan is shorter than an ICR sweep and random driving, over fifty seeds.
#include <algorithm>
#include <iostream>

#include <gtest/gtest.h>

#include "calibrated.hpp"
#include "drives.hpp"
#include "viwo/eval/statistics.hpp"

namespace viwo {
namespace {

constexpr std::uint64_t kSeeds = 50;

/// Metres until the goals are reached, and seconds.
struct Lengths {
  std::vector<double> metres, seconds;
};

/// By the information of the drives, for wheels of some noise.
void compare(const std::string& noise, const std::vector<std::string>& assignments) {
  const plan::PlanSetup setup = testing::swerve_plan(assignments);
  const plan::Plan plan = make_plan(setup);
  ASSERT_TRUE(plan.reached) << noise;
  std::cout << noise << ": plan " << plan.cost_m() << " m, " << plan.duration_s() << " s\n";
  for (const char* name : {"ICR sweep", "random"}) {
    Lengths lengths;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      const auto next =
          name[0] == 'I' ? testing::icr_sweep(setup, seed) : testing::random_driving(setup, seed);
      const testing::Driven driven = testing::drive_to_goals(setup, next);
      lengths.metres.push_back(driven.cost_m);
      lengths.seconds.push_back(driven.duration_s);
    }
    const auto [least, most] = std::minmax_element(lengths.metres.begin(), lengths.metres.end());
    std::cout << "  " << name << ": mean " << eval::mean(lengths.metres) << " m, "
              << eval::mean(lengths.metres) / plan.cost_m() << " x the plan's (" << *least << " to "
              << *most << " m); mean " << eval::mean(lengths.seconds) << " s\n";
    EXPECT_GT(eval::mean(lengths.metres), plan.cost_m()) << noise << ", " << name;
  }
}

TEST(Plan, IsShorterThanASweepAndRandomDrivingByTheirInformation) {
  compare("as configured", {});
  compare("wheels of the paper",
          {"kinematics.sigma_drive_rad_per_s=0.001", "kinematics.sigma_steer_rad=0.001",
           "kinematics.sigma_lateral_m_per_s=0.001"});
  compare("twice as noisy", {"wheel_noise_scale=2"});
}

/// Pieces one after the other, as if they had been planned.
plan::Plan as_plan(const plan::PlanSetup& setup, const std::vector<testing::Piece>& pieces) {
  plan::Plan out;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  for (const testing::Piece& piece : pieces) {
    out.pieces.push_back({piece, at, setup.model->prior_sigma()});
    at = compose(at, piece.end());
  }
  return out;
}

double metres_until(const plan::PlanSetup& setup, const plan::Plan& drive, double end_s) {
  constexpr double kStep_s = 0.01;
  const auto twist = twist_of(drive);
  double metres = 0.;
  for (double t_s = 0.; t_s < end_s; t_s += kStep_s) {
    const Twist xi = twist(t_s + 0.5 * kStep_s);
    metres += kStep_s * (xi.head<2>().norm() + setup.params.base_radius_m * std::abs(xi[2]));
  }
  return metres;
}

/// A drive that is simulated with noise and calibrated up to a time.
struct Calibrated {
  double sigma_over_goal = 0.;
  Eigen::VectorXd errors;  ///< in goals
};

class DriveOfSeed {
 public:
  DriveOfSeed(const plan::PlanSetup& setup, const plan::Plan& drive, std::uint64_t seed)
      : setup_(setup), drive_(drive), seed_(seed), folder_(testing::own_folder()) {
    write_plan(folder_, setup, drive);
  }
  Calibrated until(double end_s) const {
    auto driven = testing::driven(folder_ / "plan.csv", seed_, end_s);
    const auto estimate = testing::calibrated(driven);
    return {worst_goal(setup_.goals, estimate.sigma).ratio,
            testing::errors_in_goals(setup_, driven, estimate)};
  }
  /// Metres until the calibration's own sigmas reach the goals, to a few percent.
  double metres_to_goals() const {
    double least_s = 0., most_s = drive_.duration_s();
    for (int i = 0; i < 5; ++i) {
      const double middle_s = 0.5 * (least_s + most_s);
      (until(middle_s).sigma_over_goal <= 1. ? most_s : least_s) = middle_s;
    }
    return metres_until(setup_, drive_, 0.5 * (least_s + most_s));
  }

 private:
  const plan::PlanSetup& setup_;
  const plan::Plan& drive_;
  std::uint64_t seed_;
  std::filesystem::path folder_;
};

TEST(Plan, LeadsToCalibrationsOfFiftyRobotsThatAreAsGoodAsItSays) {
  const plan::PlanSetup setup = testing::swerve_plan();
  const plan::Plan plan = make_plan(setup);
  std::vector<double> ratios;
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(setup.goals.size()));
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Calibrated one = DriveOfSeed(setup, plan, seed).until(plan.duration_s());
    ratios.push_back(one.sigma_over_goal);
    squares += one.errors.cwiseAbs2() / static_cast<double>(kSeeds);
  }
  std::cout << "after the plan: worst sigma of the calibration over its goal, mean "
            << eval::mean(ratios) << ", most " << *std::max_element(ratios.begin(), ratios.end())
            << "; root mean square of error over goal";
  for (std::size_t i = 0; i < setup.goals.size(); ++i) {
    const plan::Goal& goal = setup.goals[i];
    const double rms = std::sqrt(squares[static_cast<Eigen::Index>(i)]);
    std::cout << " " << rms;
    // 99.9 % of a chi-square with 50 degrees of freedom is 1.73 times its mean.
    EXPECT_LT(rms, std::sqrt(1.73) * plan.pieces.back().sigma[goal.intrinsic] / goal.sigma);
  }
  std::cout << "\n";
}

TEST(Plan, IsShorterThanASweepAndRandomDrivingByTheirCalibrations) {
  const plan::PlanSetup setup = testing::swerve_plan();
  const plan::Plan plan = make_plan(setup);
  std::vector<double> of_plan;
  for (const char* name : {"plan, driven twice", "ICR sweep", "random"}) {
    std::vector<double> metres;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      std::vector<testing::Piece> pieces;
      if (name[0] == 'p') {
        for (int twice = 0; twice < 2; ++twice) {
          for (const plan::PlannedPiece& one : plan.pieces) pieces.push_back(one.piece);
        }
      } else {
        const auto next =
            name[0] == 'I' ? testing::icr_sweep(setup, seed) : testing::random_driving(setup, seed);
        Eigen::Vector3d at = Eigen::Vector3d::Zero();
        const double enough_m = (name[0] == 'I' ? 3. : 5.) * plan.cost_m();
        for (double metres_m = 0.; metres_m < enough_m; metres_m += pieces.back().cost_m) {
          pieces.push_back(next(at));
          at = compose(at, pieces.back().end());
        }
      }
      const plan::Plan drive = as_plan(setup, pieces);
      metres.push_back(DriveOfSeed(setup, drive, seed).metres_to_goals());
    }
    if (name[0] == 'p') of_plan = metres;
    const auto [least, most] = std::minmax_element(metres.begin(), metres.end());
    std::cout << name << ": " << eval::mean(metres) << " m (" << *least << " to " << *most << "), "
              << eval::mean(metres) / eval::mean(of_plan) << " x the plan's" << std::endl;
    if (name[0] != 'p') {
      EXPECT_GT(eval::mean(metres), eval::mean(of_plan)) << name;
    }
  }
}

}  // namespace
}  // namespace viwo

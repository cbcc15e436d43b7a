// How to drive for a calibration: the pieces of motion after which the intrinsics are known as well
// as goals ask, on as little path as possible. Equations: docs/math/plan.md.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "viwo/plan/pieces.hpp"
#include "viwo/plugin_host/registry.hpp"

namespace viwo::plan {

struct PlanParams : LimitParams, KnowledgeParams {
  std::string plan;
  double max_path_m = 100.;

  void bind(ParamBinder& b);
};

/// How well an intrinsic is to be known.
struct Goal {
  int intrinsic = 0;
  double sigma = 0.;  ///< in the unit of the intrinsic
};

/// A plan file, read.
struct PlanSetup {
  PlanParams params;
  Loaded<KinematicModel> kinematics;
  std::shared_ptr<const WheelModel> model;
  std::vector<Goal> goals;
  config::Mark goals_mark;
};

/// A piece of a plan.
struct PlannedPiece {
  Piece piece;
  Eigen::Vector3d start;  ///< [yaw, x, y] of O; the middle of the floor is the origin
  Intrinsics sigma;       ///< after it
};

struct Plan {
  std::vector<PlannedPiece> pieces;
  bool reached = false;  ///< all goals
  std::string why_not;

  double cost_m() const;
  double duration_s() const;
  double path_m() const;
};

/// The whole drive; zero before and after.
std::function<Twist(double t_s)> twist_of(const Plan& plan);

/// Reads a plan file with `--set` assignments. Throws InputError.
PlanSetup read_plan_setup(const std::filesystem::path& file,
                          const std::vector<std::string>& assignments, PluginRegistry& plugins);

/// Largest sigma over its goal, and of which intrinsic.
struct WorstGoal {
  double ratio = 0.;
  int intrinsic = 0;
};
WorstGoal worst_goal(const std::vector<Goal>& goals, const Intrinsics& sigma);

/// How far sigmas are above their goals: the sum of logarithms (PL-5).
double left_of(const std::vector<Goal>& goals, const Intrinsics& sigma);

/// Throws InputError for goals that no motion on this floor reaches, with what stays unknown.
Plan make_plan(const PlanSetup& setup);

/// What a plan leaves behind.
inline constexpr std::initializer_list<const char*> kResults = {"summary.json", "report.html",
                                                                "plan.csv", "plan.tum"};

/// Writes them.
void write_plan(const std::filesystem::path& folder, const PlanSetup& setup, const Plan& plan);

/// The table for the terminal.
std::string describe(const PlanSetup& setup, const Plan& plan);

}  // namespace viwo::plan

#include "viwo/plan/forecast.hpp"

#include <algorithm>
#include <utility>

#include "viwo/api/status.hpp"
#include "viwo/math/significant.hpp"

namespace viwo::plan {
namespace {

/// 0.0041 rad is 4.1 mrad.
std::string small(double value, const std::string& unit) {
  if (unit != "m" && unit != "rad") return significant(value, 3) + (unit.empty() ? "" : " " + unit);
  return significant(1e3 * value, 3) + " m" + unit;
}

/// Nobody measures it for a filter.
PlanSetup without_distance(PlanSetup setup) {
  setup.params.distance = false;
  return setup;
}

}  // namespace

std::string text_of(const Forecast& forecast) {
  if (forecast.is_enough()) {
    return "enough: all goals are reached, " + forecast.parameter + " as the last one (" +
           small(forecast.sigma, forecast.unit) + ")";
  }
  std::string text = forecast.parameter + ": " + small(forecast.sigma, forecast.unit) + " (goal " +
                     small(forecast.goal, forecast.unit) + "), ";
  if (forecast.piece.empty()) return text + "and no piece of the plan tells more";
  return text + small(forecast.sigma_after, forecast.unit) + " after another '" + forecast.piece +
         "' of " + significant(forecast.cost_m, 2) + " m";
}

Forecaster::Forecaster(PlanSetup setup)
    : setup_(without_distance(std::move(setup))),
      wheels_(setup_.model, setup_.params),
      pieces_(make_pieces(wheels_, setup_.params)) {}

Eigen::Index Forecaster::require(const std::string& intrinsic) const {
  const int found = setup_.model->find(intrinsic);
  if (found >= 0) return found;
  throw InputError("the plan is for another base: it has no intrinsic '" + intrinsic + "'");
}

Forecast Forecaster::of(std::span<const std::string> names, const Eigen::MatrixXd& P) {
  const auto& specs = setup_.model->description().intrinsics;
  const auto n = static_cast<Eigen::Index>(specs.size());
  std::vector<Eigen::Index> at;
  for (const std::string& name : names) at.push_back(require(name));
  Eigen::MatrixXd known = Eigen::MatrixXd::Zero(n, n);
  known(at, at) = P;
  wheels_.set_known(known);
  std::vector<Goal> goals;
  std::copy_if(setup_.goals.begin(), setup_.goals.end(), std::back_inserter(goals),
               [&](const Goal& goal) { return known(goal.intrinsic, goal.intrinsic) > 0.; });
  if (goals.empty()) throw InputError("none of the plan's goals is estimated by the filter");
  const Intrinsics now = wheels_.sigma(Information::zero(static_cast<int>(n)));
  const WorstGoal worst = worst_goal(goals, now);
  const IntrinsicSpec& spec = specs[static_cast<std::size_t>(worst.intrinsic)];
  Forecast out{spec.name, spec.unit, now[worst.intrinsic], now[worst.intrinsic] / worst.ratio,
               "",        0.,        now[worst.intrinsic]};
  double best = 0.;
  for (const Piece& piece : pieces_) {
    const Intrinsics after = wheels_.sigma(piece.information);
    const double gain = (left_of(goals, now) - left_of(goals, after)) / piece.cost_m;
    if (!(gain > best)) continue;
    best = gain;
    out.piece = piece.name;
    out.cost_m = piece.cost_m;
    out.sigma_after = after[worst.intrinsic];
  }
  return out;
}

}  // namespace viwo::plan

// What a plan leaves behind: plan.csv, plan.tum, summary.json, report.html, the table on the
// terminal.
#include <cmath>

#include <nlohmann/json.hpp>

#include "viwo/eval/json.hpp"
#include "viwo/files/files.hpp"
#include "viwo/files/text_writer.hpp"
#include "viwo/log/tum.hpp"
#include "viwo/math/se2.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/math/text_stream.hpp"
#include "viwo/plan/plan.hpp"
#include "viwo/report/document.hpp"
#include "viwo/report/html.hpp"
#include "viwo/sim/planar_motion.hpp"

namespace viwo::plan {
namespace {

using nlohmann::json;

constexpr double kRow_s = 0.01;

const IntrinsicSpec& spec_of(const PlanSetup& setup, int intrinsic) {
  return setup.model->description().intrinsics[static_cast<std::size_t>(intrinsic)];
}

/// "1.3 x its goal (r_1)"
std::string worst_text(const PlanSetup& setup, const Intrinsics& sigma) {
  const WorstGoal worst = worst_goal(setup.goals, sigma);
  return significant(worst.ratio, 3) + " (" + spec_of(setup, worst.intrinsic).name + ")";
}

std::string result_text(const PlanSetup& setup, const Plan& plan) {
  const std::string way = significant(plan.cost_m(), 3) + " m of the fastest point of the base (" +
                          significant(plan.path_m(), 3) + " m of O), " +
                          significant(plan.duration_s(), 3) + " s";
  if (plan.reached && plan.pieces.empty()) {
    return "nothing to drive: all goals are within the priors of the kinematics (the worst sigma "
           "is " +
           worst_text(setup, sigma_before(*setup.model)) + " x its goal)";
  }
  if (plan.reached) return "all goals are reached after " + way;
  const Intrinsics sigma =
      plan.pieces.empty() ? sigma_before(*setup.model) : plan.pieces.back().sigma;
  return "the goals are not reached: " + plan.why_not + "; after " + way +
         " the worst sigma is still " + worst_text(setup, sigma) + " x its goal";
}

void write_motion(const std::filesystem::path& folder, const Plan& plan) {
  const auto twist = twist_of(plan);
  sim::PoseIntegrator integrator(sim::PlanarMotion("plan", twist), 0.005);
  files::TextWriter table(folder / "plan.csv");
  table << "time_s,x_m,y_m,yaw_rad,v_x_m_per_s,v_y_m_per_s,omega_rad_per_s\n";
  Trajectory trajectory;
  const auto rows = static_cast<int>(std::ceil(plan.duration_s() / kRow_s));
  for (int k = 0; k <= rows; ++k) {
    const double t_s = k * kRow_s;
    const Eigen::Vector3d& g = integrator.advance_to(t_s);
    const Twist xi = k == rows ? Twist::Zero() : twist(t_s);
    table << t_s;
    for (const double value : {g[1], g[2], g[0], xi[0], xi[1], xi[2]}) table << "," << value;
    table << "\n";
    StampedPose& pose = trajectory.emplace_back();
    pose.t_ns = to_ns(t_s);
    pose.p_BinW = {g[1], g[2], 0.};
    pose.q_BtoW = Eigen::AngleAxisd(g[0], Eigen::Vector3d::UnitZ());
  }
  table.close();
  log::write_tum(folder / "plan.tum", trajectory);
}

json summary_of(const PlanSetup& setup, const Plan& plan) {
  json pieces = json::array();
  for (const PlannedPiece& one : plan.pieces) {
    const WorstGoal worst = worst_goal(setup.goals, one.sigma);
    pieces.push_back({{"name", one.piece.name},
                      {"cost_m", one.piece.cost_m},
                      {"path_m", one.piece.path_m},
                      {"duration_s", one.piece.duration_s},
                      {"start_yaw_rad_x_m_y_m", {one.start[0], one.start[1], one.start[2]}},
                      {"worst_over_goal", worst.ratio},
                      {"worst", spec_of(setup, worst.intrinsic).name}});
  }
  json goals = json::object();
  const Intrinsics before = sigma_before(*setup.model);
  for (const Goal& goal : setup.goals) {
    const IntrinsicSpec& spec = spec_of(setup, goal.intrinsic);
    const double sigma = (plan.pieces.empty() ? before : plan.pieces.back().sigma)[goal.intrinsic];
    goals[spec.name] = {{"unit", spec.unit},
                        {"goal", goal.sigma},
                        {"prior_sigma", before[goal.intrinsic]},
                        {"sigma", sigma}};
  }
  return {{"status", plan.reached ? "ok" : "failed"},
          {"cause", plan.why_not},
          {"name", setup.params.plan},
          {"model", setup.kinematics.info.name},
          {"cost_m", plan.cost_m()},
          {"path_m", plan.path_m()},
          {"duration_s", plan.duration_s()},
          {"pieces", pieces},
          {"goals", goals}};
}

report::Plot path_plot(const PlanSetup& setup, const Plan& plan) {
  report::Plot plot{"Seen from above", "x [m]", "y [m]"};
  plot.equal_axes = plot.half_width = true;
  const double x = 0.5 * setup.params.floor_x_m, y = 0.5 * setup.params.floor_y_m;
  report::Series floor{"floor", {-x, x, x, -x, -x}, {-y, -y, y, y, -y}};
  floor.reference = true;
  plot.series.push_back(floor);
  for (std::size_t k = 0; k < plan.pieces.size(); ++k) {
    const PlannedPiece& one = plan.pieces[k];
    report::Series series{std::to_string(k + 1) + ": " + one.piece.name, {}, {}};
    for (const Eigen::Vector3d& pose : one.piece.poses) {
      const Eigen::Vector3d at = compose(one.start, pose);
      series.x.push_back(at[1]);
      series.y.push_back(at[2]);
    }
    plot.series.push_back(std::move(series));
  }
  return plot;
}

report::Plot sigma_plot(const PlanSetup& setup, const Plan& plan) {
  report::Plot plot{"What is known when", "path of the fastest point [m]", "sigma / goal"};
  plot.log_y = plot.half_width = true;
  plot.lines.push_back({report::ReferenceLine::Direction::kHorizontal, 1., "goal"});
  const Intrinsics before = sigma_before(*setup.model);
  for (const Goal& goal : setup.goals) {
    const IntrinsicSpec& spec = spec_of(setup, goal.intrinsic);
    report::Series series{spec.name, {0.}, {before[goal.intrinsic] / goal.sigma}};
    series.draw = report::Draw::kLinesAndMarkers;
    for (const PlannedPiece& one : plan.pieces) {
      series.x.push_back(series.x.back() + one.piece.cost_m);
      series.y.push_back(one.sigma[goal.intrinsic] / goal.sigma);
    }
    plot.series.push_back(std::move(series));
  }
  return plot;
}

report::Document page_of(const PlanSetup& setup, const Plan& plan) {
  report::Table table;
  table.columns = {{"#"},        {"piece"},    {"path [m]"},
                   {"of O [m]"}, {"time [s]"}, {"worst sigma / goal"}};
  for (std::size_t k = 0; k < plan.pieces.size(); ++k) {
    const PlannedPiece& one = plan.pieces[k];
    table.rows.push_back({k + 1, one.piece.name, one.piece.cost_m, one.piece.path_m,
                          one.piece.duration_s, worst_text(setup, one.sigma)});
  }
  const auto tone =
      plan.reached ? report::Paragraph::Tone::kNormal : report::Paragraph::Tone::kWarning;
  return {setup.params.plan,
          "how to drive for a calibration of " + setup.kinematics.info.name,
          {{"Plan", {report::Paragraph{result_text(setup, plan), tone}, table}},
           {"Path", {path_plot(setup, plan), sigma_plot(setup, plan)}}}};
}

std::string pad(const std::string& text, std::size_t width) {
  return text + std::string(std::max(width, text.size() + 2) - text.size(), ' ');
}

}  // namespace

void write_plan(const std::filesystem::path& folder, const PlanSetup& setup, const Plan& plan) {
  files::NewResults out(folder);
  write_motion(out.folder(), plan);
  files::write_text(out.file("summary.json"), json_text(summary_of(setup, plan)));
  files::write_text(out.file("report.html"), report::to_html(page_of(setup, plan)));
  out.commit(kResults);
}

std::string describe(const PlanSetup& setup, const Plan& plan) {
  TextStream out;
  std::size_t width = 5;
  for (const PlannedPiece& one : plan.pieces) width = std::max(width, one.piece.name.size());
  width += 2;
  out << pad("#", 4) << pad("piece", width) << pad("path [m]", 10) << pad("time [s]", 10)
      << "worst sigma / goal\n";
  for (std::size_t k = 0; k < plan.pieces.size(); ++k) {
    const PlannedPiece& one = plan.pieces[k];
    out << pad(std::to_string(k + 1), 4) << pad(one.piece.name, width)
        << pad(significant(one.piece.cost_m, 3), 10)
        << pad(significant(one.piece.duration_s, 3), 10) << worst_text(setup, one.sigma) << "\n";
  }
  out << result_text(setup, plan) << "\n";
  return out.str();
}

}  // namespace viwo::plan

// Reading a plan file.
#include <charconv>
#include <cmath>

#include "viwo/config/file_kind.hpp"
#include "viwo/config/overrides.hpp"
#include "viwo/config/params.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/plan/plan.hpp"

namespace viwo::plan {
namespace {

using config::Node;

/// What intrinsics of several wheels have in common: "delta_o" of "delta_o3", "r" of "r_1".
std::string group_of(const std::string& name) {
  const std::size_t end = name.find_last_not_of("0123456789");
  if (end == std::string::npos || end + 1 == name.size()) return name;
  return name.substr(0, name[end] == '_' ? end : end + 1);
}

/// "1 %" of the nominal value, or a number in the unit of the parameter; NaN for what is neither.
double goal_sigma(const std::string& text, double nominal) {
  double value = 0.;
  const char* const end = text.data() + text.size();
  auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc()) return std::nan("");
  while (stop != end && *stop == ' ') ++stop;
  if (stop == end) return value;
  return std::string_view(stop, end) == "%" ? 0.01 * value * std::abs(nominal) : std::nan("");
}

void add_goals(const std::string& key, const Node& value, const WheelModel& model,
               std::vector<Goal>& goals, config::Errors& errors) {
  const auto& specs = model.description().intrinsics;
  std::vector<std::string> known;
  bool found = false;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    known.push_back(specs[i].name);
    known.push_back(group_of(specs[i].name));
    if (key != specs[i].name && key != group_of(specs[i].name)) continue;
    found = true;
    const double sigma =
        value.is_scalar() ? goal_sigma(value.scalar(), specs[i].nominal) : std::nan("");
    if (!std::isfinite(sigma) || !(sigma > 0.)) {
      errors.add(value.mark(), "goals." + key + " must be a sigma above 0 in " + specs[i].unit +
                                   ", or a part of the nominal value such as '1 %' (" +
                                   specs[i].name + ": " + significant(specs[i].nominal, 4) + ")");
      return;
    }
    if (specs[i].gauge_fixed) {
      if (key != specs[i].name) continue;
      errors.add(value.mark(), "goals." + key + ": it is held, to place O on the base");
      return;
    }
    goals.push_back({static_cast<int>(i), sigma});
  }
  if (found) return;
  std::sort(known.begin(), known.end());
  known.erase(std::unique(known.begin(), known.end()), known.end());
  errors.add(value.mark(),
             "goals: this base has no intrinsic '" + key + "'" + config::did_you_mean(key, known));
}

void read_goals(const Node& file, PlanSetup& setup, config::Errors& errors) {
  const Node* goals = file.find("goals");
  if (goals == nullptr || !goals->is_map() || goals->entries().empty()) {
    errors.add(goals != nullptr ? goals->mark() : file.mark(),
               "'goals' must say how well intrinsics are to be known, e.g. goals: {r: 1 %}");
    return;
  }
  setup.goals_mark = goals->mark();
  for (const auto& entry : goals->entries()) {
    add_goals(entry.key, entry.value, *setup.model, setup.goals, errors);
  }
}

/// Where a value is written, or should be.
const config::Mark& mark_of(const Node& file, const char* key) {
  const Node* const value = file.find(key);
  return value != nullptr ? value->mark() : file.mark();
}

void check_floor(const Node& file, const LimitParams& limits, config::Errors& errors) {
  for (const auto& [key, size_m] :
       {std::pair{"floor_x_m", limits.floor_x_m}, std::pair{"floor_y_m", limits.floor_y_m}}) {
    if (size_m > 2. * limits.base_radius_m) continue;
    errors.add(mark_of(file, key), std::string(key) + ": a floor of " + significant(size_m, 4) +
                                       " m has no room for a base of base_radius_m " +
                                       significant(limits.base_radius_m, 4));
  }
}

}  // namespace

void PlanParams::bind(ParamBinder& b) {
  b(VIWO_PARAM(plan), {.required = true, .help = "name of the plan"});
  LimitParams::bind(b);
  KnowledgeParams::bind(b);
  b(VIWO_PARAM(max_path_m),
    {.unit = "m", .above = 0., .max = 10000., .help = "longer plans are given up"});
}

PlanSetup read_plan_setup(const std::filesystem::path& path,
                          const std::vector<std::string>& assignments, PluginRegistry& plugins) {
  Node file = config::load_file(path);
  config::require_file_of("plan", file);
  config::apply(file, assignments);
  PlanSetup setup;
  config::Errors errors;
  constexpr std::string_view kSections[] = {"kinematics", "goals"};
  setup.params = config::read_section<PlanParams>(file, file.mark(), "plan", errors, kSections);
  const Node* section = file.find("kinematics");
  if (section == nullptr) {
    errors.add(file.mark(), "'kinematics' is missing: the section of the kinematic model");
    errors.throw_if_any();
  }
  setup.kinematics = plugins.make_kinematics(*section, "kinematics",
                                             instance_seed(1, "kinematics", "kinematics"), errors);
  errors.throw_if_any();
  setup.model = guarded(setup.kinematics.info, "describe", [&] {
    return std::make_shared<const WheelModel>(setup.kinematics.object);
  });
  check_floor(file, setup.params, errors);
  read_goals(file, setup, errors);
  errors.throw_if_any();
  return setup;
}

}  // namespace viwo::plan

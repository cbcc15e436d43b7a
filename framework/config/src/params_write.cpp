#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include "scalars.hpp"
#include "viwo/config/params.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/math/number_text.hpp"

namespace viwo::config {
namespace {

Node value_node(const ParamValue& value,
                const std::function<Node(const KinematicModel&)>& write_kinematics) {
  return std::visit(
      [&](const auto& v) {
        using T = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<T, bool>) {
          return Node::scalar_of(v ? "true" : "false");
        } else if constexpr (std::is_same_v<T, std::int64_t>) {
          return Node::scalar_of(std::to_string(v));
        } else if constexpr (std::is_same_v<T, double>) {
          return Node::scalar_of(number_text(v));
        } else if constexpr (std::is_same_v<T, std::string>) {
          return Node::scalar_of(v);
        } else if constexpr (std::is_same_v<T, const KinematicModel*>) {
          if (!write_kinematics) throw std::logic_error("no way to write a kinematic model here");
          return write_kinematics(*v);
        } else {
          Node list = Node::list_of();
          for (const auto& item : v) list.items().push_back(value_node(item, {}));
          return list;
        }
      },
      value);
}

const char* short_type_text(ParamType type) {
  switch (type) {
    case ParamType::kBool:
      return "true or false";
    case ParamType::kInt:
      return "integer";
    case ParamType::kNumber:
      return "number";
    case ParamType::kString:
      return "text";
    case ParamType::kPath:
      return "path";
    case ParamType::kNumbers:
      return "list of numbers";
    case ParamType::kStrings:
      return "list of texts";
    case ParamType::kKinematics:
      break;
  }
  return "kinematic model";
}

/// "required number, m, > 0, a or b: help".
std::string comment_text(const ParamSpec& spec) {
  std::string text = spec.required ? "required " : "";
  text += spec.size > 0 ? std::to_string(spec.size) + " numbers" : short_type_text(spec.type);
  if (!spec.unit.empty()) text += ", " + spec.unit;
  if (std::isfinite(spec.lowest())) {
    text += (spec.excludes_lowest() ? ", > " : ", >= ") + number_text(spec.lowest());
  }
  if (std::isfinite(spec.max)) text += ", <= " + number_text(spec.max);
  const char* before = ", ";
  for (const std::string& choice : choices_of(spec)) {
    text += std::exchange(before, " | ") + choice;
  }
  if (!spec.help.empty()) text += ": " + spec.help;
  return text;
}

/// The default as YAML; an empty text is a value here, nothing at all would read as "no value".
std::string fallback_text(const ParamSpec& spec) {
  if (spec.type == ParamType::kKinematics) return spec.fallback_section;
  const Node value = value_node(spec.fallback, {});
  if (value.is_scalar()) return value.scalar().empty() ? "\"\"" : value.scalar();
  std::string text;
  for (const Node& item : value.items()) text += (text.empty() ? "" : ", ") + item.scalar();
  return "[" + text + "]";
}

}  // namespace

Node value_node(const ParamValue& value) { return value_node(value, {}); }

Node write_params(std::span<const ParamSpec> specs, const ParamSet& params,
                  const std::function<Node(const KinematicModel&)>& write_kinematics) {
  Node section = Node::empty_map();
  for (const ParamSpec& spec : specs) {
    const auto value = params.find(spec.name);
    if (value == params.end()) {
      throw std::logic_error("write_params: no value for '" + spec.name + "'");
    }
    section.set(spec.name, value_node(value->second, write_kinematics));
  }
  return section;
}

std::string describe_params(std::span<const ParamSpec> specs) {
  std::vector<std::string> assignments;
  std::size_t width = 0;
  for (const ParamSpec& spec : specs) {
    std::string& line = assignments.emplace_back(spec.name);
    line += ':';
    if (!spec.required) line += ' ' + fallback_text(spec);
    width = std::max(width, line.size());
  }
  std::string text;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    assignments[i].resize(width, ' ');
    text += assignments[i] + "  # " + comment_text(specs[i]) + "\n";
  }
  return text;
}

}  // namespace viwo::config

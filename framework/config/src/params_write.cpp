#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include "scalars.hpp"
#include "viwo/config/params.hpp"
#include "viwo/config/yaml.hpp"

namespace viwo::config {
namespace {

Node value_node(const ParamSet::Value& value,
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
  std::string text = spec.fallback == nullptr ? "required " : "";
  text += short_type_text(spec.type);
  if (spec.unit[0] != '\0') text += std::string(", ") + spec.unit;
  if (std::isfinite(spec.min)) {
    text += (spec.min_exclusive ? ", > " : ", >= ") + number_text(spec.min);
  }
  if (std::isfinite(spec.max)) text += ", <= " + number_text(spec.max);
  if (spec.choices[0] != '\0') {
    std::string choices = spec.choices;
    for (std::size_t bar = 0; (bar = choices.find('|', bar)) != std::string::npos;) {
      choices.replace(bar, 1, " | ");
      bar += 3;
    }
    text += ", " + choices;
  }
  if (spec.help[0] != '\0') text += std::string(": ") + spec.help;
  return text;
}

}  // namespace

Node write_params(std::span<const ParamSpec> specs, const ParamSet& params,
                  const std::function<Node(const KinematicModel&)>& write_kinematics) {
  Node section = Node::empty_map();
  for (const ParamSpec& spec : specs) {
    const auto value = params.values().find(spec.name);
    if (value == params.values().end()) {
      throw std::logic_error("write_params: no value for '" + std::string(spec.name) + "'");
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
    if (spec.fallback != nullptr) {
      // An empty text is a value here, nothing at all would read as "no value".
      line += ' ';
      line += std::string_view(spec.fallback).empty() ? "\"\"" : spec.fallback;
    }
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

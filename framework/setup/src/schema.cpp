#include "viwo/setup/schema.hpp"

#include <cmath>
#include <type_traits>
#include <variant>

#include "section_params.hpp"
#include "viwo/config/params.hpp"

namespace viwo {
namespace {

using nlohmann::json;

json default_of(const ParamSpec& spec) {
  return std::visit(
      [](const auto& value) -> json {
        if constexpr (std::is_same_v<std::decay_t<decltype(value)>, const KinematicModel*>) {
          return nullptr;
        } else {
          return value;
        }
      },
      spec.fallback);
}

void add_bounds(const ParamSpec& spec, json& out) {
  if (std::isfinite(spec.lowest())) {
    out[spec.excludes_lowest() ? "exclusiveMinimum" : "minimum"] = spec.lowest();
  }
  if (std::isfinite(spec.max)) out["maximum"] = spec.max;
}

json text_of(const ParamSpec& spec) {
  json out{{"type", "string"}};
  if (!spec.choices.empty()) out["enum"] = config::choices_of(spec);
  return out;
}

/// A single value stands for a list of one.
json list_of(const json& item, int size) {
  json list{{"type", "array"}, {"items", item}};
  if (size == 0) return {{"anyOf", {item, list}}};
  list["minItems"] = list["maxItems"] = size;
  return list;
}

json type_of(const ParamSpec& spec) {
  json number{{"type", spec.type == ParamType::kInt ? "integer" : "number"}};
  add_bounds(spec, number);
  switch (spec.type) {
    case ParamType::kBool:
      return {{"type", "boolean"}};
    case ParamType::kInt:
    case ParamType::kNumber:
      return number;
    case ParamType::kString:
      return text_of(spec);
    case ParamType::kPath:
      return {{"type", "string"}};
    case ParamType::kNumbers:
      return list_of(number, spec.size);
    case ParamType::kStrings:
      return list_of(text_of(spec), 0);
    case ParamType::kKinematics:
      return {{"$ref", "#/$defs/kinematics"}};
  }
  return json::object();
}

/// A section with these keys and no others.
json section_of(const std::vector<ParamSpec>& specs) {
  json properties = json::object(), required = json::array();
  for (const ParamSpec& spec : specs) {
    // A value may be left to the recording: "{motion}".
    json property{{"anyOf", {type_of(spec), {{"$ref", "#/$defs/placeholder"}}}}};
    const std::string unit = spec.unit.empty() ? "" : " [" + spec.unit + "]";
    property["description"] = spec.help + unit;
    if (spec.required) {
      required.push_back(spec.name);
    } else if (spec.type != ParamType::kKinematics) {
      property["default"] = default_of(spec);
    }
    properties[spec.name] = std::move(property);
  }
  return {{"type", "object"},
          {"properties", std::move(properties)},
          {"required", std::move(required)},
          {"additionalProperties", false}};
}

/// The sections of all plugins of one kind, by their `type`; `host_keys`: what the host reads
/// there.
json plugins_of(const std::vector<PluginInfo>& plugins, const std::string& kind,
                const json& host_keys) {
  json names = json::array(), branches = json::array();
  for (const PluginInfo& info : plugins) {
    if (info.kind != kind) continue;
    json section = section_of({info.params.begin(), info.params.end()});
    section["properties"].update(host_keys);
    section["properties"]["type"] = {{"const", info.name}, {"description", info.summary}};
    names.push_back(info.name);
    branches.push_back({{"if", {{"properties", {{"type", {{"const", info.name}}}}}}},
                        {"then", std::move(section)}});
  }
  return {{"type", "object"},
          {"properties", {{"type", {{"enum", std::move(names)}}}}},
          {"required", {"type"}},
          {"allOf", std::move(branches)}};
}

/// A section NAME: {...} whose entries are all alike.
json named(const json& entry) { return {{"type", "object"}, {"additionalProperties", entry}}; }

/// An update is named by its `type`, or by its key where it has none.
json updates_of(const std::vector<PluginInfo>& plugins, const json& host_keys) {
  const json by_type{{"$ref", "#/$defs/update"}};
  json properties = json::object();
  for (const PluginInfo& info : plugins) {
    if (info.kind != "update") continue;
    json section = section_of({info.params.begin(), info.params.end()});
    section["properties"].update(host_keys);
    section["type"] = {"object", "null"};
    properties[info.name] = {{"description", info.summary},
                             {"if", {{"type", "object"}, {"required", {"type"}}}},
                             {"then", by_type},
                             {"else", std::move(section)}};
  }
  return {
      {"type", "object"}, {"properties", std::move(properties)}, {"additionalProperties", by_type}};
}

}  // namespace

std::vector<HostSection> host_sections() {
  return {{"run", "the run as a whole", param_specs<RunParams>()},
          {"odometry", "wheels alone, without a filter", param_specs<OdometryParams>()},
          {"evaluation", "how the estimate is compared with the reference",
           param_specs<EvaluationParams>()},
          {"estimator", "the filter", param_specs<EstimatorParams>()},
          {"imu", "the IMU of the filter", param_specs<ImuParams>()},
          {"cameras", "the cameras of the filter", param_specs<CamerasParams>()},
          {"wheels", "where the wheels are on the body of the IMU", param_specs<WheelsParams>()}};
}

json run_schema(const std::vector<PluginInfo>& plugins) {
  json out = section_of(param_specs<RunParams>());
  json& properties = out["properties"];
  for (const HostSection& section : host_sections()) {
    if (section.name == "run") continue;
    json own = section_of(section.params);
    own["type"] = {"object", "null"};
    own["description"] = section.summary;
    properties[section.name] = std::move(own);
  }
  const json kinematics{{"$ref", "#/$defs/kinematics"}};
  properties["kinematics"] = kinematics;
  properties["sensors"] = named({{"$ref", "#/$defs/sensor"}});
  const json update_keys{{"enabled", {{"type", "boolean"}, {"default", true}}},
                         {"sensor", {{"type", "string"}}}};
  properties["updates"] = updates_of(plugins, update_keys);
  properties["wheel_sets"] =
      named({{"type", "object"},
             {"properties", {{"kinematics", kinematics}, {"wheels", properties["wheels"]}}},
             {"required", {"kinematics"}},
             {"additionalProperties", false}});
  properties["placeholders"] = {{"type", "object"}};
  out["$schema"] = "https://json-schema.org/draft/2020-12/schema";
  out["title"] = "viwo run";
  out["$defs"] = {
      {"placeholder", {{"type", "string"}, {"pattern", "\\{\\w+\\}"}}},
      {"update", plugins_of(plugins, "update", update_keys)},
      {"kinematics",
       plugins_of(plugins, "kinematics",
                  {{"calibration",
                    {{"type", "string"}, {"description", "a calibration.yaml to start from"}}}})},
      {"sensor",
       plugins_of(plugins, "sensor",
                  {{"input", {{"type", "string"}, {"description", "the sensor it works on"}}}})}};
  return out;
}

}  // namespace viwo

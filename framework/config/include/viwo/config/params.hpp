// Checks a section of a configuration against a table of parameters (viwo/api/params.hpp).
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "viwo/api/params.hpp"
#include "viwo/api/status.hpp"
#include "viwo/config/errors.hpp"
#include "viwo/config/node.hpp"

namespace viwo::config {

/// What the reader needs from its caller.
struct ReadContext {
  /// Builds the nested model of a kKinematics parameter from its section at `path`; nullptr with
  /// entries in Errors if that fails. Whoever makes the model owns it. Needed only for tables that
  /// have such a parameter.
  std::function<const KinematicModel*(const Node& section, const std::string& path, Errors&)>
      make_kinematics;
};

/// Reads the parameters in `specs` from a section (a map, or null for "all defaults").
///
/// `where` is the position for what is missing. `what` names the section in messages: its path, or
/// "path (type)". Keys in `other_keys` are left to the caller; every other key that is not in the
/// table is an error. Paths become absolute: relative ones are relative to the folder of the file
/// in which the value is written, or to the current folder if it does not come from a file.
///
/// All that is wrong goes into `errors`; then the set is incomplete and must not be used. Throws
/// std::logic_error when the table itself is wrong, e.g. a fallback that violates its own bounds.
ParamSet read_params(const Node& map, const Mark& where, std::string_view what,
                     std::span<const ParamSpec> specs, std::span<const std::string_view> other_keys,
                     const ReadContext& context, Errors& errors);

/// The texts that a parameter may be; none: any.
std::vector<std::string> choices_of(const ParamSpec& spec);

/// Throws std::logic_error when a table is wrong: a name missing or twice, a default that its own
/// row refuses (kKinematics: that is not a section).
void check_specs(std::span<const ParamSpec> specs);

/// A value that is no nested model.
Node value_node(const ParamValue& value);

/// Writes checked values back: a section that read_params accepts and that gives the same values.
/// `write_kinematics` gives the section of a nested model.
Node write_params(std::span<const ParamSpec> specs, const ParamSet& params,
                  const std::function<Node(const KinematicModel&)>& write_kinematics = {});

/// The section as a structure with bind() (viwo/api/params.hpp); its defaults when something in it
/// is wrong, which then is in `errors`.
template <class T>
T read_section(const Node& map, const Mark& where, std::string_view what, Errors& errors,
               std::span<const std::string_view> other_keys = {}) {
  const std::size_t before = errors.size();
  const ParamSet values = read_params(map, where, what, param_specs<T>(), other_keys, {}, errors);
  if (errors.size() > before) return {};
  try {
    return params_from<T>(values);
  } catch (const ParamError& error) {
    const Node* const value = map.find(error.key());
    errors.add(
        value != nullptr ? value->mark() : where,
        std::string(what.substr(0, what.find(" ("))) + "." + error.key() + ": " + error.what());
    return {};
  }
}

/// A section that read_section reads back.
template <class T>
Node write_section(const T& section) {
  Node out = Node::empty_map();
  for (const ParamSpec& spec : param_specs(section)) out.set(spec.name, value_node(spec.fallback));
  return out;
}

/// A YAML template of a section: "key: default  # unit, bounds, choices: help", one line per
/// parameter; required ones have no value.
std::string describe_params(std::span<const ParamSpec> specs);

}  // namespace viwo::config

// Changing a configuration: command line assignments, variants of an experiment, placeholders.
#pragma once

#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>

#include "viwo/config/node.hpp"

namespace viwo::config {

/// Puts `value` at a dotted path below `root`, replacing what is there; sections that are missing
/// are created. A component into a list is an index of an existing element. Throws viwo::InputError
/// when the path leads through a single value or past the end of a list. New keys get `key_mark`.
void set_path(Node& root, std::string_view path, const Node& value, const Mark& key_mark);

/// The same; new keys get the position of the value.
void set_path(Node& root, std::string_view path, const Node& value);

/// Applies a map of overrides: a key may be a dotted path, a map is merged into the map it meets,
/// everything else replaces. A map with the key `type` replaces, too: it is a complete section.
/// Throws viwo::InputError like set_path, and if `overrides` is neither a map nor null.
void merge(Node& base, const Node& overrides);

/// What "path.to.key=VALUE" says.
struct Assignment {
  std::string path;
  Node value;
};

/// Reads the argument of --set; VALUE is YAML. All positions are "--set path.to.key". Throws
/// viwo::InputError.
Assignment parse_assignment(std::string_view text);

/// Carries out arguments of --set, in order. Throws viwo::InputError.
void apply(Node& root, std::span<const std::string> assignments);

/// Adds the name of every {name} in the scalars below `node` to `names`.
void find_placeholders(const Node& node, std::set<std::string>& names);

/// Replaces {name} in all scalars below `node` by its value. Names are identifiers; other braces
/// stay. An unknown name is an error at the scalar.
void substitute(Node& node, const std::map<std::string, std::string>& values, Errors& errors);

}  // namespace viwo::config

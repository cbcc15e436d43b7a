// YAML text to Node and back.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "viwo/config/node.hpp"

namespace viwo::config {

/// No YAML that is read is larger.
inline constexpr std::size_t kMaxYamlBytes = std::size_t{1} << 20;

/// Reads one YAML document. Anchors, aliases and merge keys are expanded. Throws viwo::InputError
/// with file:line:column for syntax errors, duplicate keys, keys that are not text, values that
/// contain themselves, and for what is nested deeper than 100 or has more than 100000 values, those
/// included that aliases stand for; with the file for one that is missing, cannot be read, is too
/// large, or is none (a pipe, a device).
Node load_file(const std::filesystem::path& file);

/// The same for a text; `origin` stands for the file in positions.
Node parse(std::string_view text, const std::string& origin);

/// YAML that parses back to the same tree. Lists of scalars are written on one line. `comments`:
/// behind the values at these dotted paths.
std::string to_yaml(const Node& node, const std::map<std::string, std::string>& comments = {});

}  // namespace viwo::config

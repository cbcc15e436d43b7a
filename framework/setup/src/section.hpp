// Sections of a configuration, and the names in them.
#pragma once

#include <optional>
#include <string>

#include "viwo/config/errors.hpp"
#include "viwo/config/node.hpp"
#include "viwo/config/params.hpp"

namespace viwo {

/// The section `key`, or an empty one at the position of the whole.
inline config::Node section_or_empty(const config::Node& parent, const char* key) {
  const config::Node* section = parent.find(key);
  return section != nullptr ? *section : config::Node::empty_map(parent.mark());
}

/// A section, and resolved; nothing if something in it is wrong.
template <class T>
std::optional<T> read_section(const config::Node& section, const std::string& path,
                              config::Node& resolved, config::Errors& errors) {
  const std::size_t before = errors.size();
  const T params = config::read_section<T>(section, section.mark(), path, errors);
  if (errors.size() > before) return std::nullopt;
  resolved = config::write_section(params);
  return params;
}

/// Whether `entry` of `section` has a name that can be told in results and in --set.
inline bool is_name(const config::Node::Entry& entry, const char* section, config::Errors& errors) {
  if (entry.key.find('.') == std::string::npos) return true;
  errors.add(entry.key_mark, std::string(section) + ": the name '" + entry.key +
                                 "' has a dot, which separates the parts of a key");
  return false;
}

}  // namespace viwo

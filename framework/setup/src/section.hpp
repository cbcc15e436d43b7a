// Sections of a configuration that may be left out.
#pragma once

#include "viwo/config/node.hpp"

namespace viwo {

/// The section `key`, or an empty one at the position of the whole.
inline config::Node section_or_empty(const config::Node& parent, const char* key) {
  const config::Node* section = parent.find(key);
  return section != nullptr ? *section : config::Node::empty_map(parent.mark());
}

}  // namespace viwo

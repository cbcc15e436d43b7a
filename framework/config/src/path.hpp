// Dotted paths into a tree.
#pragma once

#include <charconv>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace viwo::config {

/// Splits the first component off `path`.
inline std::string_view take_component(std::string_view& path) {
  const std::size_t dot = path.find('.');
  const std::string_view component = path.substr(0, dot);
  path = dot == std::string_view::npos ? std::string_view{} : path.substr(dot + 1);
  return component;
}

/// `path` and a component behind it.
inline std::string join(std::string_view path, std::string_view component) {
  return path.empty() ? std::string(component) : std::string(path) + "." + std::string(component);
}

/// A component as the index of a list element, if it is one.
inline std::optional<std::size_t> list_index(std::string_view component) {
  std::size_t index = 0;
  const char* end = component.data() + component.size();
  const auto result = std::from_chars(component.data(), end, index);
  if (result.ec != std::errc{} || result.ptr != end) return std::nullopt;
  return index;
}

}  // namespace viwo::config

#include "dds_names.hpp"

#include <regex>

namespace viwo::ros2 {
namespace {

constexpr std::string_view kTopicPrefix = "rt/";
constexpr std::string_view kTypeMiddle = "::msg::dds_::";

}  // namespace

std::string why_no_name(const std::string& topic) {
  static const std::regex form("/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*");
  if (topic.empty()) return "it is empty";
  if (std::regex_match(topic, form)) return {};
  return "it must be of letters, digits and _, in parts separated by /, none of which begins with "
         "a digit";
}

std::string dds_topic(const std::string& topic) {
  return (topic.starts_with('/') ? "rt" : "rt/") + topic;
}

std::optional<std::string> ros_topic(std::string_view topic) {
  if (!topic.starts_with(kTopicPrefix)) return std::nullopt;
  return std::string(topic.substr(kTopicPrefix.size() - 1));
}

std::string dds_type(std::string_view type) {
  const std::size_t slash = type.find('/');
  return std::string(type.substr(0, slash)) + std::string(kTypeMiddle) +
         std::string(type.substr(slash + 1)) + "_";
}

std::string ros_type(std::string_view type) {
  const std::size_t middle = type.find(kTypeMiddle);
  if (middle == std::string_view::npos || !type.ends_with('_')) return std::string(type);
  const std::string_view name = type.substr(middle + kTypeMiddle.size());
  return std::string(type.substr(0, middle)) + "/" + std::string(name.substr(0, name.size() - 1));
}

}  // namespace viwo::ros2

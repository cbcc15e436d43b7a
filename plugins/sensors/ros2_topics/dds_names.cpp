#include "dds_names.hpp"

#include <algorithm>
#include <array>
#include <regex>

namespace viwo::ros2 {
namespace {

constexpr std::string_view kTopicPrefix = "rt/";
constexpr std::string_view kTypeMiddle = "::msg::dds_::";

struct TypeHash {
  std::string_view type;
  std::string_view sha256;
};

// Checked by tests/live/ros2/test_type_hashes.py, which makes them of the definitions.
constexpr std::array kTypeHashes{
    TypeHash{"diagnostic_msgs/DiagnosticArray",
             "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"},
    TypeHash{"geometry_msgs/PoseStamped",
             "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"},
    TypeHash{"geometry_msgs/PoseWithCovarianceStamped",
             "26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e"},
    TypeHash{"nav_msgs/Odometry",
             "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"},
    TypeHash{"nav_msgs/Path", "1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b"},
    TypeHash{"sensor_msgs/CompressedImage",
             "15640771531571185e2efc8a100baf923961a4d15d5569652e6cb6691e8e371a"},
    TypeHash{"sensor_msgs/Image",
             "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"},
    TypeHash{"sensor_msgs/Imu", "7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b"},
    TypeHash{"sensor_msgs/JointState",
             "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"},
    TypeHash{"sensor_msgs/NavSatFix",
             "62223ab3fe210a15976021da7afddc9e200dc9ec75231c1b6a557fc598a65404"},
    TypeHash{"std_msgs/String", "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"},
    TypeHash{"tf2_msgs/TFMessage",
             "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"}};

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

std::string said_of_type(std::string_view type) {
  const auto* const known = std::find_if(kTypeHashes.begin(), kTypeHashes.end(),
                                         [type](const TypeHash& one) { return one.type == type; });
  if (known == kTypeHashes.end()) return {};
  return "typehash=RIHS01_" + std::string(known->sha256) + ";";
}

}  // namespace viwo::ros2

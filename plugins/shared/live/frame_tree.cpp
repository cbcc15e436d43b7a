#include "frame_tree.hpp"

#include <algorithm>
#include <cmath>
#include <locale>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

#include <Eigen/Geometry>

#include "viwo/log/text.hpp"
#include "viwo/math/rpy.hpp"

#if VIWO_HAS_TINYXML2
#include <tinyxml2.h>
#endif

namespace viwo::live {
namespace {

constexpr std::size_t kLongestName = 256;
constexpr double kFarthest_m = 1e6;

#if VIWO_HAS_TINYXML2
/// Three numbers, or none where nothing is said (null).
std::optional<Eigen::Vector3d> three_numbers(const char* text) {
  if (text == nullptr) return Eigen::Vector3d::Zero();
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  Eigen::Vector3d v;
  std::string rest;
  if (!(in >> v[0] >> v[1] >> v[2]) || in >> rest || !v.allFinite()) return std::nullopt;
  return v;
}

std::string attribute(const tinyxml2::XMLElement& joint, const char* child, const char* name) {
  const tinyxml2::XMLElement* const element = joint.FirstChildElement(child);
  const char* const text = element != nullptr ? element->Attribute(name) : nullptr;
  return text != nullptr ? text : "";
}
#endif

}  // namespace

std::string plain_name(std::string_view name) {
  return std::string(name.substr(name.starts_with('/') ? 1 : 0));
}

std::string FrameTree::put(const std::string& child, const Fixed& fixed) {
  if (fixed.parent.empty() || child.empty()) return "a transform of a frame without a name";
  if (fixed.parent.size() > kLongestName || child.size() > kLongestName) {
    return "a name of a frame that is longer than 256 bytes";
  }
  if (fixed.parent == child) return "a transform of frame " + log::quoted(child) + " to itself";
  if (!fixed.pose.R_AtoB.allFinite() || !(fixed.pose.p_AinB.norm() < kFarthest_m)) {
    return "a transform of frame " + log::quoted(child) +
           " that is none (numbers, or norm of the quaternion)";
  }
  const auto known = fixed_.find(child);
  if (known == fixed_.end() && fixed_.size() >= kMost) {
    return "more frames than a robot has (1000)";
  }
  // What /tf_static says is what the robot runs with.
  if (known != fixed_.end() && fixed.is_of_urdf && !known->second.is_of_urdf) return "";
  fixed_[child] = fixed;
  return "";
}

void FrameTree::merge(const FrameTree& other) {
  for (const auto& [child, fixed] : other.fixed_) put(child, fixed);
}

std::string FrameTree::add(const bag::Transform& transform) {
  const Eigen::Quaterniond q(Eigen::Map<const Eigen::Vector4d>(transform.q_xyzw.data()));
  const bool is_turn = std::abs(q.norm() - 1.) < 1e-2;
  const Eigen::Matrix3d R =
      is_turn ? q.normalized().toRotationMatrix() : Eigen::Matrix3d::Constant(NAN);
  return put(plain_name(transform.child),
             {plain_name(transform.parent), {R, Eigen::Vector3d(transform.p_m.data())}});
}

std::string FrameTree::add_urdf(const std::string& xml) {
#if VIWO_HAS_TINYXML2
  tinyxml2::XMLDocument document;
  if (document.Parse(xml.data(), xml.size()) != tinyxml2::XML_SUCCESS) {
    return "the robot's description is no XML: " + log::printable(document.ErrorStr());
  }
  const tinyxml2::XMLElement* const robot = document.FirstChildElement("robot");
  if (robot == nullptr) return "the robot's description has no element 'robot'";
  std::string unused;
  for (const auto* joint = robot->FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    const char* const type = joint->Attribute("type");
    if (type == nullptr || std::string_view(type) != "fixed") continue;
    const auto* const origin = joint->FirstChildElement("origin");
    const auto p = three_numbers(origin != nullptr ? origin->Attribute("xyz") : nullptr);
    const auto rpy = three_numbers(origin != nullptr ? origin->Attribute("rpy") : nullptr);
    const std::string child = plain_name(attribute(*joint, "child", "link"));
    const std::string parent = plain_name(attribute(*joint, "parent", "link"));
    std::string why = "its origin is not of three numbers each";
    if (p && rpy) why = put(child, {parent, {rotation_of_rpy(*rpy), *p}, true});
    if (!why.empty()) {
      unused = "the robot's description, fixed joint of " + log::quoted(child) + ": " + why;
    }
  }
  return unused;
#else
  (void)xml;
  return "this build reads no description of a robot (libtinyxml2-dev)";
#endif
}

std::vector<std::pair<std::string, FramePose>> FrameTree::up_from(const std::string& name) const {
  std::vector<std::pair<std::string, FramePose>> way{{name, {}}};
  std::set<std::string> seen{name};
  for (auto next = fixed_.find(name);
       next != fixed_.end() && seen.insert(next->second.parent).second;
       next = fixed_.find(way.back().first)) {
    const FramePose& step = next->second.pose;
    const FramePose& here = way.back().second;
    way.push_back({next->second.parent,
                   {step.R_AtoB * here.R_AtoB, step.R_AtoB * here.p_AinB + step.p_AinB}});
  }
  return way;
}

std::optional<FramePose> FrameTree::find(const std::string& a, const std::string& b) const {
  const auto from_a = up_from(plain_name(a)), from_b = up_from(plain_name(b));
  for (const auto& [name, a_there] : from_a) {
    const auto common = std::find_if(from_b.begin(), from_b.end(),
                                     [&name = name](const auto& up) { return up.first == name; });
    if (common == from_b.end()) continue;
    const FramePose& b_there = common->second;
    const Eigen::Matrix3d back = b_there.R_AtoB.transpose();
    return FramePose{back * a_there.R_AtoB, back * (a_there.p_AinB - b_there.p_AinB)};
  }
  return std::nullopt;
}

std::vector<std::string> FrameTree::names() const {
  std::set<std::string> names;
  for (const auto& [child, fixed] : fixed_) {
    names.insert(child);
    names.insert(fixed.parent);
  }
  return {names.begin(), names.end()};
}

}  // namespace viwo::live

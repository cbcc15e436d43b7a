#include "frame_tree.hpp"

#include <algorithm>
#include <cmath>
#include <locale>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

#include <Eigen/Geometry>

#if VIWO_HAS_TINYXML2
#include <tinyxml2.h>
#endif

namespace viwo::live {
namespace {

constexpr const char* kTooMany = "more frames than a robot has (1000)";

std::string plain(std::string_view name) {
  return std::string(name.substr(name.starts_with('/') ? 1 : 0));
}

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

Eigen::Matrix3d rotation_of_rpy(const Eigen::Vector3d& rpy_rad) {
  return (Eigen::AngleAxisd(rpy_rad.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(rpy_rad.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy_rad.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

std::string FrameTree::add(const bag::Transform& transform) {
  const std::string parent = plain(transform.parent), child = plain(transform.child);
  if (parent.empty() || child.empty()) return "a transform of a frame without a name";
  if (parent == child) return "a transform of frame '" + child + "' to itself";
  const Eigen::Quaterniond q(Eigen::Map<const Eigen::Vector4d>(transform.q_xyzw.data()));
  const Eigen::Vector3d p(transform.p_m.data());
  if (!p.allFinite() || !(std::abs(q.norm() - 1.) < 1e-2)) {
    return "a transform of frame '" + child + "' that is none (numbers, or norm of the quaternion)";
  }
  if (is_full_for(child)) return kTooMany;
  fixed_[child] = {parent, {q.normalized().toRotationMatrix(), p}};
  return "";
}

std::string FrameTree::add_urdf(const std::string& xml) {
#if VIWO_HAS_TINYXML2
  tinyxml2::XMLDocument document;
  if (document.Parse(xml.data(), xml.size()) != tinyxml2::XML_SUCCESS) {
    return std::string("the robot's description is no XML: ") + document.ErrorStr();
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
    const std::string parent = plain(attribute(*joint, "parent", "link"));
    const std::string child = plain(attribute(*joint, "child", "link"));
    if (!p || !rpy || parent.empty() || child.empty() || parent == child) {
      unused = "a fixed joint of the robot's description, of '" + child + "', is none";
      continue;
    }
    if (is_full_for(child)) return kTooMany;
    // What /tf_static says is what the robot runs with.
    fixed_.try_emplace(child, Fixed{parent, {rotation_of_rpy(*rpy), *p}});
  }
  return unused;
#else
  (void)xml;
  return "this build reads no description of a robot (libtinyxml2-dev)";
#endif
}

bool FrameTree::is_full_for(const std::string& child) const {
  return fixed_.size() >= kMost && fixed_.find(child) == fixed_.end();
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
  const auto from_a = up_from(plain(a)), from_b = up_from(plain(b));
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

#include "ros2_messages.hpp"

#include <cstdint>

#include "cdr_message.hpp"

namespace viwo::ros2 {
namespace {

using bag::CdrMessage;

bag::Bytes bytes_of(CdrMessage& message) {
  const auto all = message.bytes();
  return {all.begin(), all.end()};
}

}  // namespace

bag::Bytes odometry_message(const live::Odometry& odometry) {
  CdrMessage message;
  message.header(odometry.pose.t_ns, odometry.world)
      << odometry.body << odometry.pose.p_BinG_m << odometry.pose.q_BtoG_xyzw
      << odometry.pose_covariance << odometry.v_BinB_m_per_s << odometry.w_BinB_rad_per_s
      << odometry.twist_covariance;
  return bytes_of(message);
}

bag::Bytes tf_message(const live::Odometry& odometry) {
  CdrMessage message;
  message << std::uint32_t{1};
  message.header(odometry.pose.t_ns, odometry.world)
      << odometry.body << odometry.pose.p_BinG_m << odometry.pose.q_BtoG_xyzw;
  return bytes_of(message);
}

bag::Bytes path_message(const live::Path& path, const std::string& world) {
  CdrMessage message;
  message.header(path.poses().empty() ? 0 : path.poses().back().t_ns, world)
      << static_cast<std::uint32_t>(path.poses().size());
  for (const live::Pose& pose : path.poses()) {
    message.header(pose.t_ns, world) << pose.p_BinG_m << pose.q_BtoG_xyzw;
  }
  return bytes_of(message);
}

bag::Bytes diagnostics_message(const live::Diagnostics& diagnostics) {
  constexpr std::uint8_t kOk = 0, kWarn = 1;  // of the message's definition
  CdrMessage message;
  message.header(diagnostics.t_ns, "") << std::uint32_t{1};
  message << (diagnostics.warns ? kWarn : kOk) << std::string(live::Diagnostics::kName)
          << diagnostics.message << std::string(live::Diagnostics::kHardware)
          << static_cast<std::uint32_t>(diagnostics.values.size());
  for (const auto& [key, value] : diagnostics.values) message << key << value;
  return bytes_of(message);
}

}  // namespace viwo::ros2

#include "ros2_messages.hpp"

#include <array>
#include <cstdint>
#include <vector>

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
  constexpr std::uint8_t kOk = 0, kWarn = 1, kError = 2;  // of the message's definition
  CdrMessage message;
  message.header(diagnostics.t_ns, "") << std::uint32_t{1};
  message << (diagnostics.fails   ? kError
              : diagnostics.warns ? kWarn
                                  : kOk)
          << std::string(live::Diagnostics::kName) << diagnostics.message
          << std::string(live::Diagnostics::kHardware)
          << static_cast<std::uint32_t>(diagnostics.values.size());
  for (const auto& [key, value] : diagnostics.values) message << key << value;
  return bytes_of(message);
}

bag::Bytes calibration_message(const EstimateSample& estimate) {
  CdrMessage message;
  message.header(estimate.t_ns, "") << estimate.calibration_names << estimate.calibration
                                    << std::vector<double>{} << estimate.calibration_sigma;
  return bytes_of(message);
}

bag::Bytes tracks_message(const log::SeenImage& image) {
  constexpr std::uint8_t kPoints = 1;  // of the message's definition
  constexpr double kThickness_px = 4.;
  constexpr std::array<double, 4> kNone{}, kWhite{1., 1., 1., 1.};
  const auto n = static_cast<std::uint32_t>(image.points.size());
  CdrMessage message;
  message << std::uint32_t{0} << std::uint32_t{1};  // circles, then point sets
  message.stamp(image.t_ns) << kPoints << n;
  for (const log::SeenPoint& point : image.points) message << point.u_px << point.v_px;
  message << kWhite << n;
  for (const log::SeenPoint& point : image.points) {
    message << std::array{1. - point.age, point.age, 0., 1.};
  }
  message << kNone << kThickness_px << std::uint32_t{0};  // texts
  return bytes_of(message);
}

}  // namespace viwo::ros2

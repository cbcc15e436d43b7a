#include "ros1_writer.hpp"

#include <algorithm>
#include <exception>
#include <stdexcept>

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/NavSatFix.h>

namespace viwo::bag {
namespace {

ros::Time to_time(std::int64_t t_ns) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  if (t_ns < 0 || t_ns / kSecond > 0xffffffffLL) {
    throw std::runtime_error("ROS 1 has no time for the stamp " + std::to_string(t_ns) + " ns");
  }
  return {static_cast<std::uint32_t>(t_ns / kSecond), static_cast<std::uint32_t>(t_ns % kSecond)};
}

geometry_msgs::Vector3 vector(const std::array<double, 3>& v) {
  geometry_msgs::Vector3 out;
  out.x = v[0];
  out.y = v[1];
  out.z = v[2];
  return out;
}

geometry_msgs::Pose pose(const std::array<double, 3>& p, const std::array<double, 4>& q_xyzw) {
  geometry_msgs::Pose out;
  out.position.x = p[0];
  out.position.y = p[1];
  out.position.z = p[2];
  out.orientation.x = q_xyzw[0];
  out.orientation.y = q_xyzw[1];
  out.orientation.z = q_xyzw[2];
  out.orientation.w = q_xyzw[3];
  return out;
}

}  // namespace

struct Ros1Writer::Bag {
  rosbag::Bag bag;
};

Ros1Writer::Ros1Writer(const std::string& file, const std::string& compression,
                       std::uint32_t chunk_bytes)
    : file_(file), bag_(std::make_unique<Bag>()) {
  try {
    bag_->bag.open(file, rosbag::bagmode::Write);
    bag_->bag.setCompression(compression == "bz2"   ? rosbag::compression::BZ2
                             : compression == "lz4" ? rosbag::compression::LZ4
                                                    : rosbag::compression::Uncompressed);
    bag_->bag.setChunkThreshold(chunk_bytes);
  } catch (const std::exception& error) {
    fail(error.what());
  }
}

Ros1Writer::~Ros1Writer() {
  try {
    close();
  } catch (const std::exception&) {
    // Who wants to know has called close().
  }
}

void Ros1Writer::fail(const std::string& why) {
  // A bag that cannot be written closes itself in its destructor, which would throw again.
  static_cast<void>(bag_.release());
  throw std::runtime_error(file_ + "  cannot be written: " + why);
}

void Ros1Writer::close() {
  if (bag_ == nullptr) return;
  try {
    bag_->bag.close();
  } catch (const std::exception& error) {
    fail(error.what());
  }
  bag_.reset();
}

template <class M>
void Ros1Writer::write(const std::string& topic, const Stamps& stamps, M& message) {
  if (bag_ == nullptr) throw std::runtime_error(file_ + "  is closed");
  try {
    message.header.stamp = to_time(stamps.header_ns);
    // The recording of a bag cannot begin at 0.
    bag_->bag.write(topic, std::max(to_time(stamps.received_ns), ros::TIME_MIN), message);
  } catch (const std::exception& error) {
    fail(error.what());
  }
}

void Ros1Writer::write_imu(const std::string& topic, const Stamps& stamps,
                           const std::array<double, 3>& gyro_rad_per_s,
                           const std::array<double, 3>& accel_m_per_s2) {
  sensor_msgs::Imu message;
  message.header.frame_id = "imu";
  message.orientation_covariance[0] = -1.;  // there is no orientation
  message.angular_velocity = vector(gyro_rad_per_s);
  message.linear_acceleration = vector(accel_m_per_s2);
  write(topic, stamps, message);
}

void Ros1Writer::write_joints(const std::string& topic, const Stamps& stamps,
                              const std::vector<std::string>& names,
                              const std::vector<double>& positions,
                              const std::vector<double>& velocities) {
  sensor_msgs::JointState message;
  message.name = names;
  message.position = positions;
  message.velocity = velocities;
  write(topic, stamps, message);
}

void Ros1Writer::write_pose(const std::string& topic, const Stamps& stamps,
                            const std::array<double, 3>& p, const std::array<double, 4>& q_xyzw) {
  geometry_msgs::PoseStamped message;
  message.header.frame_id = "world";
  message.pose = pose(p, q_xyzw);
  write(topic, stamps, message);
}

void Ros1Writer::write_pose_with_covariance(const std::string& topic, const Stamps& stamps,
                                            const std::array<double, 3>& p,
                                            const std::array<double, 4>& q_xyzw) {
  geometry_msgs::PoseWithCovarianceStamped message;
  message.header.frame_id = "world";
  message.pose.pose = pose(p, q_xyzw);
  write(topic, stamps, message);
}

void Ros1Writer::write_odometry(const std::string& topic, const Stamps& stamps,
                                const std::array<double, 3>& p, const std::array<double, 4>& q_xyzw,
                                double v_x, double omega_z) {
  nav_msgs::Odometry message;
  message.header.frame_id = "world";
  message.child_frame_id = "base_link";
  message.pose.pose = pose(p, q_xyzw);
  message.twist.twist.linear.x = v_x;
  message.twist.twist.angular.z = omega_z;
  write(topic, stamps, message);
}

void Ros1Writer::write_fix(const std::string& topic, const Stamps& stamps, const RawFix& fix) {
  sensor_msgs::NavSatFix message;
  message.header.frame_id = "gps";
  message.status.status = static_cast<std::int8_t>(fix.status);
  message.status.service = sensor_msgs::NavSatStatus::SERVICE_GPS;
  message.latitude = fix.latitude_deg;
  message.longitude = fix.longitude_deg;
  message.altitude = fix.altitude_m;
  std::copy(fix.covariance_m2.begin(), fix.covariance_m2.end(),
            message.position_covariance.begin());
  message.position_covariance_type = static_cast<std::uint8_t>(fix.covariance_type);
  write(topic, stamps, message);
}

void Ros1Writer::write_image(const std::string& topic, const Stamps& stamps,
                             const RawImage& image) {
  sensor_msgs::Image message;
  message.header.frame_id = topic;
  message.width = image.width_px;
  message.height = image.height_px;
  message.encoding = image.encoding;
  message.is_bigendian = image.big_endian ? 1 : 0;
  message.step = image.row_bytes;
  message.data = image.pixels;
  write(topic, stamps, message);
}

void Ros1Writer::write_compressed_image(const std::string& topic, const Stamps& stamps,
                                        const std::string& format,
                                        const std::vector<std::uint8_t>& bytes) {
  sensor_msgs::CompressedImage message;
  message.header.frame_id = topic;
  message.format = format;
  message.data = bytes;
  write(topic, stamps, message);
}

}  // namespace viwo::bag

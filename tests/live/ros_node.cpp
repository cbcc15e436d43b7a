// A node of ROS for tests, in a process of its own: publishes what a robot would, or writes down
// what viwo publishes. C++17: the messages of ROS 1 do not compile as C++20.
//
//   ros_node publish N      /imu0 and /joint_states, N messages each at 200 Hz, and a stereo pair
//   of
//                           images for each 20 of them: /cam0/image_raw, /cam1/image_raw/compressed
//   ros_node record FILE    viwo/odometry, /tf and /diagnostics, a line each, until SIGTERM
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <string>
#include <vector>

#include <diagnostic_msgs/DiagnosticArray.h>
#include <nav_msgs/Odometry.h>
#include <ros/ros.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <tf2_msgs/TFMessage.h>

namespace {

constexpr std::uint32_t kStart = 1700000000;
constexpr int kPerImage = 20;

/// Sample k; all values follow from k, so that the test knows them.
ros::Time stamp(int k) {
  const auto ns = static_cast<std::uint32_t>(k) * 5000000u;
  return {kStart + ns / 1000000000u, ns % 1000000000u};
}

/// A binary PGM of one grey level, which decoders of compressed images read, too.
std::vector<std::uint8_t> picture(int k) {
  const std::string head = "P5 8 4 255\n";
  std::vector<std::uint8_t> bytes(head.begin(), head.end());
  bytes.insert(bytes.end(), 32, static_cast<std::uint8_t>(k / kPerImage));
  return bytes;
}

int publish(int n) {
  ros::NodeHandle node;
  ros::Publisher imu = node.advertise<sensor_msgs::Imu>("/imu0", 100);
  ros::Publisher joints = node.advertise<sensor_msgs::JointState>("/joint_states", 100);
  ros::Publisher left = node.advertise<sensor_msgs::Image>("/cam0/image_raw", 10);
  ros::Publisher right =
      node.advertise<sensor_msgs::CompressedImage>("/cam1/image_raw/compressed", 10);
  const ros::WallTime deadline = ros::WallTime::now() + ros::WallDuration(20.);
  for (const ros::Publisher* publisher : {&imu, &joints, &left, &right}) {
    while (publisher->getNumSubscribers() == 0) {
      if (ros::WallTime::now() > deadline) {
        std::cerr << "nobody listens to " << publisher->getTopic() << "\n";
        return 1;
      }
      ros::WallDuration(0.01).sleep();
    }
  }
  ros::WallRate rate(200.);
  for (int k = 0; k < n && ros::ok(); ++k, rate.sleep()) {
    sensor_msgs::Imu imu_message;
    imu_message.header.stamp = stamp(k);
    imu_message.angular_velocity.x = k;
    imu_message.linear_acceleration.z = 9.81;
    imu.publish(imu_message);
    sensor_msgs::JointState joint_message;
    joint_message.header.stamp = stamp(k);
    joint_message.name = {"drive_1", "drive_2", "steer_1"};
    joint_message.velocity = {1. * k, 2. * k, 0.};
    joint_message.position = {0., 0., 0.001 * k};
    joints.publish(joint_message);
    if (k % kPerImage != 0) continue;
    sensor_msgs::CompressedImage compressed;  // the right one first
    compressed.header.stamp = stamp(k);
    compressed.format = "pgm";
    compressed.data = picture(k);
    right.publish(compressed);
    sensor_msgs::Image image;
    image.header.stamp = stamp(k);
    image.width = 8;
    image.height = 4;
    image.step = 8;
    image.encoding = "mono8";
    image.data.assign(32, static_cast<std::uint8_t>(100 + k / kPerImage));
    left.publish(image);
  }
  ros::WallDuration(0.5).sleep();  // what is still to be sent
  return 0;
}

volatile std::sig_atomic_t terminated = 0;

int record(const std::string& file) {
  std::signal(SIGTERM, [](int) { terminated = 1; });
  std::ofstream out(file);
  out << std::setprecision(17);
  ros::NodeHandle node;
  const ros::Subscriber odometry = node.subscribe<nav_msgs::Odometry>(
      "/viwo/odometry", 1000, [&out](const nav_msgs::Odometry::ConstPtr& m) {
        const auto& p = m->pose.pose.position;
        out << "odometry " << m->header.stamp.toNSec() << " " << m->header.frame_id << " "
            << m->child_frame_id << " " << p.x << " " << p.y << " " << p.z << "\n";
      });
  const ros::Subscriber tf = node.subscribe<tf2_msgs::TFMessage>(
      "/tf", 1000, [&out](const tf2_msgs::TFMessage::ConstPtr& m) {
        for (const auto& t : m->transforms) {
          out << "tf " << t.header.stamp.toNSec() << " " << t.header.frame_id << " "
              << t.child_frame_id << " " << t.transform.translation.x << "\n";
        }
      });
  const ros::Subscriber diagnostics = node.subscribe<diagnostic_msgs::DiagnosticArray>(
      "/diagnostics", 1000, [&out](const diagnostic_msgs::DiagnosticArray::ConstPtr& m) {
        for (const auto& s : m->status) {
          out << "diagnostics " << m->header.stamp.toNSec() << " level " << int{s.level};
          for (const auto& v : s.values) out << " " << v.key << "=" << v.value;
          out << "\n";
        }
      });
  while (ros::ok() && terminated == 0) {
    ros::spinOnce();
    out.flush();
    ros::WallDuration(0.01).sleep();
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string mode = argc == 3 ? argv[1] : "";
  if (mode != "publish" && mode != "record") {
    std::cerr << "ros_node publish N | record FILE\n";
    return 2;
  }
  std::uint32_t options = ros::init_options::AnonymousName | ros::init_options::NoRosout;
  if (mode == "record") options |= ros::init_options::NoSigintHandler;
  ros::init(argc, argv, "ros_node", options);
  return mode == "publish" ? publish(std::atoi(argv[2])) : record(argv[2]);
}

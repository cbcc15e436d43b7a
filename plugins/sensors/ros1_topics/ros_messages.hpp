// The messages of ROS 1 in C++20. Their headers name members of std::allocator<void> that C++20 has
// removed; an allocator that still has them gives messages with the same members.
#pragma once

#include <memory>
#include <type_traits>

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <nav_msgs/Path.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/NavSatFix.h>
#include <tf2_msgs/TFMessage.h>

namespace viwo::ros1 {

template <class T>
struct MessageAllocator : std::allocator<T> {
  template <class U>
  struct rebind {  // NOLINT(readability-identifier-naming): as ROS and the library call it
    /// Texts stay std::string.
    using other =
        std::conditional_t<std::is_same_v<U, char>, std::allocator<char>, MessageAllocator<U>>;
  };
  MessageAllocator() = default;
  template <class U>
  MessageAllocator(const MessageAllocator<U>& /*other*/) {}
};

namespace msg {

// Of any type but char: rebound to its own, an allocator must be itself.
using AnyAllocator = MessageAllocator<int>;

using CompressedImage = sensor_msgs::CompressedImage_<AnyAllocator>;
using DiagnosticArray = diagnostic_msgs::DiagnosticArray_<AnyAllocator>;
using DiagnosticStatus = diagnostic_msgs::DiagnosticStatus_<AnyAllocator>;
using Image = sensor_msgs::Image_<AnyAllocator>;
using Imu = sensor_msgs::Imu_<AnyAllocator>;
using JointState = sensor_msgs::JointState_<AnyAllocator>;
using KeyValue = diagnostic_msgs::KeyValue_<AnyAllocator>;
using NavSatFix = sensor_msgs::NavSatFix_<AnyAllocator>;
using Odometry = nav_msgs::Odometry_<AnyAllocator>;
using Path = nav_msgs::Path_<AnyAllocator>;
using PoseStamped = geometry_msgs::PoseStamped_<AnyAllocator>;
using PoseWithCovarianceStamped = geometry_msgs::PoseWithCovarianceStamped_<AnyAllocator>;
using TFMessage = tf2_msgs::TFMessage_<AnyAllocator>;
using TransformStamped = geometry_msgs::TransformStamped_<AnyAllocator>;

}  // namespace msg
}  // namespace viwo::ros1

// An intake without a ROS system, and messages for it.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "bag.hpp"
#include "intake.hpp"
#include "live_queue.hpp"
#include "rejections.hpp"
#include "ros1_fields.hpp"
#include "ros_messages.hpp"
#include "topic_options.hpp"
#include "viwo/api/host_services.hpp"
#include "viwo/api/measurement.hpp"

namespace viwo::ros1 {

using testing::rejections_of;

inline constexpr std::int64_t kSecond = 1'000'000'000;
inline constexpr std::int64_t kTime = 1'700'000'000 * kSecond + 123'456'789;

template <class Message>
std::shared_ptr<const bag::Bytes> raw(const Message& message) {
  auto out = std::make_shared<bag::Bytes>(ros::serialization::serializationLength(message));
  ros::serialization::OStream stream(out->data(), static_cast<std::uint32_t>(out->size()));
  ros::serialization::serialize(stream, message);
  return out;
}

inline ros::Time time_of(std::int64_t t_ns) {
  return {static_cast<std::uint32_t>(t_ns / 1'000'000'000),
          static_cast<std::uint32_t>(t_ns % 1'000'000'000)};
}

class IntakeTest : public ::testing::Test {
 protected:
  static void log_text(void* host, LogLevel level, const char* text, std::uint64_t size) {
    EXPECT_EQ(level, LogLevel::kWarning);
    static_cast<IntakeTest*>(host)->warnings_.emplace_back(text, size);
  }

  live::Intake make(const bag::TopicOptions& options, live::Pace pace = live::Pace::kLive) {
    return {options, services_, queue_,
            [](std::span<const std::uint8_t> message) -> std::unique_ptr<bag::FieldReader> {
              return std::make_unique<bag::Ros1Fields>(message);
            },
            pace};
  }

  template <class Message>
  static void take(live::Intake& intake, std::size_t topic, const Message& message) {
    intake.take(topic, ros::message_traits::datatype<Message>(),
                ros::message_traits::md5sum<Message>(), raw(message));
  }

  std::vector<Measurement> taken() {
    std::vector<Measurement> all;
    Measurement out;
    while (queue_.pop(out, std::chrono::milliseconds(0)) == live::LiveQueue::Taken::kMeasurement) {
      all.push_back(out);
    }
    return all;
  }

  std::vector<std::string> warnings_;
  HostServices services_{this, &IntakeTest::log_text, 1};
  live::LiveQueue queue_{16};
};

inline bag::TopicOptions imu_only() {
  bag::TopicOptions options;
  options.imu_topic = "/imu0";
  return options;
}

inline msg::Imu imu_message(std::int64_t t_ns, double rate = 0.1) {
  msg::Imu message;
  message.header.stamp = time_of(t_ns);
  message.header.frame_id = "imu_link";
  message.orientation_covariance[0] = -1.;
  message.angular_velocity.x = rate;
  message.angular_velocity.y = 0.2;
  message.angular_velocity.z = 0.3;
  message.linear_acceleration.x = 1.;
  message.linear_acceleration.y = 2.;
  message.linear_acceleration.z = 9.8;
  return message;
}

}  // namespace viwo::ros1

// What nodes of ROS 2 for tests publish and hear, by Cyclone DDS.
#pragma once

#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include <dds/dds.h>

#include "messages.hpp"
#include "ros2_fields.hpp"
#include "ros2_file.hpp"
#include "ros2_messages.h"
#include "viwo/api/rejections.hpp"

namespace viwo::testing::ros2 {

using Clock = std::chrono::steady_clock;
constexpr std::int64_t kSecond = 1'000'000'000;

inline void require(dds_return_t code, const std::string& what) {
  if (code < 0) throw std::runtime_error(what + ": " + dds_strretcode(-code));
}

enum class Delivery { kBestEffort, kKeepAll, kKeepOne, kLatched };

/// Who publishes a topic of a type.
class Writer {
 public:
  Writer(dds_entity_t participant, const dds_topic_descriptor_t& type, const std::string& topic,
         Delivery delivery)
      : topic_(topic) {
    const dds_entity_t made =
        dds_create_topic(participant, &type, ("rt" + topic).c_str(), nullptr, nullptr);
    require(made, "topic " + topic);
    dds_qos_t* const qos = dds_create_qos();
    const bool reliable = delivery != Delivery::kBestEffort;
    dds_qset_reliability(qos, reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                         DDS_SECS(600));
    const bool all = delivery == Delivery::kKeepAll;
    dds_qset_history(qos, all ? DDS_HISTORY_KEEP_ALL : DDS_HISTORY_KEEP_LAST, all ? 0 : 1);
    if (delivery == Delivery::kLatched) dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
    writer_ = dds_create_writer(participant, made, qos, nullptr);
    dds_delete_qos(qos);
    require(writer_, "writer of " + topic);
  }
  ~Writer() { dds_delete(writer_); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  void wait_for_reader() const {
    const auto deadline = Clock::now() + std::chrono::seconds(60);
    dds_publication_matched_status_t status;
    do {
      if (Clock::now() > deadline) throw std::runtime_error("nobody listens to " + topic_);
      dds_sleepfor(DDS_MSECS(5));
      require(dds_get_publication_matched_status(writer_, &status), topic_);
    } while (status.current_count == 0);
  }
  void write(const void* message) const { require(dds_write(writer_, message), topic_); }
  void wait_until_all_is_taken() const {
    require(dds_wait_for_acks(writer_, DDS_SECS(60)), topic_);
  }

 private:
  std::string topic_;
  dds_entity_t writer_;
};

template <class Header>
void set_header(Header& header, std::int64_t t_ns) {
  static char frame[] = "frame";
  header.stamp.sec = static_cast<std::int32_t>(t_ns / kSecond);
  header.stamp.nanosec = static_cast<std::uint32_t>(t_ns % kSecond);
  header.frame_id = frame;
}

/// Lets a sequence of a message show what is in a vector.
template <class Sequence, class T>
void set_sequence(Sequence& sequence, std::vector<T>& from) {
  sequence._length = sequence._maximum = static_cast<std::uint32_t>(from.size());
  sequence._buffer = from.data();
  sequence._release = false;
}

inline std::vector<char*> texts(std::vector<std::string>& from) {
  std::vector<char*> out;
  for (std::string& text : from) out.push_back(text.data());
  return out;
}

inline sensor_msgs_msg_dds__Imu_ imu_message(std::int64_t t_ns, const ImuSample& imu) {
  sensor_msgs_msg_dds__Imu_ message{};
  set_header(message.header, t_ns);
  message.orientation_covariance[0] = -1.;
  const auto& [wx, wy, wz] = imu.gyro_rad_per_s;
  const auto& [ax, ay, az] = imu.accel_m_per_s2;
  message.angular_velocity = {wx, wy, wz};
  message.linear_acceleration = {ax, ay, az};
  return message;
}

inline void write_joints(const Writer& writer, std::int64_t t_ns, std::vector<std::string> names,
                         std::vector<double> positions, std::vector<double> velocities) {
  sensor_msgs_msg_dds__JointState_ message{};
  set_header(message.header, t_ns);
  std::vector<char*> name_texts = texts(names);
  set_sequence(message.name, name_texts);
  set_sequence(message.position, positions);
  set_sequence(message.velocity, velocities);
  writer.write(&message);
}

inline void write_image(const Writer& writer, const bag::ImageHead& head,
                        std::vector<std::uint8_t> data) {
  sensor_msgs_msg_dds__Image_ message{};
  set_header(message.header, head.t_ns);
  message.height = head.height_px;
  message.width = head.width_px;
  message.step = head.row_bytes;
  std::string encoding = head.encoding;
  message.encoding = encoding.data();
  set_sequence(message.data, data);
  writer.write(&message);
}

/// Hears a topic: calls `take` with each message.
template <class Message>
class Reader {
 public:
  Reader(dds_entity_t participant, const dds_topic_descriptor_t& type, const std::string& topic) {
    const dds_entity_t made =
        dds_create_topic(participant, &type, ("rt" + topic).c_str(), nullptr, nullptr);
    require(made, "topic " + topic);
    dds_qos_t* const qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
    reader_ = dds_create_reader(participant, made, qos, nullptr);
    dds_delete_qos(qos);
    require(reader_, "reader of " + topic);
  }
  /// Of a topic that is built in: what other participants have.
  Reader(dds_entity_t participant, dds_entity_t topic)
      : reader_(dds_create_reader(participant, topic, nullptr, nullptr)) {
    require(reader_, "reader of a topic that is built in");
  }
  /// Called with `argument`, in a thread of DDS, when there is something to read; null: no more.
  void on_data(void (*call)(dds_entity_t reader, void* argument), void* argument) const {
    dds_listener_t* const listener = dds_create_listener(argument);
    dds_lset_data_available(listener, call);
    require(dds_set_listener(reader_, listener), "listener");
    dds_delete_listener(listener);
  }
  template <class Take>
  void read(const Take& take) const {
    void* sample[1] = {nullptr};
    dds_sample_info_t info[1];
    while (dds_take(reader_, sample, info, 1, 1) > 0) {
      if (info[0].valid_data) take(*static_cast<const Message*>(sample[0]));
      dds_return_loan(reader_, sample, 1);
    }
  }

 private:
  dds_entity_t reader_;
};

template <class Header>
std::int64_t stamp_of(const Header& header) {
  return header.stamp.sec * kSecond + header.stamp.nanosec;
}

/// An image with its pixels.
struct Picture {
  bag::ImageHead head;
  std::vector<std::uint8_t> pixels;
};

/// What a bag of a robot has.
using Message = std::variant<ImuSample, bag::Joints, Picture>;

inline std::int64_t& stamp_ns(Message& message) {
  if (auto* imu = std::get_if<ImuSample>(&message)) return imu->t_ns;
  if (auto* joints = std::get_if<bag::Joints>(&message)) return joints->t_ns;
  return std::get<Picture>(message).head.t_ns;
}

/// By Cyclone DDS: its own serialisation of the numbers of a bag.
inline void write(const Writer& writer, const Message& message) {
  if (const auto* imu = std::get_if<ImuSample>(&message)) {
    const auto sample = imu_message(imu->t_ns, *imu);
    writer.write(&sample);
  } else if (const auto* joints = std::get_if<bag::Joints>(&message)) {
    write_joints(writer, joints->t_ns, joints->names, joints->positions, joints->velocities);
  } else {
    const Picture& picture = std::get<Picture>(message);
    write_image(writer, picture.head, picture.pixels);
  }
}

inline const dds_topic_descriptor_t& descriptor_of(bag::Kind kind) {
  switch (kind) {
    case bag::Kind::kImu:
      return sensor_msgs_msg_dds__Imu__desc;
    case bag::Kind::kJoints:
      return sensor_msgs_msg_dds__JointState__desc;
    case bag::Kind::kImage:
      return sensor_msgs_msg_dds__Image__desc;
    default:
      throw std::runtime_error("a topic that is not played");
  }
}

/// A bag of ROS 2 and its topics that a robot has: it does not know where it truly is.
class RobotBag {
 public:
  struct Topic {
    std::string name;
    bag::Kind kind;
  };

  explicit RobotBag(const std::string& file) : bag_(bag::open_ros2(file)) {
    for (const bag::Topic& topic : bag_->topics()) {
      const auto kind = bag::kind_of(topic.type);
      if (kind && *kind != bag::Kind::kPose) topics_.push_back({topic.name, *kind});
    }
  }

  const std::vector<Topic>& topics() const { return topics_; }

  /// take(topic, message, since_begin_ns) for each, in order.
  template <class Take>
  void read(const Take& take) const {
    std::vector<bag::Wanted> wanted;
    for (const Topic& topic : topics_) {
      wanted.push_back({topic.name, topic.kind == bag::Kind::kImage});
    }
    Rejections damage;
    bag::Bytes bytes;
    bag_->read(
        wanted, std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max(),
        [&](const bag::Message& message) {
          bytes.assign(message.bytes.begin(), message.bytes.end());
          if (message.load) message.load(bytes);
          take(message.topic, decoded(topics_[message.topic].kind, *bag_->fields(bytes)),
               message.received_ns - bag_->begin_ns());
        },
        damage);
  }

 private:
  static Message decoded(bag::Kind kind, bag::FieldReader& in) {
    if (kind == bag::Kind::kImu) return bag::read_imu(in);
    if (kind == bag::Kind::kJoints) return bag::read_joints(in);
    const bag::ImageHead head = bag::read_image_head(in);
    const auto pixels = in.bytes();
    return Picture{head, {pixels.begin(), pixels.end()}};
  }

  std::shared_ptr<const bag::Bag> bag_;
  std::vector<Topic> topics_;
};

}  // namespace viwo::testing::ros2

// A node of ROS 2 for tests, by Cyclone DDS, in a process of its own: publishes what a robot would,
// writes down what viwo publishes, or plays a bag. CYCLONEDDS_URI keeps it on this machine.
//
//   ros2_node publish DOMAIN N    /imu0 and /joint_states, N messages each at 200 Hz, and a stereo
//                                 pair of images for each 20 of them: /cam0/image_raw,
//                                 /cam1/image_raw/compressed; best effort, as drivers are
//   ros2_node wrong DOMAIN N      what must not be: /imu0 of another type, and N messages of joints
//                                 whose names are missing
//   ros2_node record DOMAIN FILE  viwo/odometry, viwo/path, /tf and /diagnostics, a line each,
//                                 until SIGTERM
//   ros2_node play DOMAIN BAG     a ROS 2 bag in its own time, best effort
//   ros2_node step DOMAIN BAG     as fast as it is taken: reliable, keeping all
//   ros2_node lossy DOMAIN BAG    as fast as possible on a lossy line: reliable, keeping one message
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <dds/dds.h>

#include "messages.hpp"
#include "ros2_fields.hpp"
#include "ros2_file.hpp"
#include "ros2_messages.h"
#include "viwo/api/rejections.hpp"

namespace {

using Clock = std::chrono::steady_clock;
namespace bag = viwo::bag;
constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kStart = 1'700'000'000 * kSecond;
constexpr int kPerImage = 20;

void require(dds_return_t code, const std::string& what) {
  if (code < 0) throw std::runtime_error(what + ": " + dds_strretcode(-code));
}

enum class Delivery { kBestEffort, kKeepAll, kKeepOne };

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
    writer_ = dds_create_writer(participant, made, qos, nullptr);
    dds_delete_qos(qos);
    require(writer_, "writer of " + topic);
  }
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

std::vector<char*> texts(std::vector<std::string>& from) {
  std::vector<char*> out;
  for (std::string& text : from) out.push_back(text.data());
  return out;
}

sensor_msgs_msg_dds__Imu_ imu_message(std::int64_t t_ns, const viwo::ImuSample& imu) {
  sensor_msgs_msg_dds__Imu_ message{};
  set_header(message.header, t_ns);
  message.orientation_covariance[0] = -1.;
  const auto& [wx, wy, wz] = imu.gyro_rad_per_s;
  const auto& [ax, ay, az] = imu.accel_m_per_s2;
  message.angular_velocity = {wx, wy, wz};
  message.linear_acceleration = {ax, ay, az};
  return message;
}

void write_joints(const Writer& writer, std::int64_t t_ns, std::vector<std::string> names,
                  std::vector<double> positions, std::vector<double> velocities) {
  sensor_msgs_msg_dds__JointState_ message{};
  set_header(message.header, t_ns);
  std::vector<char*> name_texts = texts(names);
  set_sequence(message.name, name_texts);
  set_sequence(message.position, positions);
  set_sequence(message.velocity, velocities);
  writer.write(&message);
}

void write_image(const Writer& writer, const bag::ImageHead& head, std::vector<std::uint8_t> data) {
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

int publish(dds_entity_t node, int n) {
  const Writer imu(node, sensor_msgs_msg_dds__Imu__desc, "/imu0", Delivery::kBestEffort);
  const Writer joints(node, sensor_msgs_msg_dds__JointState__desc, "/joint_states",
                      Delivery::kBestEffort);
  const Writer left(node, sensor_msgs_msg_dds__Image__desc, "/cam0/image_raw",
                    Delivery::kBestEffort);
  const Writer right(node, sensor_msgs_msg_dds__CompressedImage__desc, "/cam1/image_raw/compressed",
                     Delivery::kBestEffort);
  for (const Writer* writer : {&imu, &joints, &left, &right}) writer->wait_for_reader();
  dds_sleepfor(DDS_MSECS(200));  // the other side is to know it, too
  auto due = Clock::now();
  for (int k = 0; k < n; ++k) {
    std::this_thread::sleep_until(due += std::chrono::milliseconds(5));
    const std::int64_t t_ns = kStart + k * (kSecond / 200);
    const auto imu_sample = imu_message(t_ns, {t_ns, {1. * k, 0., 0.}, {0., 0., 9.81}});
    imu.write(&imu_sample);
    write_joints(joints, t_ns, {"drive_1", "drive_2", "steer_1"}, {0., 0., 0.001 * k},
                 {1. * k, 2. * k, 0.});
    if (k % kPerImage != 0) continue;
    // The right one first: a binary PGM of one grey level, which decoders of images read, too.
    sensor_msgs_msg_dds__CompressedImage_ compressed{};
    set_header(compressed.header, t_ns);
    std::string format = "pgm", head = "P5 8 4 255\n";
    compressed.format = format.data();
    std::vector<std::uint8_t> picture(head.begin(), head.end());
    picture.insert(picture.end(), 32, static_cast<std::uint8_t>(k / kPerImage));
    set_sequence(compressed.data, picture);
    right.write(&compressed);
    write_image(left, {t_ns, 4, 8, "mono8", false, 8},
                std::vector<std::uint8_t>(32, static_cast<std::uint8_t>(100 + k / kPerImage)));
  }
  dds_sleepfor(DDS_MSECS(500));  // what is still to be sent
  return 0;
}

int publish_wrong(dds_entity_t node, int n) {
  const Writer pose(node, geometry_msgs_msg_dds__PoseStamped__desc, "/imu0", Delivery::kBestEffort);
  const Writer joints(node, sensor_msgs_msg_dds__JointState__desc, "/joint_states",
                      Delivery::kBestEffort);
  joints.wait_for_reader();
  dds_sleepfor(DDS_MSECS(200));
  for (int k = 0; k < n; ++k) {
    geometry_msgs_msg_dds__PoseStamped_ message{};
    set_header(message.header, kStart + k);
    pose.write(&message);
    write_joints(joints, kStart + k * (kSecond / 200), {}, {}, {});
    dds_sleepfor(DDS_MSECS(5));
  }
  dds_sleepfor(DDS_MSECS(500));
  return 0;
}

std::atomic<bool> terminated = false;

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

int record(dds_entity_t node, const std::string& file) {
  std::ofstream out(file);
  out << std::setprecision(17);
  const Reader<nav_msgs_msg_dds__Odometry_> odometry(node, nav_msgs_msg_dds__Odometry__desc,
                                                     "/viwo/odometry");
  const Reader<nav_msgs_msg_dds__Path_> path(node, nav_msgs_msg_dds__Path__desc, "/viwo/path");
  const Reader<tf2_msgs_msg_dds__TFMessage_> tf(node, tf2_msgs_msg_dds__TFMessage__desc, "/tf");
  const Reader<diagnostic_msgs_msg_dds__DiagnosticArray_> diagnostics(
      node, diagnostic_msgs_msg_dds__DiagnosticArray__desc, "/diagnostics");
  while (!terminated) {
    odometry.read([&out](const auto& m) {
      const auto& p = m.pose.pose.position;
      out << "odometry " << stamp_of(m.header) << " " << m.header.frame_id << " "
          << m.child_frame_id << " " << p.x << " " << p.y << " " << p.z << " "
          << m.pose.covariance[7] << " " << m.twist.covariance[35] << "\n";
    });
    path.read([&out](const auto& m) {
      out << "path " << m.header.frame_id << " " << m.poses._length << " "
          << m.poses._buffer[m.poses._length - 1].pose.position.x << "\n";
    });
    tf.read([&out](const auto& m) {
      for (std::uint32_t i = 0; i < m.transforms._length; ++i) {
        const auto& t = m.transforms._buffer[i];
        out << "tf " << stamp_of(t.header) << " " << t.header.frame_id << " " << t.child_frame_id
            << " " << t.transform.translation.x << "\n";
      }
    });
    diagnostics.read([&out](const auto& m) {
      for (std::uint32_t i = 0; i < m.status._length; ++i) {
        const auto& s = m.status._buffer[i];
        out << "diagnostics " << stamp_of(m.header) << " level " << int{s.level};
        for (std::uint32_t k = 0; k < s.values._length; ++k) {
          out << " " << s.values._buffer[k].key << "=" << s.values._buffer[k].value;
        }
        out << "\n";
      }
    });
    out.flush();
    dds_sleepfor(DDS_MSECS(5));
  }
  return 0;
}

/// A message of the bag, by Cyclone DDS: its own serialisation of the same numbers.
void write_message(const Writer& writer, bag::Kind kind, bag::FieldReader& in) {
  switch (kind) {
    case bag::Kind::kImu: {
      const viwo::ImuSample imu = bag::read_imu(in);
      const auto message = imu_message(imu.t_ns, imu);
      return writer.write(&message);
    }
    case bag::Kind::kJoints: {
      bag::Joints joints = bag::read_joints(in);
      return write_joints(writer, joints.t_ns, std::move(joints.names), std::move(joints.positions),
                          std::move(joints.velocities));
    }
    case bag::Kind::kImage: {
      const bag::ImageHead head = bag::read_image_head(in);
      const auto pixels = in.bytes();
      return write_image(writer, head, {pixels.begin(), pixels.end()});
    }
    default:
      throw std::runtime_error("a message that is not played");
  }
}

const dds_topic_descriptor_t& descriptor_of(bag::Kind kind) {
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

int play(dds_entity_t node, const std::string& file, Delivery delivery) {
  const auto all = bag::open_ros2(file);
  std::vector<bag::Wanted> wanted;
  std::vector<bag::Kind> kinds;
  std::vector<std::unique_ptr<Writer>> writers;
  for (const bag::Topic& topic : all->topics()) {
    const auto kind = bag::kind_of(topic.type);
    if (!kind || *kind == bag::Kind::kPose) continue;  // the robot does not know where it truly is
    kinds.push_back(*kind);
    wanted.push_back({topic.name, *kind == bag::Kind::kImage});
    writers.push_back(std::make_unique<Writer>(node, descriptor_of(*kind), topic.name, delivery));
  }
  for (const auto& writer : writers) writer->wait_for_reader();
  dds_sleepfor(DDS_MSECS(500));  // the other side is to know it, too
  const auto begin = Clock::now();
  viwo::Rejections damage;
  bag::Bytes bytes;
  all->read(
      wanted, std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max(),
      [&](const bag::Message& message) {
        if (delivery == Delivery::kBestEffort) {
          const std::int64_t ns = message.received_ns - all->begin_ns();
          std::this_thread::sleep_until(begin + std::chrono::nanoseconds(ns));
        }
        bytes.assign(message.bytes.begin(), message.bytes.end());
        if (message.load) message.load(bytes);
        write_message(*writers[message.topic], kinds[message.topic], *all->fields(bytes));
      },
      damage);
  if (delivery == Delivery::kBestEffort) {
    dds_sleepfor(DDS_MSECS(500));
  } else {
    for (const auto& writer : writers) writer->wait_until_all_is_taken();
  }
  return 0;
}

/// One packet of twenty is lost on the way out.
void make_line_lossy() {
  const std::string settings = std::getenv("CYCLONEDDS_URI");
  setenv("CYCLONEDDS_URI",
         (settings + ",<CycloneDDS><Domain Id='any'><Internal><Test><XmitLossiness>50"
                     "</XmitLossiness></Test></Internal></Domain></CycloneDDS>")
             .c_str(),
         1);
}

int run(const std::string& mode, int domain, const std::string& what) {
  if (mode == "lossy") make_line_lossy();
  const dds_entity_t node =
      dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr);
  require(node, "participant");
  int code = 2;
  if (mode == "publish") code = publish(node, std::stoi(what));
  if (mode == "wrong") code = publish_wrong(node, std::stoi(what));
  if (mode == "record") code = record(node, what);
  if (mode == "play") code = play(node, what, Delivery::kBestEffort);
  if (mode == "step") code = play(node, what, Delivery::kKeepAll);
  if (mode == "lossy") code = play(node, what, Delivery::kKeepOne);
  dds_delete(node);
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "ros2_node publish|wrong|record|play|step|lossy DOMAIN N|FILE|BAG\n";
    return 2;
  }
  std::signal(SIGTERM, [](int) { terminated = true; });
  try {
    return run(argv[1], std::stoi(argv[2]), argv[3]);
  } catch (const std::exception& error) {
    std::cerr << "ros2_node: " << error.what() << "\n";
    return 1;
  }
}

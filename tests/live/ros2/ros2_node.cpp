// A node of ROS 2 for tests, by Cyclone DDS, in a process of its own: publishes what a robot would,
// writes down what viwo publishes, or plays a bag. CYCLONEDDS_URI keeps it on this machine.
//
//   ros2_node publish DOMAIN N    /imu0 and /joint_states, N messages each at 200 Hz, and a stereo
//                                 pair of images for each 20 of them: /cam0/image_raw,
//                                 /cam1/image_raw/compressed; best effort, as drivers are
//   ros2_node wrong DOMAIN N      what must not be: /imu0 of another type, and N messages of joints
//                                 whose names are missing
//   ros2_node mount DOMAIN Z      once, latched: on /tf_static where a plate is on base_link, on
//                                 /robot_description where imu_link is on the plate, Z m above it;
//                                 until SIGTERM
//   ros2_node poses DOMAIN N      where a robot is, N times at 200 Hz, in each message that says
//   so:
//                                 /pose, /amcl_pose, /odom and /fix
//   ros2_node record DOMAIN FILE  viwo/odometry, viwo/path, viwo/calibration, /tf and /diagnostics,
//                                 a line each, until SIGTERM
//   ros2_node endpoints DOMAIN FILE   readers and writers of others, a line each: which of them,
//                                 topic, type, user data; until SIGTERM
//   ros2_node play DOMAIN BAG     a ROS 2 bag in its own time, best effort
//   ros2_node timed DOMAIN BAG    the same, and prints the milliseconds from when the images of an
//                                 instant were given to DDS to when it has brought viwo/odometry, a
//                                 line for each pose
//   ros2_node step DOMAIN BAG     as fast as it is taken: reliable, keeping all
//   ros2_node lossy DOMAIN BAG    as fast as possible on a lossy line: reliable, keeping one
//   message
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include <dds/dds.h>

#include "ros2_publishing.hpp"

namespace {

using namespace viwo::testing::ros2;

constexpr std::int64_t kStart = 1'700'000'000 * kSecond;
constexpr int kPerImage = 20;
std::atomic<bool> terminated = false;

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

template <class Pose>
void set_pose(Pose& pose, double x) {
  pose.position = {x, 2., 3.};
  pose.orientation = {0., 0., 0.6, 0.8};
}

int publish_poses(dds_entity_t node, int n) {
  const Writer pose(node, geometry_msgs_msg_dds__PoseStamped__desc, "/pose", Delivery::kBestEffort);
  const Writer amcl(node, geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc, "/amcl_pose",
                    Delivery::kKeepAll);
  const Writer odometry(node, nav_msgs_msg_dds__Odometry__desc, "/odom", Delivery::kBestEffort);
  const Writer fixes(node, sensor_msgs_msg_dds__NavSatFix__desc, "/fix", Delivery::kBestEffort);
  for (const Writer* writer : {&pose, &amcl, &odometry, &fixes}) writer->wait_for_reader();
  dds_sleepfor(DDS_MSECS(200));  // the other side is to know it, too
  std::string base = "base_link";
  for (int k = 0; k < n; ++k) {
    const std::int64_t t_ns = kStart + k * (kSecond / 200);
    geometry_msgs_msg_dds__PoseStamped_ stamped{};
    set_header(stamped.header, t_ns);
    set_pose(stamped.pose, k);
    pose.write(&stamped);
    geometry_msgs_msg_dds__PoseWithCovarianceStamped_ with_covariance{};
    set_header(with_covariance.header, t_ns);
    set_pose(with_covariance.pose.pose, 100. + k);
    amcl.write(&with_covariance);
    nav_msgs_msg_dds__Odometry_ moving{};
    set_header(moving.header, t_ns);
    moving.child_frame_id = base.data();
    set_pose(moving.pose.pose, 200. + k);
    odometry.write(&moving);
    sensor_msgs_msg_dds__NavSatFix_ fix{};
    set_header(fix.header, t_ns);
    fix.status.service = 1;
    fix.latitude = 45.;
    fix.longitude = 15. + 1e-6 * k;
    fix.altitude = 100.;
    for (const int i : {0, 4, 8}) fix.position_covariance[i] = 0.25;
    fix.position_covariance_type = 2;  // the diagonal is known
    fixes.write(&fix);
    dds_sleepfor(DDS_MSECS(5));
  }
  dds_sleepfor(DDS_MSECS(500));
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

int publish_mount(dds_entity_t node, const std::string& z_m) {
  const Writer frames(node, tf2_msgs_msg_dds__TFMessage__desc, "/tf_static", Delivery::kLatched);
  const Writer description(node, std_msgs_msg_dds__String__desc, "/robot_description",
                           Delivery::kLatched);
  geometry_msgs_msg_dds__TransformStamped_ plate{};
  set_header(plate.header, kStart);
  std::string parent = "base_link", child = "plate";
  plate.header.frame_id = parent.data();
  plate.child_frame_id = child.data();
  plate.transform.translation.x = 0.5;
  plate.transform.rotation.w = 1.;
  tf2_msgs_msg_dds__TFMessage_ message{};
  message.transforms._buffer = &plate;
  message.transforms._length = message.transforms._maximum = 1;
  frames.write(&message);
  std::string urdf =
      "<robot name='r'><joint name='j' type='fixed'><parent link='plate'/><child link='imu_link'/>"
      "<origin xyz='0 0 " +
      z_m + "'/></joint></robot>";
  std_msgs_msg_dds__String_ text{};
  text.data = urdf.data();
  description.write(&text);
  while (!terminated) dds_sleepfor(DDS_MSECS(20));
  return 0;
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
  const Reader<sensor_msgs_msg_dds__JointState_> calibration(
      node, sensor_msgs_msg_dds__JointState__desc, "/viwo/calibration");
  while (!terminated) {
    calibration.read([&out](const auto& m) {
      out << "calibration " << stamp_of(m.header);
      for (std::uint32_t i = 0; i < m.name._length; ++i) {
        out << " " << m.name._buffer[i] << "=" << m.position._buffer[i] << " sigma "
            << m.effort._buffer[i];
      }
      out << "\n";
    });
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

void write_user_data(std::ostream& out, const dds_qos_t* qos) {
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(qos, &data, &size) || data == nullptr) return;
  out.write(static_cast<const char*>(data), static_cast<std::streamsize>(size));
  dds_free(data);
}

int record_endpoints(dds_entity_t node, const std::string& file) {
  std::ofstream out(file);
  const Reader<dds_builtintopic_endpoint_t> writers(node, DDS_BUILTIN_TOPIC_DCPSPUBLICATION);
  const Reader<dds_builtintopic_endpoint_t> readers(node, DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION);
  const auto write = [&out](const char* which, const dds_builtintopic_endpoint_t& there) {
    out << which << " " << there.topic_name << " " << there.type_name << " ";
    write_user_data(out, there.qos);
    out << "\n";
  };
  while (!terminated) {
    writers.read([&write](const auto& there) { write("writer", there); });
    readers.read([&write](const auto& there) { write("reader", there); });
    out.flush();
    dds_sleepfor(DDS_MSECS(20));
  }
  return 0;
}

/// How long poses take from their images, as the robot sees it.
class Stopwatch {
 public:
  explicit Stopwatch(dds_entity_t node)
      : odometry_(node, nav_msgs_msg_dds__Odometry__desc, "/viwo/odometry") {
    odometry_.on_data([](dds_entity_t, void* self) { static_cast<Stopwatch*>(self)->hear(); },
                      this);
  }
  ~Stopwatch() { odometry_.on_data(nullptr, nullptr); }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

  /// An image of this stamp goes out; of several the last one counts.
  void send(std::int64_t t_ns) {
    const std::scoped_lock lock(mutex_);
    sent_[t_ns] = Clock::now();
  }
  void print() {
    const std::scoped_lock lock(mutex_);
    for (const double ms : latency_ms_) std::cout << ms << "\n";
  }

 private:
  /// The stamp of a pose is that of its images but for the clock of the cameras.
  static constexpr std::int64_t kMostClockOffset = 10'000'000;

  void hear() {
    const auto now = Clock::now();
    const std::scoped_lock lock(mutex_);
    odometry_.read([&](const auto& m) {
      const auto image = sent_.lower_bound(stamp_of(m.header) - kMostClockOffset);
      if (image == sent_.end() || image->first > stamp_of(m.header) + kMostClockOffset) return;
      latency_ms_.push_back(std::chrono::duration<double, std::milli>(now - image->second).count());
    });
  }

  std::mutex mutex_;
  std::map<std::int64_t, Clock::time_point> sent_;
  std::vector<double> latency_ms_;
  Reader<nav_msgs_msg_dds__Odometry_> odometry_;
};

int play(dds_entity_t node, const std::string& file, Delivery delivery,
         Stopwatch* stopwatch = nullptr) {
  const RobotBag robot(file);
  std::vector<std::unique_ptr<Writer>> writers;
  for (const RobotBag::Topic& topic : robot.topics()) {
    writers.push_back(
        std::make_unique<Writer>(node, descriptor_of(topic.kind), topic.name, delivery));
  }
  for (const auto& writer : writers) writer->wait_for_reader();
  dds_sleepfor(DDS_MSECS(500));  // the other side is to know it, too
  const auto begin = Clock::now();
  robot.read([&](std::size_t topic, const Message& message, std::int64_t since_begin_ns) {
    if (delivery == Delivery::kBestEffort) {
      std::this_thread::sleep_until(begin + std::chrono::nanoseconds(since_begin_ns));
    }
    const auto* const picture = std::get_if<Picture>(&message);
    if (picture != nullptr && stopwatch != nullptr) stopwatch->send(picture->head.t_ns);
    write(*writers[topic], message);
  });
  if (delivery == Delivery::kBestEffort) {
    dds_sleepfor(DDS_MSECS(500));
  } else {
    for (const auto& writer : writers) writer->wait_until_all_is_taken();
  }
  return 0;
}

int play_timed(dds_entity_t node, const std::string& file) {
  Stopwatch stopwatch(node);
  const int code = play(node, file, Delivery::kBestEffort, &stopwatch);
  stopwatch.print();
  return code;
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
  if (mode == "poses") code = publish_poses(node, std::stoi(what));
  if (mode == "mount") code = publish_mount(node, what);
  if (mode == "record") code = record(node, what);
  if (mode == "endpoints") code = record_endpoints(node, what);
  if (mode == "play") code = play(node, what, Delivery::kBestEffort);
  if (mode == "timed") code = play_timed(node, what);
  if (mode == "step") code = play(node, what, Delivery::kKeepAll);
  if (mode == "lossy") code = play(node, what, Delivery::kKeepOne);
  dds_delete(node);
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr
        << "ros2_node publish|wrong|poses|mount|record|endpoints|play|timed|step|lossy DOMAIN "
           "N|Z|FILE|BAG\n";
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

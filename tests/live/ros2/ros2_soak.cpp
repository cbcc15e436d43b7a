// A robot that drives for days, faster than time, and has bad luck: the laps of a bag one after the
// other, with faults at random, by Cyclone DDS. Ends by itself, the last minute without faults, and
// writes what it did and heard, as JSON.
//
//   ros2_soak DOMAIN BAG SECONDS SPEED SEED
//
// BAG is of a motion that ends as it begins. SECONDS are of the wall, SPEED is how much faster than
// that the robot drives. Faults go to stderr, with the stamps of the messages.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include <dds/dds.h>
#include <nlohmann/json.hpp>

#include "ros2_publishing.hpp"

namespace {

using namespace viwo::testing::ros2;

constexpr double kFaultsPerMessage = 1e-3;
constexpr double kFaultsPerSecond = 1. / 60., kSetBackPerSecond = 1. / 1200.;
constexpr std::int64_t kCalmNs = 60 * kSecond;  ///< at the end

class Soak {
 public:
  Soak(dds_entity_t node, const RobotBag& robot, std::uint32_t seed)
      : node_(node),
        random_(seed),
        odometry_(node, nav_msgs_msg_dds__Odometry__desc, "/viwo/odometry"),
        diagnostics_(node, diagnostic_msgs_msg_dds__DiagnosticArray__desc, "/diagnostics") {
    for (const RobotBag::Topic& topic : robot.topics()) outlets_.push_back({.topic = topic});
    for (Outlet& outlet : outlets_) open(outlet);
    robot.read([this](std::size_t topic, const Message& message, std::int64_t since_begin_ns) {
      lap_.push_back({topic, message, since_begin_ns});
    });
    // A lap ends where the next sample of the IMU would be.
    std::vector<std::int64_t> imu;
    for (const Played& played : lap_) {
      if (std::holds_alternative<viwo::ImuSample>(played.message)) imu.push_back(played.since_ns);
    }
    lap_ns_ = kSecond * ((imu.back() - imu.front() + kSecond / 2) / kSecond);
  }

  nlohmann::json run(double seconds, double speed) {
    for (const Outlet& outlet : outlets_) outlet.writer->wait_for_reader();
    dds_sleepfor(DDS_MSECS(500));
    const auto begin = Clock::now();
    const auto last_ns = static_cast<std::int64_t>(1e9 * seconds * speed);
    for (std::int64_t lap = 0; now_ns_ < last_ns; ++lap) {
      for (const Played& played : lap_) {
        if (played.since_ns >= lap_ns_) break;  // what the next lap begins with
        now_ns_ = lap * lap_ns_ + played.since_ns;
        if (now_ns_ >= last_ns) break;
        const auto due = std::chrono::nanoseconds(
            static_cast<std::int64_t>(static_cast<double>(now_ns_) / speed));
        std::this_thread::sleep_until(begin + due);
        has_faults_ = now_ns_ < last_ns - kCalmNs;
        happen();
        send(played, lap * lap_ns_ - set_back_ns_);
        hear();
      }
    }
    dds_sleepfor(DDS_MSECS(1000));
    hear();
    return {{"data_s", 1e-9 * static_cast<double>(now_ns_)},
            {"faults", faults_},
            {"odometry", heard_},
            {"odometry_age_s", 1e-9 * static_cast<double>(newest_ns_ - heard_ns_)},
            {"last_level", level_},
            {"last_message", text_},
            {"started_anew", started_anew_}};
  }

 private:
  struct Played {
    std::size_t topic;
    Message message;
    std::int64_t since_ns;
  };
  struct Outlet {
    RobotBag::Topic topic;
    std::unique_ptr<Writer> writer = nullptr;
    std::int64_t silent_until_ns = 0, gone_until_ns = 0, dark_until_ns = 0;
    std::unique_ptr<Message> held = nullptr;  ///< comes behind the next
  };

  void open(Outlet& outlet) {
    outlet.writer = std::make_unique<Writer>(node_, descriptor_of(outlet.topic.kind),
                                             outlet.topic.name, Delivery::kBestEffort);
  }

  bool chance(double probability) {
    return std::uniform_real_distribution(0., 1.)(random_) < probability;
  }
  std::int64_t between(double least_s, double most_s) {
    return static_cast<std::int64_t>(1e9 *
                                     std::uniform_real_distribution(least_s, most_s)(random_));
  }
  std::size_t one_of(std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random_);
  }
  void count(const char* fault, const std::string& of = "robot") {
    ++faults_[fault];
    std::cerr << 1e-9 * static_cast<double>(newest_ns_) << " s: " << of << ": " << fault << "\n";
  }

  /// What happens to the robot by now.
  void happen() {
    for (Outlet& outlet : outlets_) {
      if (outlet.writer == nullptr && now_ns_ >= outlet.gone_until_ns) open(outlet);
    }
    const double passed_s = 1e-9 * static_cast<double>(now_ns_ - std::exchange(seen_ns_, now_ns_));
    if (!has_faults_) return;
    if (chance(kSetBackPerSecond * passed_s)) {
      count("clock set back");
      set_back_ns_ += between(10., 200.);
    }
    if (!chance(kFaultsPerSecond * passed_s)) return;
    Outlet& outlet = outlets_[one_of(outlets_.size())];
    switch (one_of(4)) {
      case 0:
        count("topic silent", outlet.topic.name);
        outlet.silent_until_ns = now_ns_ + between(0.1, 20.);
        break;
      case 1:
        count("publisher gone", outlet.topic.name);
        outlet.writer.reset();
        outlet.gone_until_ns = now_ns_ + between(0.5, 10.);
        break;
      case 2:
        count("dark");
        for (Outlet& each : outlets_) each.dark_until_ns = now_ns_ + between(0.1, 10.);
        break;
      default:
        count("robot hangs, then sends all at once");
        std::this_thread::sleep_for(std::chrono::nanoseconds(between(0.05, 0.5)));
    }
  }

  void send(const Played& played, std::int64_t shift_ns) {
    Outlet& outlet = outlets_[played.topic];
    Message message = played.message;
    newest_ns_ = stamp_ns(message) += shift_ns;
    if (outlet.writer == nullptr || now_ns_ < outlet.silent_until_ns) return;
    if (now_ns_ < outlet.dark_until_ns) darken(message);
    const bool is_faulty = has_faults_ && chance(kFaultsPerMessage);
    if (is_faulty && break_it(outlet, message)) return;
    write(*outlet.writer, message);
    if (outlet.held != nullptr) write(*outlet.writer, *std::exchange(outlet.held, nullptr));
  }

  static void darken(Message& message) {
    if (auto* picture = std::get_if<Picture>(&message)) {
      std::fill(picture->pixels.begin(), picture->pixels.end(), std::uint8_t{0});
    }
  }

  /// Whether the message is not to be sent.
  bool break_it(Outlet& outlet, Message& message) {
    switch (one_of(7)) {
      case 0:
        count("message lost", outlet.topic.name);
        return true;
      case 1:
        count("message late", outlet.topic.name);
        outlet.held = std::make_unique<Message>(message);
        return true;
      case 2:
        count("message twice", outlet.topic.name);
        write(*outlet.writer, message);
        break;
      case 3:
        count("stamp in the future", outlet.topic.name);
        stamp_ns(message) += 3600 * kSecond;
        break;
      case 4:
        count("no stamp", outlet.topic.name);
        stamp_ns(message) = 0;
        break;
      case 5:
        count("not a number", outlet.topic.name);
        spoil(message, std::numeric_limits<double>::quiet_NaN());
        break;
      default:
        count("absurd value", outlet.topic.name);
        spoil(message, 1e6);
    }
    return false;
  }

  /// One value of it; of an image the end of its pixels.
  void spoil(Message& message, double value) {
    if (auto* imu = std::get_if<viwo::ImuSample>(&message)) {
      (chance(0.5) ? imu->gyro_rad_per_s : imu->accel_m_per_s2)[one_of(3)] = value;
    } else if (auto* joints = std::get_if<viwo::bag::Joints>(&message)) {
      auto& values = chance(0.5) ? joints->positions : joints->velocities;
      if (!values.empty()) values[one_of(values.size())] = value;
    } else {
      auto& pixels = std::get<Picture>(message).pixels;
      pixels.resize(pixels.size() / 2);
    }
  }

  void hear() {
    odometry_.read([this](const nav_msgs_msg_dds__Odometry_& m) {
      ++heard_;
      heard_ns_ = stamp_of(m.header);
    });
    diagnostics_.read([this](const diagnostic_msgs_msg_dds__DiagnosticArray_& m) {
      if (m.status._length == 0) return;
      const auto& status = m.status._buffer[0];
      level_ = status.level;
      text_ = status.message;
      for (std::uint32_t i = 0; i < status.values._length; ++i) {
        if (std::strcmp(status.values._buffer[i].key, "started anew") == 0) {
          started_anew_ = std::atoi(status.values._buffer[i].value);
        }
      }
    });
  }

  dds_entity_t node_;
  std::mt19937 random_;
  Reader<nav_msgs_msg_dds__Odometry_> odometry_;
  Reader<diagnostic_msgs_msg_dds__DiagnosticArray_> diagnostics_;
  std::vector<Outlet> outlets_;
  std::vector<Played> lap_;
  std::int64_t lap_ns_ = 0;
  std::int64_t now_ns_ = 0, seen_ns_ = 0;  ///< since the begin, as if no clock were set back
  std::int64_t newest_ns_ = 0;             ///< stamp of what was sent last
  std::int64_t set_back_ns_ = 0;
  bool has_faults_ = true;
  std::map<std::string, int> faults_;
  std::int64_t heard_ns_ = 0;
  int heard_ = 0, level_ = -1, started_anew_ = 0;
  std::string text_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6) {
    std::cerr << "ros2_soak DOMAIN BAG SECONDS SPEED SEED\n";
    return 2;
  }
  try {
    const dds_entity_t node =
        dds_create_participant(static_cast<dds_domainid_t>(std::stoi(argv[1])), nullptr, nullptr);
    require(node, "participant");
    Soak soak(node, RobotBag(argv[2]), static_cast<std::uint32_t>(std::stoi(argv[5])));
    std::cout << soak.run(std::stod(argv[3]), std::stod(argv[4])).dump(2) << "\n";
    dds_delete(node);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "ros2_soak: " << error.what() << "\n";
    return 1;
  }
}

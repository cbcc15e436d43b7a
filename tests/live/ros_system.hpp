// A ROS 1 system on this machine's loopback, for one test program.
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "child.hpp"

namespace viwo::testing {

/// Has a port of this machine for itself.
class LocalSocket {
 public:
  LocalSocket() : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    const sockaddr_in any = loopback(0);
    bind(socket_, reinterpret_cast<const sockaddr*>(&any), sizeof(any));
  }
  ~LocalSocket() { close(socket_); }
  LocalSocket(const LocalSocket&) = delete;
  LocalSocket& operator=(const LocalSocket&) = delete;

  std::uint16_t port() const {
    sockaddr_in address{};
    socklen_t size = sizeof(address);
    getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size);
    return ntohs(address.sin_port);
  }
  /// From now on who calls is taken, and told nothing.
  void listen_and_say_nothing() const { listen(socket_, 16); }

  static sockaddr_in loopback(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(port);
    return address;
  }

 private:
  int socket_;
};

/// A master at a free port, and the environment that nodes find it in; a temporary folder for what
/// ROS writes. A process belongs to one master for good, so there is one for all its tests.
class RosSystem {
 public:
  RosSystem() {
    std::string pattern = (std::filesystem::temp_directory_path() / "viwo_ros_XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
    folder_ = pattern;
    const std::string port = std::to_string(free_port());
    uri_ = "http://127.0.0.1:" + port;
    setenv("ROS_MASTER_URI", uri_.c_str(), 1);
    setenv("ROS_HOSTNAME", "127.0.0.1", 1);
    unsetenv("ROS_IP");
    setenv("ROS_LOG_DIR", folder_.c_str(), 1);
    setenv("HOME", folder_.c_str(), 1);
    master_ = std::make_unique<Child>(std::vector<std::string>{"rosmaster", "--core", "-p", port},
                                      (folder_ / "rosmaster.log").string());
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!listens(static_cast<std::uint16_t>(std::stoi(port)))) {
      if (std::chrono::steady_clock::now() > deadline) throw std::runtime_error("no rosmaster");
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }
  ~RosSystem() {
    master_.reset();
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  const std::string& uri() const { return uri_; }
  std::string file(const std::string& name) const { return (folder_ / name).string(); }
  void kill_master() { master_.reset(); }

  static bool is_installed() { return std::system("command -v rosmaster > /dev/null") == 0; }

  /// A port that nothing listens at.
  static std::uint16_t free_port() { return LocalSocket().port(); }

 private:
  static bool listens(std::uint16_t port) {
    const int s = socket(AF_INET, SOCK_STREAM, 0);
    const sockaddr_in address = LocalSocket::loopback(port);
    const bool yes = connect(s, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
    close(s);
    return yes;
  }

  std::filesystem::path folder_;
  std::string uri_;
  std::unique_ptr<Child> master_;
};

/// Tests that need the system; skipped where ROS has no master.
class LiveTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (RosSystem::is_installed()) ros_ = std::make_unique<RosSystem>();
  }
  static void TearDownTestSuite() { ros_.reset(); }
  void SetUp() override {
    if (!ros_) GTEST_SKIP() << "rosmaster is not installed (apt-get install python3-rosmaster)";
  }

  static inline std::unique_ptr<RosSystem> ros_;
};

}  // namespace viwo::testing

// A domain of DDS on this machine's loopback, for one test program: without multicast, by addresses
// alone, on both sides.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "child.hpp"

namespace viwo::testing {

/// Takes a domain that no other test of this machine has, a temporary folder, and the environment
/// in which Cyclone DDS stays on 127.0.0.1.
class DdsSystem {
 public:
  DdsSystem() {
    std::string pattern = (std::filesystem::temp_directory_path() / "viwo_dds_XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
    folder_ = pattern;
    for (domain_ = 1; !take(); ++domain_) {
      if (domain_ == 90) throw std::runtime_error("no free domain");
    }
    setenv("CYCLONEDDS_URI",
           "<CycloneDDS><Domain Id='any'><General><Interfaces>"
           "<NetworkInterface address='127.0.0.1' multicast='false'/></Interfaces>"
           "<AllowMulticast>false</AllowMulticast></General>"
           "<Discovery><LeaseDuration>2s</LeaseDuration><ParticipantIndex>auto</ParticipantIndex>"
           "<MaxAutoParticipantIndex>20</MaxAutoParticipantIndex>"
           "<Peers><Peer address='127.0.0.1'/></Peers></Discovery></Domain></CycloneDDS>",
           1);
    for (const char* name :
         {"ROS_DOMAIN_ID", "ROS_LOCALHOST_ONLY", "ROS_AUTOMATIC_DISCOVERY_RANGE"}) {
      unsetenv(name);
    }
  }
  ~DdsSystem() {
    close(lock_);
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  std::string domain() const { return std::to_string(domain_); }
  /// Parameters of ros2_topics.
  std::string parameters() const {
    return "domain_id: " + domain() + ", interfaces: [127.0.0.1], peers: [127.0.0.1]";
  }
  std::string file(const std::string& name) const { return (folder_ / name).string(); }
  std::string text_of(const std::string& name) const {
    std::ifstream in(file(name));
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::vector<std::string> node(const std::string& mode, const std::string& what) const {
    return {VIWO_TEST_ROS2_NODE, mode, domain(), what};
  }

 private:
  /// A domain is a range of UDP ports; who has the same port of TCP has the domain.
  bool take() {
    lock_ = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * domain_));
    if (bind(lock_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0 &&
        listen(lock_, 1) == 0) {
      return true;
    }
    close(lock_);
    return false;
  }

  std::filesystem::path folder_;
  int domain_ = 1;
  int lock_ = -1;
};

/// Tests that need the other DDS; skipped where it is not installed.
class DdsTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (*VIWO_TEST_ROS2_NODE != '\0') dds_ = std::make_unique<DdsSystem>();
  }
  static void TearDownTestSuite() { dds_.reset(); }
  void SetUp() override {
    if (!dds_) {
      GTEST_SKIP() << "built without Cyclone DDS (apt-get install cyclonedds-dev cyclonedds-tools)";
    }
  }

  static inline std::unique_ptr<DdsSystem> dds_;
};

}  // namespace viwo::testing

#include "dds_settings.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string_view>

#include <arpa/inet.h>
#include <ifaddrs.h>

#include "viwo/api/status.hpp"
#include "viwo/log/text.hpp"

namespace viwo::ros2 {
namespace {

constexpr std::int64_t kMaxDomain = 232;

std::string_view environment(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? std::string_view() : std::string_view(value);
}

void check_addresses(const char* key, const std::vector<std::string>& addresses) {
  for (const std::string& address : addresses) {
    in_addr ignored{};
    if (inet_pton(AF_INET, address.c_str(), &ignored) == 1) continue;
    throw ParamError(key, log::quoted(address) + " is no address such as 192.168.1.7");
  }
}

/// Those of IPv4.
std::vector<std::string> addresses_of_this_machine() {
  std::vector<std::string> all;
  ifaddrs* first = nullptr;
  if (getifaddrs(&first) != 0) return all;
  for (const ifaddrs* at = first; at != nullptr; at = at->ifa_next) {
    if (at->ifa_addr == nullptr || at->ifa_addr->sa_family != AF_INET) continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    const auto* const address = reinterpret_cast<const sockaddr_in*>(at->ifa_addr);
    if (inet_ntop(AF_INET, &address->sin_addr, text.data(), text.size()) != nullptr) {
      all.emplace_back(text.data());
    }
  }
  freeifaddrs(first);
  return all;
}

/// DDS leaves out what is not there, and a run would listen to nothing.
void check_interfaces(const std::vector<std::string>& interfaces) {
  if (interfaces.empty()) return;
  const auto there = addresses_of_this_machine();
  for (const std::string& address : interfaces) {
    if (there.empty() || std::find(there.begin(), there.end(), address) != there.end()) continue;
    std::string known;
    for (const std::string& other : there) known += (known.empty() ? "" : ", ") + other;
    throw ParamError("interfaces",
                     address + " is no address of this machine - there are: " + known);
  }
}

std::uint32_t domain_of_environment() {
  const std::string_view text = environment("ROS_DOMAIN_ID");
  if (text.empty()) return 0;
  const auto domain = log::parse_integer(text);
  if (!domain || *domain < 0 || *domain > kMaxDomain) {
    throw InputError("the environment's ROS_DOMAIN_ID is " + log::quoted(text) +
                     ": expected a number from 0 to " + std::to_string(kMaxDomain));
  }
  return static_cast<std::uint32_t>(*domain);
}

/// ROS 2 lets the first of the two win. ROS_STATIC_PEERS is not looked at: 'peers' has them.
bool is_only_this_machine() {
  if (environment("ROS_LOCALHOST_ONLY") == "1") return true;
  const std::string_view range = environment("ROS_AUTOMATIC_DISCOVERY_RANGE");
  if (range == "OFF") {
    throw InputError(
        "the environment's ROS_AUTOMATIC_DISCOVERY_RANGE is OFF: nobody would be found; LOCALHOST "
        "or SUBNET, or 'interfaces' that the parameters give");
  }
  if (!range.empty() && range != "LOCALHOST" && range != "SUBNET" && range != "SYSTEM_DEFAULT") {
    throw InputError("the environment's ROS_AUTOMATIC_DISCOVERY_RANGE is " + log::quoted(range) +
                     ": expected LOCALHOST, SUBNET or SYSTEM_DEFAULT");
  }
  return range == "LOCALHOST";
}

}  // namespace

DdsSettings DdsParams::settings() const {
  check_addresses("interfaces", interfaces);
  check_interfaces(interfaces);
  check_addresses("peers", peers);
  DdsSettings settings;
  settings.domain = domain_id < 0 ? domain_of_environment() : static_cast<std::uint32_t>(domain_id);
  settings.interfaces = interfaces;
  settings.peers = peers;
  if (interfaces.empty() && is_only_this_machine()) {
    // Loopback may have no multicast, and ROS 2 uses none there.
    settings.interfaces = {"127.0.0.1"};
    settings.peers.emplace_back("127.0.0.1");
  }
  return settings;
}

}  // namespace viwo::ros2

// Where on the network a ROS 2 system is: from parameters, and from the environment as ROS 2 has
// it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "viwo/api/params.hpp"

namespace viwo::ros2 {

struct DdsSettings {
  std::uint32_t domain = 0;
  std::vector<std::string> interfaces;  ///< addresses of this machine; empty: all
  std::vector<std::string> peers;       ///< addresses that are asked; empty: multicast
};

struct DdsParams {
  int domain_id = -1;
  std::vector<std::string> interfaces;
  std::vector<std::string> peers;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(domain_id),
      {.min = -1., .max = 232., .help = "of DDS; -1: the environment's ROS_DOMAIN_ID, or else 0"});
    b(VIWO_PARAM(interfaces),
      {.help =
           "addresses (IPv4) of this machine that are used; none: all, or 127.0.0.1 alone where "
           "the environment has ROS_LOCALHOST_ONLY=1 or "
           "ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST"});
    b(VIWO_PARAM(peers),
      {.help =
           "addresses (IPv4) of machines that are asked for topics, instead of by multicast; this "
           "machine itself where it is to be the only one"});
  }
  /// With what the environment says. ParamError, or InputError for what is wrong there.
  DdsSettings settings() const;
};

}  // namespace viwo::ros2

// The ROS master: whether it is there, and this process as a node of it.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace viwo::ros1 {

struct MasterAddress {
  std::string uri;
  std::string host;
  std::uint16_t port = 0;
};

/// Of `uri`; if that is empty, of the environment's ROS_MASTER_URI, or else of this machine's
/// default. InputError when it is not http://HOST:PORT.
MasterAddress master_address(const std::string& uri);

/// Whether a ROS master answers a call at the address. Takes no longer than `timeout` (and the name
/// service).
bool answers(const MasterAddress& master, std::chrono::milliseconds timeout);

/// Makes this process a node of the master, once; a process belongs to one master for good, and all
/// sensors in it share the node. Waits for a master for `timeout`. InputError when there is none,
/// or when the process belongs to another one.
void join(const MasterAddress& master, std::chrono::milliseconds timeout);

}  // namespace viwo::ros1

#include "master.hpp"

#include <array>
#include <cstdlib>
#include <regex>
#include <string_view>
#include <thread>

#include <boost/asio/ip/tcp.hpp>
#include <ros/ros.h>

#include "viwo/api/status.hpp"
#include "viwo/log/text.hpp"

namespace viwo::ros1 {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kProbe = 2s;
constexpr auto kRetry = 100ms;

[[noreturn]] void fail_without_master(const MasterAddress& master) {
  throw InputError("no ROS master at " + master.uri + ": is roscore running?");
}

}  // namespace

MasterAddress master_address(const std::string& uri) {
  MasterAddress master;
  master.uri = uri;
  std::string source = "master_uri";
  if (master.uri.empty()) {
    const char* const environment = std::getenv("ROS_MASTER_URI");
    master.uri =
        environment != nullptr && *environment != '\0' ? environment : "http://localhost:11311";
    source = "the environment's ROS_MASTER_URI";
  }
  static const std::regex form("http://([^/:]+):([0-9]{1,5})/?");
  std::smatch parts;
  if (std::regex_match(master.uri, parts, form)) {
    master.host = parts[1];
    const auto port = log::parse_integer(parts[2].str());
    if (port && *port > 0 && *port <= UINT16_MAX) {
      master.port = static_cast<std::uint16_t>(*port);
      return master;
    }
  }
  throw InputError(source + " is " + log::quoted(master.uri) + ": expected http://HOST:PORT");
}

bool answers(const MasterAddress& master, std::chrono::milliseconds timeout) {
  const std::string call =
      "<?xml version=\"1.0\"?><methodCall><methodName>getPid</methodName><params><param>"
      "<value><string>/viwo</string></value></param></params></methodCall>";
  boost::asio::ip::tcp::iostream connection;
  connection.expires_after(timeout);
  connection.connect(master.host, std::to_string(master.port));
  connection << "POST /RPC2 HTTP/1.0\r\nHost: " << master.host << "\r\nContent-Type: text/xml\r\n"
             << "Content-Length: " << call.size() << "\r\n\r\n"
             << call << std::flush;
  std::array<char, 12> begin{};  // HTTP/1.x 200
  connection.read(begin.data(), begin.size());
  const std::string_view answer(begin.data(), begin.size());
  return connection && answer.starts_with("HTTP/") && answer.ends_with(" 200");
}

void join(const MasterAddress& master, std::chrono::milliseconds timeout) {
  // Asked before ROS is: what listens nowhere, at a machine that does not answer, or without ever
  // saying anything, makes roscpp wait for minutes or for ever.
  const auto deadline = Clock::now() + timeout;
  while (!answers(master, kProbe)) {
    if (Clock::now() >= deadline) fail_without_master(master);
    std::this_thread::sleep_for(kRetry);
  }
  if (!ros::isInitialized()) {
    ros::init(ros::M_string{{"__master", master.uri}}, "viwo",
              ros::init_options::AnonymousName | ros::init_options::NoSigintHandler |
                  ros::init_options::NoRosout);
  } else if (ros::master::getHost() != master.host || ros::master::getPort() != master.port) {
    throw InputError("sensors of one run listen to one ROS master: " + ros::master::getURI() +
                     " and " + master.uri);
  }
  if (!ros::master::check()) fail_without_master(master);
  // So that a master that vanishes does not hold calls for ever.
  ros::master::setRetryTimeout(ros::WallDuration(1.));
  // Started here and not by the first NodeHandle, the last of which would end it for good.
  if (!ros::isStarted()) ros::start();
}

}  // namespace viwo::ros1

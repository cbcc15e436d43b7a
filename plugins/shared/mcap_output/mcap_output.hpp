// The estimate of a run as ROS 2 messages in an MCAP file: what live topics get, and tracks and
// calibration for viewers.
#pragma once

#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "estimate_messages.hpp"
#include "mcap_writer.hpp"
#include "viwo/log/estimate_log.hpp"

namespace viwo::live {

/// Written chunk by chunk as it comes: when the process is killed, readers have all chunks before.
class McapOutput final : public log::EstimateLog {
 public:
  /// std::runtime_error for a file that cannot be written, or was written by others.
  explicit McapOutput(const std::filesystem::path& file);

  void write(const EstimateSample& estimate, std::span<const log::SeenImage> images) override;
  void close(const std::string& failure, const std::vector<std::string>& warnings) override;

 private:
  void put(const std::string& topic, const std::string& type, const bag::Bytes& message);
  void put_path();
  void put_diagnostics(Diagnostics diagnostics, bool always);

  bag::mcap::Writer out_;
  std::map<std::string, std::uint16_t> channels_;
  std::int64_t t_ns_ = 0;  ///< of the epoch
  Path path_;
  int path_taken_ = 0;  ///< poses since the path was written
  Diagnostics diagnostics_;
  double diagnosed_s_ = -std::numeric_limits<double>::infinity();
  std::string diagnosed_;
};

}  // namespace viwo::live

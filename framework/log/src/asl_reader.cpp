#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "viwo/log/asl.hpp"
#include "viwo/log/table_reader.hpp"

namespace viwo::log {
namespace {

std::filesystem::path table_file(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_directory(path, ignored) ? path / "data.csv" : path;
}

std::size_t stamp_column(const TableReader& table) {
  for (const char* name : {"timestamp [ns]", "timestamp"}) {
    if (table.has_column(name)) return table.column(name);
  }
  return table.column("timestamp_ns");
}

/// Columns prefix_1, prefix_2, ... as far as the file has them.
std::vector<std::size_t> channel_columns(const TableReader& table, const std::string& prefix,
                                         const char* unit, std::size_t at_least,
                                         std::size_t at_most) {
  std::size_t n = 0;
  for (const std::string& name : table.columns()) n += name.starts_with(prefix) ? 1 : 0;
  if (n > at_most) {
    table.reader().fail(std::to_string(n) + " columns '" + prefix + "...', at most " +
                        std::to_string(at_most) + " are possible");
  }
  std::vector<std::size_t> columns;
  for (std::size_t i = 1; i <= std::max(n, at_least); ++i) {
    columns.push_back(table.column(prefix + std::to_string(i), unit));
  }
  return columns;
}

}  // namespace

EncoderRecording read_asl_encoders(const std::filesystem::path& path,
                                   const EncoderRecordingOptions& options) {
  TableReader table(table_file(path));
  const std::size_t stamp = stamp_column(table);
  const auto drives =
      channel_columns(table, "drive_", options.drive_is_angle ? "rad" : "rad/s", 1, kMaxDrives);
  const auto steers = channel_columns(table, "steer_", "rad", 0, kMaxSteers);
  EncoderCollector collector(options);
  EncoderReading reading;
  reading.n_drive = static_cast<int>(drives.size());
  reading.n_steer = static_cast<int>(steers.size());
  while (table.next()) {
    reading.t_ns = table.stamp_ns(stamp);
    for (std::size_t i = 0; i < drives.size(); ++i) reading.drive[i] = table.number(drives[i]);
    for (std::size_t i = 0; i < steers.size(); ++i) reading.steer_rad[i] = table.number(steers[i]);
    collector.add(reading, table.reader());
  }
  return collector.finish(table.reader());
}

PoseRecording read_asl_poses(const std::filesystem::path& path, const LogLimits& limits) {
  TableReader table(table_file(path));
  const std::size_t stamp = stamp_column(table);
  const std::array<std::size_t, 3> p = {
      table.column("p_RS_R_x", "m"), table.column("p_RS_R_y", "m"), table.column("p_RS_R_z", "m")};
  const std::array<std::size_t, 4> q = {table.column("q_RS_x", ""), table.column("q_RS_y", ""),
                                        table.column("q_RS_z", ""), table.column("q_RS_w", "")};
  PoseCollector collector(limits);
  while (table.next()) {
    PoseSample pose;
    pose.t_ns = table.stamp_ns(stamp);
    for (std::size_t i = 0; i < p.size(); ++i) pose.p_BinW_m[i] = table.number(p[i]);
    for (std::size_t i = 0; i < q.size(); ++i) pose.q_BtoW_xyzw[i] = table.number(q[i]);
    collector.add(pose, table.reader());
  }
  return collector.finish(table.reader());
}

}  // namespace viwo::log

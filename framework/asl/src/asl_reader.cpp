#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "viwo/asl/asl.hpp"
#include "viwo/asl/asl_columns.hpp"
#include "viwo/log/stamp_filter.hpp"
#include "viwo/log/table_reader.hpp"
#include "viwo/log/text.hpp"

namespace viwo::log {
namespace {

constexpr const char* kPosesAlone = " (the poses alone are read by asl_pose)";

std::filesystem::path table_file(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_directory(path, ignored) ? table_in(path, "data.csv") : path;
}

/// Columns prefix_1, prefix_2, ... as far as the file has them; in any unit when they are scaled.
std::vector<std::size_t> channel_columns(const TableReader& table, const std::string& prefix,
                                         const char* unit, const std::vector<double>& scale,
                                         std::size_t at_least, std::size_t at_most) {
  std::size_t n = 0;
  for (const std::string& name : table.columns()) n += name.starts_with(prefix) ? 1 : 0;
  if (n > at_most) {
    table.reader().fail(std::to_string(n) + " columns '" + prefix + "...', at most " +
                        std::to_string(at_most) + " are possible");
  }
  std::vector<std::size_t> columns;
  for (std::size_t i = 1; i <= std::max(n, at_least); ++i) {
    const std::string name = prefix + std::to_string(i);
    columns.push_back(scale.empty() ? table.column(name, unit) : table.column_in_any_unit(name));
  }
  return columns;
}

std::array<std::size_t, 3> xyz_columns(const TableReader& table, const std::string& prefix,
                                       const char* unit) {
  return {table.column(prefix + "x", unit), table.column(prefix + "y", unit),
          table.column(prefix + "z", unit)};
}

std::array<std::size_t, 4> xyzw_columns(const TableReader& table) {
  return {table.column("q_RS_x", ""), table.column("q_RS_y", ""), table.column("q_RS_z", ""),
          table.column("q_RS_w", "")};
}

/// Calls `row` at each row; those that cannot be read are counted by `counter`.
template <class Counter, class Row>
void read_rows(TableReader& table, Counter& counter, Row&& row) {
  table.for_each_row(row, [&](const BadRow& bad) { counter.reject_row(bad, table.reader()); });
}

template <std::size_t N>
void read_numbers(const TableReader& table, const std::array<std::size_t, N>& columns,
                  std::array<double, N>& out) {
  for (std::size_t i = 0; i < N; ++i) out[i] = table.number(columns[i]);
}

/// What is not finite is a BadRow that names its column; `advice` stands behind it.
template <std::size_t N>
void read_finite(const TableReader& table, const std::array<std::size_t, N>& columns,
                 const char* advice, std::array<double, N>& out) {
  read_numbers(table, columns, out);
  for (std::size_t i = 0; i < N; ++i) {
    if (std::isfinite(out[i])) continue;
    table.fail(columns[i], quoted(table.text(columns[i])) + " is not finite" + advice);
  }
}

/// InputError for drives in the unit of the other kind of reading.
void check_drive_input(const TableReader& table, bool is_angle) {
  const std::string rate = "drive_1 [rad/s]", angle = "drive_1 [rad]";
  const auto& wanted = is_angle ? angle : rate;
  const auto& other = is_angle ? rate : angle;
  if (table.has_column(wanted) || !table.has_column(other)) return;
  table.reader().fail("column '" + other + "' has another unit than '" + wanted +
                      "': it is read with drive_input: " + (is_angle ? "rate" : "angle"));
}

}  // namespace

EncoderRecording read_asl_encoders(const std::filesystem::path& path,
                                   const EncoderRecordingOptions& options) {
  TableReader table(table_file(path));
  const std::size_t stamp = stamp_column(table);
  const JointParams& joints = options.joints;
  if (joints.drive_scale.empty()) check_drive_input(table, options.drive_is_angle);
  const auto drives = channel_columns(table, "drive_", options.drive_is_angle ? "rad" : "rad/s",
                                      joints.drive_scale, 1, kMaxDrives);
  const auto steers = channel_columns(table, "steer_", "rad", joints.steer_scale, 0, kMaxSteers);
  EncoderCollector collector(options, drives.size(), steers.size());
  EncoderReading reading;
  reading.n_drive = static_cast<int>(drives.size());
  reading.n_steer = static_cast<int>(steers.size());
  read_rows(table, collector, [&] {
    reading.t_ns = table.stamp_ns(stamp);
    for (std::size_t i = 0; i < drives.size(); ++i) reading.drive[i] = table.number(drives[i]);
    for (std::size_t i = 0; i < steers.size(); ++i) reading.steer_rad[i] = table.number(steers[i]);
    collector.add(reading, table.reader());
  });
  return collector.finish(table.reader());
}

PoseRecording read_asl_poses(const std::filesystem::path& path, const LogLimits& limits) {
  TableReader table(table_file(path));
  const std::size_t stamp = stamp_column(table);
  const auto p = xyz_columns(table, "p_RS_R_", "m");
  const auto q = xyzw_columns(table);
  PoseCollector collector(limits);
  read_rows(table, collector, [&] {
    PoseSample pose;
    pose.t_ns = table.stamp_ns(stamp);
    read_numbers(table, p, pose.p_BinW_m);
    read_numbers(table, q, pose.q_BtoW_xyzw);
    collector.add(pose, table.reader());
  });
  return collector.finish(table.reader());
}

StateRecording read_asl_states(const std::filesystem::path& path, const LogLimits& limits) {
  TableReader table(table_file(path));
  const std::size_t stamp = stamp_column(table);
  const auto p = xyz_columns(table, "p_RS_R_", "m");
  const auto q = xyzw_columns(table);
  const auto v = xyz_columns(table, "v_RS_R_", "m s^-1");
  const auto gyro_bias = xyz_columns(table, "b_w_RS_S_", "rad s^-1");
  const auto accel_bias = xyz_columns(table, "b_a_RS_S_", "m s^-2");
  StateCollector collector(limits);
  read_rows(table, collector, [&] {
    StateSample state;
    state.t_ns = table.stamp_ns(stamp);
    read_finite(table, q, "", state.q_ItoG_xyzw);
    read_finite(table, p, "", state.p_IinG_m);
    read_finite(table, v, kPosesAlone, state.v_IinG_m_per_s);
    read_finite(table, gyro_bias, kPosesAlone, state.gyro_bias_rad_per_s);
    read_finite(table, accel_bias, kPosesAlone, state.accel_bias_m_per_s2);
    collector.add(state, table.reader());
  });
  return collector.finish(table.reader());
}

ImuRecording read_asl_imu(const std::filesystem::path& path, const LogLimits& limits) {
  TableReader table(table_file(path));
  const std::size_t stamp = stamp_column(table);
  const auto gyro = xyz_columns(table, "w_RS_S_", "rad s^-1");
  const auto accel = xyz_columns(table, "a_RS_S_", "m s^-2");
  ImuCollector collector(limits);
  read_rows(table, collector, [&] {
    ImuSample imu;
    imu.t_ns = table.stamp_ns(stamp);
    read_numbers(table, gyro, imu.gyro_rad_per_s);
    read_numbers(table, accel, imu.accel_m_per_s2);
    collector.add(imu, table.reader());
  });
  return collector.finish(table.reader());
}

GnssRecording read_asl_gnss(const std::filesystem::path& path, double max_rejected_fraction) {
  TableReader table(table_file(path));
  const std::size_t stamp = stamp_column(table);
  const std::size_t latitude = table.column("latitude", "deg");
  const std::size_t longitude = table.column("longitude", "deg");
  const std::size_t altitude = table.column("altitude", "m");
  std::array<std::size_t, 9> covariance{};
  for (std::size_t i = 0; i < covariance.size(); ++i) {
    const std::string entry{"ENU"[i / 3], "ENU"[i % 3]};
    covariance[i] = table.column("cov_" + entry, "m^2");
  }
  GnssCollector collector({std::numeric_limits<double>::infinity(), max_rejected_fraction});
  read_rows(table, collector, [&] {
    GnssSample fix;
    fix.t_ns = table.stamp_ns(stamp);
    fix.latitude_deg = table.number(latitude);
    fix.longitude_deg = table.number(longitude);
    fix.altitude_m = table.number(altitude);
    read_numbers(table, covariance, fix.covariance_ENU_m2);
    collector.add(fix, table.reader());
  });
  return collector.finish(table.reader());
}

int camera_index(const TableReader& table, std::size_t column) {
  const std::int64_t camera = table.integer(column);
  if (camera < 0 || camera > kMaxCamera) {
    table.fail(column, quoted(table.text(column)) + " is no camera: they are counted from 0 to " +
                           std::to_string(kMaxCamera));
  }
  return static_cast<int>(camera);
}

FeatureRecording read_asl_features(const std::filesystem::path& path, const LogLimits& limits) {
  TableReader table(table_file(path));
  const std::size_t stamp = stamp_column(table);
  const std::size_t camera = table.column("camera");
  const std::size_t id = table.column("id");
  const std::size_t u = table.column("u", "px");
  const std::size_t v = table.column("v", "px");
  FeatureCollector collector(limits);
  read_rows(table, collector, [&] {
    const std::int64_t t_ns = table.stamp_ns(stamp);
    const int index = camera_index(table, camera);
    if (table.text(id).empty() && table.text(u).empty() && table.text(v).empty()) {
      collector.add_image(t_ns, index, table.reader());
    } else {
      const FeaturePoint point{table.integer(id), table.number(u), table.number(v)};
      collector.add(t_ns, index, point, table.reader());
    }
  });
  return collector.finish(table.reader());
}

CalibrationRecording read_asl_calibration(const std::filesystem::path& path,
                                          double max_rejected_fraction) {
  TableReader table(table_file(path));
  const std::size_t stamp = stamp_column(table);
  const std::size_t name = table.column("name");
  const std::size_t value = table.column("value");
  StampFilter filter({std::numeric_limits<double>::infinity(), max_rejected_fraction});
  CalibrationRecording out;
  std::set<std::string> names;  // of the last stamp
  read_rows(table, filter, [&] {
    const CalibrationSample sample{table.stamp_ns(stamp), std::string(table.text(name)),
                                   table.number(value)};
    if (sample.name.empty()) table.fail(name, "is empty");
    if (!std::isfinite(sample.value)) {
      return filter.reject(kNotFinite, table.reader());
    }
    const bool is_same = !out.samples.empty() && out.samples.back().t_ns == sample.t_ns;
    if (is_same && names.contains(sample.name)) {
      return filter.reject("name that the stamp already has", table.reader());
    }
    if (!filter.accept_or_same(sample.t_ns, table.reader())) return;
    if (!is_same) names.clear();
    names.insert(sample.name);
    out.samples.push_back(sample);
  });
  filter.finish(table.reader());
  out.rejections = filter.counts();
  return out;
}

}  // namespace viwo::log

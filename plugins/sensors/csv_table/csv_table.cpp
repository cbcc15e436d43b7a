// Sensor csv_table: wheels, IMU and poses from the columns of any table (model.md).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "csv_table_params.hpp"
#include "header_unit.hpp"
#include "viwo/api/plugin.hpp"
#include "viwo/log/recording.hpp"
#include "viwo/log/text.hpp"
#include "viwo/log/yaw_of_rate.hpp"

namespace viwo {
namespace {

using csv_table::Params;
using csv_table::Quantity;

/// The table, once for each kind of samples in it.
class Table {
 public:
  explicit Table(const Params& params)
      : reader_(params.path, params.layout()), unit_(params.time_unit), has_header_(params.header) {
    time_ = column("time_column", params.time_column);
    const double seconds = 1e-9 * static_cast<double>(*log::parse_time_ns("1", unit_));
    require_unit("time_unit", {time_}, Quantity::kTime, seconds);
  }

  /// ParamError for a column that is not there.
  std::size_t column(const char* key, const std::string& name) {
    try {
      named_.push_back({key, name, reader_.column(name)});
    } catch (const InputError& error) {
      throw ParamError(key, error.what());
    }
    return named_.back().column;
  }
  std::vector<std::size_t> columns(const char* key, const std::vector<std::string>& names) {
    std::vector<std::size_t> out;
    for (const std::string& name : names) out.push_back(column(key, name));
    return out;
  }

  /// ParamError where the header names another unit than the configuration, of which 1 is `si`.
  /// Readings that are `scaled` may be in any.
  void require_unit(const char* key, const std::vector<std::size_t>& columns, Quantity of,
                    double si, bool scaled = false) const {
    constexpr double kSame = 1e-3;
    for (const std::size_t i : columns) {
      const auto unit = csv_table::unit_of_header(reader_.columns()[i]);
      if (!unit || scaled || (unit->of == of && std::abs(unit->si - si) < kSame * si)) continue;
      throw ParamError(key, "the header says that " + log::quoted(reader_.columns()[i]) +
                                " is in " + unit->name +
                                ": give that unit, or the scale that makes this one of it, or "
                                "mend the header");
    }
  }

  /// Calls `row` with the stamp of each row that has something in `columns`, if only in one.
  template <class Collector, class Row>
  void read(const std::vector<std::size_t>& columns, Collector& collector, Row&& row) {
    check();
    reader_.for_each_row(
        [&] {
          for (const std::size_t i : columns) {
            if (!reader_.text(i).empty()) return row(reader_.time_ns(time_, unit_));
          }
        },
        [&](const BadRow& bad) { collector.reject_row(bad, reader_.reader()); });
  }

  double number(std::size_t column) const { return reader_.number(column); }
  const log::TextReader& at() const { return reader_.reader(); }

 private:
  using BadRow = log::BadRow;
  struct Named {
    const char* key;
    std::string name;
    std::size_t column;
  };

  /// ParamError for a first row that is taken for a header, and for a column that is two things.
  void check() const {
    const auto has_number = [this](const Named& one) {
      return log::parse_number(reader_.columns()[one.column]).has_value();
    };
    if (has_header_ && std::all_of(named_.begin(), named_.end(), has_number)) {
      throw ParamError("header",
                       "the first line has numbers in all columns that are read: header: false "
                       "reads it as a row (with skip_lines, where these numbers are names)");
    }
    for (auto one = named_.begin(); one != named_.end(); ++one) {
      const auto same = [&](const Named& other) { return other.column == one->column; };
      const auto before = std::find_if(named_.begin(), one, same);
      if (before == one) continue;
      throw ParamError(one->key, "'" + one->name + "' is the column '" + before->name +
                                     "', which is given already");
    }
  }

  log::TableReader reader_;
  log::TimeUnit unit_;
  bool has_header_;
  std::size_t time_ = 0;
  std::vector<Named> named_;  ///< by the parameters
};

void require_units(const Table& table, const Params& params, const std::vector<std::size_t>& drives,
                   const std::vector<std::size_t>& steers) {
  const auto is_scaled = [](const std::vector<double>& scale) {
    return std::any_of(scale.begin(), scale.end(), [](double s) { return std::abs(s) != 1.; });
  };
  if (params.drive_unit != Params::DriveUnit::kCount) {
    const bool is_angle = params.is_angle(), are_metres = params.wheel_radius_m > 0.;
    const Quantity of = are_metres ? (is_angle ? Quantity::kLength : Quantity::kSpeed)
                                   : (is_angle ? Quantity::kAngle : Quantity::kRate);
    table.require_unit("drive_unit", drives, of, are_metres ? 1. : params.drive_factor(is_angle),
                       is_scaled(params.drive_scale));
  }
  if (params.steer_unit != Params::SteerUnit::kCount) {
    table.require_unit("steer_unit", steers, Quantity::kAngle, params.steer_factor(),
                       is_scaled(params.steer_scale));
  }
}

log::EncoderRecording read_wheels(const Params& params) {
  Table table(params);
  const auto drives = table.columns("drive_columns", params.drive_columns);
  const auto steers = table.columns("steer_columns", params.steer_columns);
  const double drive_factor = params.drive_factor(params.is_angle());
  const double steer_factor = params.steer_factor();
  require_units(table, params, drives, steers);
  params.check_turns(params.is_angle(), params.drive_turn, params.steer_turn);
  log::EncoderCollector collector(
      {params.limits(), params.is_angle(), params.stride, params.joints()}, drives.size(),
      steers.size());
  log::EncoderReading reading;
  reading.n_drive = static_cast<int>(drives.size());
  reading.n_steer = static_cast<int>(steers.size());
  auto all = drives;
  all.insert(all.end(), steers.begin(), steers.end());
  const bool are_increments = params.drive_input == Params::Drive::kIncrement;
  std::array<double, kMaxDrives> angle_rad{};
  bool is_lost = false;  // what a wheel turned since the last reading
  table.read(all, collector, [&](std::int64_t t_ns) {
    reading.t_ns = t_ns;
    reading.is_start = are_increments && is_lost;
    is_lost = true;  // if one of them cannot be read
    for (std::size_t i = 0; i < drives.size(); ++i) {
      reading.drive[i] = drive_factor * table.number(drives[i]);
      if (are_increments) reading.drive[i] = angle_rad[i] += reading.drive[i];
    }
    is_lost = !std::all_of(reading.drive.begin(), reading.drive.begin() + reading.n_drive,
                           [](double angle) { return std::isfinite(angle); });
    if (is_lost) angle_rad.fill(0.);
    for (std::size_t i = 0; i < steers.size(); ++i) {
      reading.steer_rad[i] = steer_factor * table.number(steers[i]);
    }
    collector.add(reading, table.at());
  });
  return collector.finish(table.at());
}

log::ImuRecording read_imu(const Params& params) {
  Table table(params);
  auto all = table.columns("gyro_columns", params.gyro_columns);
  const auto accel = table.columns("accel_columns", params.accel_columns);
  all.insert(all.end(), accel.begin(), accel.end());
  const Eigen::Vector3d gyro_factor = params.gyro_factors();
  const Eigen::Vector3d accel_factor = params.accel_factors();
  log::ImuCollector collector(params.limits());
  table.read(all, collector, [&](std::int64_t t_ns) {
    ImuSample imu;
    imu.t_ns = t_ns;
    for (int i = 0; i < 3; ++i) {
      const auto axis = static_cast<std::size_t>(i);
      imu.gyro_rad_per_s[axis] = gyro_factor[i] * table.number(all[axis]);
      imu.accel_m_per_s2[axis] = accel_factor[i] * table.number(all[3 + axis]);
    }
    collector.add(imu, table.at());
  });
  return collector.finish(table.at());
}

log::PoseRecording read_poses(const Params& params) {
  Table table(params);
  const auto p = table.columns("position_columns", params.position_columns);
  auto q = table.columns("quaternion_columns", params.quaternion_columns);
  if (!params.yaw_column.empty()) q = {table.column("yaw_column", params.yaw_column)};
  table.require_unit("position_unit", p, Quantity::kLength, params.position_factor());
  if (q.size() == 1) table.require_unit("yaw_unit", q, Quantity::kAngle, params.yaw_factor());
  auto all = p;
  all.insert(all.end(), q.begin(), q.end());
  log::PoseCollector collector(params.limits());
  table.read(all, collector, [&](std::int64_t t_ns) {
    PoseSample pose;
    pose.t_ns = t_ns;
    for (std::size_t i = 0; i < p.size(); ++i) {
      pose.p_BinW_m[i] = params.position_factor() * table.number(p[i]);
    }
    if (q.size() == 1) {
      const double half_rad = 0.5 * params.yaw_factor() * table.number(q[0]);
      pose.q_BtoW_xyzw = {0., 0., std::sin(half_rad), std::cos(half_rad)};
    } else {
      for (std::size_t i = 0; i < q.size(); ++i) pose.q_BtoW_xyzw[i] = table.number(q[i]);
    }
    collector.add(pose, table.at());
  });
  return collector.finish(table.at());
}

/// Headings, or rates that become some.
log::HeadingRecording read_headings(const Params& params) {
  Table table(params);
  const bool are_rates = !params.yaw_rate_column.empty();
  const std::size_t column = are_rates ? table.column("yaw_rate_column", params.yaw_rate_column)
                                       : table.column("yaw_column", params.yaw_column);
  if (are_rates) {
    table.require_unit("gyro_unit", {column}, Quantity::kRate, radians_in(params.gyro_unit),
                       params.gyro_scale != 1.);
  } else {
    table.require_unit("yaw_unit", {column}, Quantity::kAngle, params.yaw_factor());
  }
  const double factor =
      params.heading_scale * (are_rates ? params.gyro_factor() : params.yaw_factor());
  log::HeadingCollector collector(params.limits());
  table.read({column}, collector, [&](std::int64_t t_ns) {
    collector.add({t_ns, factor * table.number(column)}, table.at());
  });
  log::HeadingRecording out = collector.finish(table.at());
  if (are_rates) log::integrate_yaw(params.max_gap_s, out.samples);
  return out;
}

SampleTypes kinds_of(const Params& params) {
  SampleTypes out;
  if (params.has_poses()) out.push_back(&sample_type<PoseSample>());
  if (params.has_heading()) out.push_back(&sample_type<HeadingSample>());
  if (params.has_imu()) out.push_back(&sample_type<ImuSample>());
  if (params.has_wheels()) out.push_back(&sample_type<EncoderSample>());
  return out;
}

log::Recording<Measurement> read(const Params& params) {
  params.check();
  log::Recording<Measurement> out;
  if (params.has_poses()) log::append(out, read_poses(params), "poses");
  if (params.has_heading()) log::append(out, read_headings(params), "headings");
  if (params.has_imu()) log::append(out, read_imu(params), "IMU");
  if (params.has_wheels()) log::append(out, read_wheels(params), "wheels");
  log::sort_by_time(out);
  log::cut(params, out);
  return out;
}

class CsvTable final : public log::RecordingSensor<Measurement> {
 public:
  CsvTable(const Params& params, const HostServices& /*services*/)
      : RecordingSensor(read(params), kinds_of(params)) {}
};

VIWO_REGISTER(Sensor, CsvTable, "csv_table", "1.0.0",
              "wheel encoders, IMU and poses from the columns of any table", "Apache-2.0", Params);

}  // namespace
}  // namespace viwo

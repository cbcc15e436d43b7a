#include "samples.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <type_traits>
#include <utility>

#include "contents.hpp"
#include "readings.hpp"
#include "viwo/api/status.hpp"
#include "viwo/log/cells.hpp"
#include "viwo/log/stamp_filter.hpp"
#include "viwo/log/text.hpp"
#include "viwo/log/yaw_of_rate.hpp"

namespace viwo::wpilog {
namespace {

/// Finds what the parameter `key` names; `pick` says of an entry, and of a path within it, which
/// numbers it has.
template <class PickOf>
class Finder {
 public:
  using Found = typename std::invoke_result_t<PickOf, const Entry&, std::string_view>::value_type;

  Finder(const Contents& contents, const char* key, const char* what, PickOf pick)
      : contents_(contents), key_(key), what_(what), pick_(std::move(pick)) {}

  std::pair<const Entry*, Found> operator()(const std::string& name) const {
    const Entry* entry = contents_.find(name);
    std::string_view path;
    for (std::size_t end = name.rfind('/'); entry == nullptr && end != name.npos && end > 0;
         end = name.rfind('/', end - 1)) {
      entry = contents_.find(std::string_view(name).substr(0, end));
      if (entry != nullptr) path = std::string_view(name).substr(end + 1);
    }
    if (entry == nullptr) fail("no entry '" + name + "' in " + contents_.file(), name);
    if (entry->records == 0) {
      fail("the entry '" + entry->name + "' in " + contents_.file() + " has no records", name);
    }
    try {
      if (auto found = pick_(*entry, path)) return {entry, std::move(*found)};
    } catch (const InputError& error) {
      throw ParamError(key_, "the entry '" + entry->name + "' in " + contents_.file() +
                                 " cannot be read: " + error.what() + contents_.damage());
    }
    fail("'" + name + "' in " + contents_.file() + " is no " + what_ + ", but of type " +
             log::quoted(entry->type) +
             (path.empty() ? "" : std::string(" without a ") + what_ + " " + log::quoted(path)),
         name);
  }

 private:
  [[noreturn]] void fail(const std::string& text, const std::string& name) const {
    constexpr std::size_t kMost = 10'000;
    std::vector<std::string> fitting;
    for (const Entry& entry : contents_.entries()) {
      if (entry.records > 0 && fits(entry) && fitting.size() < kMost) fitting.push_back(entry.name);
    }
    throw ParamError(key_, text + contents_.damage() +
                               (fitting.empty() ? " - the log has none that fits"
                                                : log::did_you_mean(name, fitting)));
  }
  bool fits(const Entry& entry) const {
    try {
      return pick_(entry, {}).has_value();
    } catch (const InputError&) {
      return false;
    }
  }

  const Contents& contents_;
  const char* key_;
  const char* what_;
  PickOf pick_;
};

std::vector<Source> number_sources(const Contents& contents, const char* key,
                                   const std::vector<std::string>& names) {
  const Finder find(contents, key, "number", [&](const Entry& entry, std::string_view path) {
    return pick_number(entry.type, path, contents.schemas());
  });
  std::vector<Source> out;
  for (const std::string& name : names) {
    auto [entry, pick] = find(name);
    out.push_back({entry, std::move(pick)});
  }
  return out;
}

/// Where the drives and the steering angles stand in a reading.
struct WheelSources {
  std::vector<Source> sources;
  bool has_modules = false;
  bool is_angle = false;
};

WheelSources module_sources(const Contents& contents, const Params& params) {
  const Finder find(
      contents, "module_entries", "swerve module", [&](const Entry& entry, std::string_view path) {
        return path.empty() ? pick_modules(entry.type, contents.schemas()) : std::nullopt;
      });
  WheelSources out;
  out.has_modules = true;
  const bool wants_angle = params.drive_input == Params::DriveInput::kAngle;
  std::optional<Drive> first;
  for (const std::string& name : params.module_entries) {
    auto [entry, modules] = find(name);
    if (first.value_or(modules.drive) != modules.drive) {
      throw ParamError("module_entries", "'" + name + "' has another kind of drive than '" +
                                             params.module_entries[0] +
                                             "': all are speeds, or all are distances");
    }
    first = modules.drive;
    if (modules.drive == Drive::kRate && wants_angle) {
      throw ParamError("drive_input", "'" + name + "' has speeds: drive_input: rate");
    }
    out.is_angle = modules.drive == Drive::kAngle || wants_angle;
    out.sources.push_back({entry, std::move(modules.pick)});
  }
  return out;
}

WheelSources wheel_sources(const Contents& contents, const Params& params) {
  if (!params.module_entries.empty()) return module_sources(contents, params);
  WheelSources out;
  out.is_angle = params.drive_input == Params::DriveInput::kAngle;
  out.sources = number_sources(contents, "drive_entries", params.drive_entries);
  auto steers = number_sources(contents, "steer_entries", params.steer_entries);
  std::move(steers.begin(), steers.end(), std::back_inserter(out.sources));
  return out;
}

const Entry* cycle_entry(const Contents& contents, const std::string& name) {
  if (name.empty()) return nullptr;
  const Finder find(contents, "cycle_entry", "entry", [](const Entry&, std::string_view path) {
    return path.empty() ? std::optional(true) : std::nullopt;
  });
  return find(name).first;
}

/// At the end of the readings of one kind.
template <class Sample>
log::Recording<Sample> finish(const Contents& contents, const StampOrder& order,
                              std::vector<Sample> samples) {
  if (order.empty()) {
    throw InputError(contents.file() + "  has no time at which all entries are" +
                     contents.damage());
  }
  order.require_enough(contents.file(), "readings");
  return {std::move(samples), order.counts()};
}

std::int64_t spread_us(const Params& params) {
  return static_cast<std::int64_t>(std::llround(1e6 * params.cycle_spread_s));
}

log::EncoderRecording read_wheels(const Contents& contents, const Params& params) {
  const WheelSources wheels = wheel_sources(contents, params);
  params.check_stride(wheels.is_angle, "angle");
  const double drive_factor = params.drive_factor(wheels.is_angle);
  const double steer_factor = params.steer_factor();
  params.check_turns(wheels.is_angle, params.drive_turn, params.steer_turn);
  StampOrder order(params.limits());
  std::vector<log::EncoderReading> readings;
  std::optional<log::JointMap> joints;
  for_each_reading(
      contents, wheels.sources,
      {cycle_entry(contents, params.cycle_entry), spread_us(params), params.max_rejected_fraction},
      order, [&](std::int64_t t_ns, std::span<const double> numbers, const auto& where) {
        const std::size_t n = wheels.has_modules ? numbers.size() / 2 : params.drive_entries.size();
        const std::size_t n_steer = numbers.size() - n;
        if (n > kMaxDrives || n_steer > kMaxSteers) {
          throw ParamError("module_entries", std::to_string(n) + " modules, at most " +
                                                 std::to_string(kMaxDrives) + " are possible");
        }
        log::EncoderReading reading;
        reading.t_ns = t_ns;
        reading.n_drive = static_cast<int>(n);
        reading.n_steer = static_cast<int>(n_steer);
        for (std::size_t i = 0; i < n; ++i) {
          reading.drive[i] = drive_factor * numbers[wheels.has_modules ? 2 * i : i];
        }
        for (std::size_t i = 0; i < n_steer; ++i) {
          reading.steer_rad[i] = steer_factor * numbers[wheels.has_modules ? 2 * i + 1 : n + i];
        }
        if (const char* const why = log::why_rejected(reading)) return order.reject(why, where);
        if (!order.accept(t_ns, where)) return;
        if (!joints) {
          joints.emplace(params.joints(), reading.n_drive, reading.n_steer, wheels.is_angle,
                         params.max_gap_s);
        }
        if (const char* const why = joints->convert(reading)) return order.reject_last(why, where);
        readings.push_back(reading);
      });
  auto samples = log::samples_from(readings, wheels.is_angle, params.max_gap_s, params.stride);
  auto out = finish(contents, order, std::move(samples));
  if (!out.samples.empty()) return out;
  throw InputError(contents.file() + "  has too few readings without a gap for a rate" +
                   log::spacing_text(readings, params.max_gap_s));
}

log::ImuRecording read_imu(const Contents& contents, const Params& params) {
  auto sources = number_sources(contents, "gyro_entries", params.gyro_entries);
  auto accel = number_sources(contents, "accel_entries", params.accel_entries);
  std::move(accel.begin(), accel.end(), std::back_inserter(sources));
  const Eigen::Vector3d gyro_factor = params.gyro_factors();
  const Eigen::Vector3d accel_factor = params.accel_factors();
  StampOrder order(params.limits());
  std::vector<ImuSample> samples;
  for_each_reading(contents, sources, {nullptr, spread_us(params), params.max_rejected_fraction},
                   order,
                   [&](std::int64_t t_ns, std::span<const double> numbers, const auto& where) {
                     ImuSample imu;
                     imu.t_ns = t_ns;
                     for (int i = 0; i < 3; ++i) {
                       const auto axis = static_cast<std::size_t>(i);
                       imu.gyro_rad_per_s[axis] = gyro_factor[i] * numbers[axis];
                       imu.accel_m_per_s2[axis] = accel_factor[i] * numbers[3 + axis];
                     }
                     if (const char* const why = log::why_rejected(imu))
                       return order.reject(why, where);
                     if (order.accept(t_ns, where)) samples.push_back(imu);
                   });
  return finish(contents, order, std::move(samples));
}

/// Of a quaternion w, x, y, z.
double yaw_of(std::span<const double> q) {
  return std::atan2(2. * (q[0] * q[3] + q[1] * q[2]), 1. - 2. * (q[2] * q[2] + q[3] * q[3]));
}
bool is_unit(std::span<const double> q) {
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return std::abs(norm - 1.) < 1e-3;
}

std::vector<Source> heading_source(const Contents& contents, const Params& params) {
  if (params.heading_entry.empty()) {
    return number_sources(contents, "yaw_rate_entry", {params.yaw_rate_entry});
  }
  const Finder find(contents, "heading_entry", "yaw",
                    [&](const Entry& entry, std::string_view path) {
                      return pick_heading(entry.type, path, contents.schemas());
                    });
  auto [entry, pick] = find(params.heading_entry);
  return {{entry, std::move(pick)}};
}

/// Headings, or rates that become some.
log::HeadingRecording read_headings(const Contents& contents, const Params& params) {
  const bool are_rates = params.heading_entry.empty();
  const std::vector<Source> sources = heading_source(contents, params);
  const double factor = are_rates ? params.gyro_factor() : params.heading_factor();
  StampOrder order(params.limits());
  std::vector<HeadingSample> samples;
  for_each_reading(contents, sources, {nullptr, 0, params.max_rejected_fraction}, order,
                   [&](std::int64_t t_ns, std::span<const double> numbers, const auto& where) {
                     const bool is_number = numbers.size() == 1;
                     const double yaw = is_number ? factor * numbers[0] : yaw_of(numbers);
                     const HeadingSample heading{t_ns, params.heading_scale * yaw};
                     if (const char* const why = heading.fault()) return order.reject(why, where);
                     if (!is_number && !is_unit(numbers)) return order.reject(log::kNotUnit, where);
                     if (order.accept(t_ns, where)) samples.push_back(heading);
                   });
  if (are_rates) log::integrate_yaw(params.max_gap_s, samples);
  return finish(contents, order, std::move(samples));
}

/// Of three numbers x, y, yaw, or seven with a quaternion w, x, y, z.
PoseSample pose_of(std::int64_t t_ns, std::span<const double> numbers, double position_factor,
                   double yaw_factor) {
  PoseSample pose;
  pose.t_ns = t_ns;
  const std::size_t n = numbers.size() == 3 ? 2 : 3;
  for (std::size_t i = 0; i < n; ++i) pose.p_BinW_m[i] = position_factor * numbers[i];
  if (numbers.size() == 3) {
    const double half_rad = 0.5 * yaw_factor * numbers[2];
    pose.q_BtoW_xyzw = {0., 0., std::sin(half_rad), std::cos(half_rad)};
  } else {
    pose.q_BtoW_xyzw = {numbers[4], numbers[5], numbers[6], numbers[3]};
  }
  return pose;
}

/// Of the payloads of an entry that are not empty; 0: it is not known.
std::size_t usual_size(const Entry& entry) {
  const auto some = std::find_if(entry.data.begin(), entry.data.end(),
                                 [](const Datum& datum) { return datum.size > 0; });
  return some == entry.data.end() ? 0 : some->size;
}

std::optional<Pick> pick_robot_pose(const Entry& entry, const Schemas& schemas) {
  const std::size_t size = usual_size(entry);
  auto pick = pick_pose(entry.type, size, schemas);
  const std::size_t number = entry.type == "double[]" ? 8 : entry.type == "float[]" ? 4 : 0;
  if (pick || number == 0 || size < 6 * number) return pick;
  const std::string name = "\"" + entry.name + "/";
  throw InputError("it has " + std::to_string(size / number) +
                   " numbers, a pose has 3 (x, y, yaw) or 7 (x, y, z, qw, qx, qy, qz). Where they "
                   "are x, y, z, roll, pitch, yaw in degrees, as a Limelight writes them, give "
                   "pose_entries: [" +
                   name + "0\", " + name + "1\", " + name + "5\"] and yaw_unit: deg");
}

log::PoseRecording read_poses(const Contents& contents, const Params& params) {
  std::vector<Source> sources;
  if (params.pose_entries.size() == 3) {
    sources = number_sources(contents, "pose_entries", params.pose_entries);
  } else {
    const Finder find(contents, "pose_entries", "pose",
                      [&](const Entry& entry, std::string_view path) -> std::optional<Pick> {
                        if (!path.empty()) return std::nullopt;
                        return pick_robot_pose(entry, contents.schemas());
                      });
    auto [entry, pick] = find(params.pose_entries[0]);
    sources.push_back({entry, std::move(pick)});
  }
  StampOrder order(params.limits());
  std::vector<PoseSample> samples;
  const std::int64_t spread = sources.size() == 1 ? 0 : spread_us(params);
  // A Pose2d is in rad, whatever unit the gyro has.
  const double yaw_factor = sources[0].entry->type.starts_with("struct:") && sources.size() == 1
                                ? 1.
                                : params.yaw_factor();
  for_each_reading(contents, sources, {nullptr, spread, params.max_rejected_fraction}, order,
                   [&](std::int64_t t_ns, std::span<const double> numbers, const auto& where) {
                     if (numbers.size() != 3 && numbers.size() != 7) {
                       return order.reject("record of several poses", where);
                     }
                     PoseSample pose = pose_of(t_ns, numbers, params.position_factor(), yaw_factor);
                     if (const char* const why = log::why_rejected(pose))
                       return order.reject(why, where);
                     if (order.accept(t_ns, where)) samples.push_back(pose);
                   });
  return finish(contents, order, std::move(samples));
}

}  // namespace

log::Recording<Measurement> read_samples(const Params& params) {
  params.check();
  const Contents contents(params.path, params.names());
  log::Recording<Measurement> out;
  contents.rejections().append_to(out.rejections);
  if (params.has_poses()) log::append(out, read_poses(contents, params), "poses");
  if (params.has_heading()) log::append(out, read_headings(contents, params), "headings");
  if (params.has_imu()) log::append(out, read_imu(contents, params), "IMU");
  if (params.has_wheels()) log::append(out, read_wheels(contents, params), "wheels");
  log::sort_by_time(out);
  log::cut(params, out);
  return out;
}

}  // namespace viwo::wpilog

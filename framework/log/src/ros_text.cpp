#include "viwo/log/ros_text.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <span>

#include "viwo/api/status.hpp"
#include "viwo/log/table_reader.hpp"
#include "viwo/log/text.hpp"

namespace viwo::log {
namespace {

/// Reads the stamp of the current row.
class StampReader {
 public:
  StampReader(const TableReader& table, const RosClock& clock) : table_(table), clock_(clock) {
    if (clock.reception) {
      time_ = table.column("time");
    } else {
      seconds_ = table.column(".header.stamp.secs");
      nanoseconds_ = table.column(".header.stamp.nsecs");
    }
  }

  std::int64_t read() const {
    if (clock_.reception) {
      const auto stamp = parse_reception_ns(table_.text(time_), clock_.reception_utc_offset_h);
      if (stamp) return *stamp;
      table_.fail(time_, quoted(table_.text(time_)) + " is no time yyyy/MM/dd/HH:mm:ss.ffffff");
    }
    const std::int64_t seconds = table_.integer(seconds_);
    const std::int64_t nanoseconds = table_.integer(nanoseconds_);
    constexpr std::int64_t kMost_s = 4'000'000'000;
    if (seconds < -kMost_s || seconds > kMost_s) {
      table_.fail(seconds_, quoted(table_.text(seconds_)) + " is no stamp in seconds");
    }
    if (nanoseconds < 0 || nanoseconds >= 1'000'000'000) {
      table_.fail(nanoseconds_, quoted(table_.text(nanoseconds_)) + " is not in [0, 1e9) ns");
    }
    return seconds * 1'000'000'000 + nanoseconds;
  }

 private:
  const TableReader& table_;
  RosClock clock_;
  std::size_t time_ = 0;
  std::size_t seconds_ = 0;
  std::size_t nanoseconds_ = 0;
};

std::vector<std::string_view> list_in(const TableReader& table, std::size_t column) {
  auto items = parse_list(table.text(column));
  if (!items) table.fail(column, quoted(table.text(column)) + " is not a list");
  return *std::move(items);
}

/// Where the wanted joints are in the lists of a row. The names hardly ever change from row to row.
class JointFinder {
 public:
  JointFinder(const TableReader& table, const RosEncoderOptions& options)
      : table_(table), options_(options), names_column_(table.column(".name")) {}

  /// Finds the joints of the current row; false when it lacks one.
  bool find() {
    if (table_.text(names_column_) != names_text_) {
      names_text_ = table_.text(names_column_);
      names_.clear();
      for (const std::string_view name : list_in(table_, names_column_)) names_.emplace_back(name);
      drive = indices(options_.drive);
      steer = indices(options_.steer);
      complete_ = drive.size() == options_.drive.size() && steer.size() == options_.steer.size();
    }
    ever_ = ever_ || complete_;
    return complete_;
  }

  /// ParamError when no row had all joints.
  void finish() const {
    if (ever_) return;
    check("drive", options_.drive);
    check("steer", options_.steer);
  }

  std::size_t count() const { return names_.size(); }

  std::vector<std::size_t> drive;
  std::vector<std::size_t> steer;

 private:
  std::vector<std::size_t> indices(const std::vector<std::string>& wanted) const {
    std::vector<std::size_t> out;
    for (const std::string& name : wanted) {
      const auto found = std::find(names_.begin(), names_.end(), name);
      if (found == names_.end()) break;
      out.push_back(static_cast<std::size_t>(found - names_.begin()));
    }
    return out;
  }

  void check(const char* key, const std::vector<std::string>& wanted) const {
    for (const std::string& name : wanted) {
      if (std::find(names_.begin(), names_.end(), name) != names_.end()) continue;
      throw ParamError(key, "no joint '" + name + "' in " + table_.reader().file().string() +
                                did_you_mean(name, names_));
    }
  }

  const TableReader& table_;
  const RosEncoderOptions& options_;
  std::size_t names_column_;
  std::string names_text_;
  std::vector<std::string> names_;
  bool complete_ = false;
  bool ever_ = false;
};

/// The numbers of a list column at some indices.
void pick(const TableReader& table, std::size_t column, std::size_t n_joints,
          const std::vector<std::size_t>& indices, std::span<double> out) {
  const auto items = list_in(table, column);
  if (items.size() != n_joints) {
    table.fail(column, std::to_string(items.size()) + " values for " + std::to_string(n_joints) +
                           " joints");
  }
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const auto value = parse_number(items[indices[i]]);
    if (!value) table.fail(column, quoted(items[indices[i]]) + " is not a number");
    out[i] = *value;
  }
}

void check_names(const char* key, const std::vector<std::string>& names, std::size_t at_least,
                 std::size_t at_most) {
  if (names.size() < at_least || names.size() > at_most) {
    throw ParamError(key, std::to_string(names.size()) + " joints, must be " +
                              std::to_string(at_least) + " to " + std::to_string(at_most));
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (std::find(names.begin() + static_cast<std::ptrdiff_t>(i) + 1, names.end(), names[i]) !=
        names.end()) {
      throw ParamError(key, "joint '" + names[i] + "' is listed twice");
    }
  }
}

/// Digits at [begin, begin + size) as a number; nothing when there is anything else.
std::optional<int> digits_at(std::string_view text, std::size_t begin, std::size_t size) {
  int value = 0;
  for (const char c : text.substr(begin, size)) {
    if (c < '0' || c > '9') return std::nullopt;
    value = 10 * value + (c - '0');
  }
  return value;
}

}  // namespace

std::optional<std::vector<std::string_view>> parse_list(std::string_view text) {
  text = trim(text);
  if (text.size() < 2) return std::nullopt;
  const bool round = text.front() == '(' && text.back() == ')';
  const bool square = text.front() == '[' && text.back() == ']';
  if (!round && !square) return std::nullopt;
  std::string_view rest = trim(text.substr(1, text.size() - 2));
  std::vector<std::string_view> items;
  while (!rest.empty()) {  // a comma behind the last item is how Python prints one item
    const std::size_t end = std::min(rest.find(','), rest.size());
    std::string_view item = trim(rest.substr(0, end));
    if (item.size() >= 2 && item.front() == item.back() &&
        (item.front() == '\'' || item.front() == '"')) {
      item = item.substr(1, item.size() - 2);
    }
    items.push_back(item);
    rest = end == rest.size() ? std::string_view{} : trim(rest.substr(end + 1));
  }
  return items;
}

std::optional<std::int64_t> parse_reception_ns(std::string_view text, double utc_offset_h) {
  constexpr std::string_view kForm = "yyyy/MM/dd/HH:mm:ss";
  if (text.size() < kForm.size()) return std::nullopt;
  for (const std::size_t i : {4U, 7U, 10U, 13U, 16U}) {
    if (text[i] != kForm[i]) return std::nullopt;
  }
  const auto year = digits_at(text, 0, 4), month = digits_at(text, 5, 2);
  const auto day = digits_at(text, 8, 2), hour = digits_at(text, 11, 2);
  const auto minute = digits_at(text, 14, 2), second = digits_at(text, 17, 2);
  if (!year || !month || !day || !hour || !minute || !second) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(*year),
                                         std::chrono::month(static_cast<unsigned>(*month)),
                                         std::chrono::day(static_cast<unsigned>(*day))};
  // The year bounds keep the nanoseconds inside of 64 bits.
  if (!date.ok() || *year < 1900 || *year > 2090 || *hour > 23 || *minute > 59 || *second > 60) {
    return std::nullopt;
  }
  std::string fraction(text.substr(kForm.size()));
  if (!fraction.empty() && (fraction[0] != '.' || fraction.size() > 10)) return std::nullopt;
  fraction.resize(10, '0');
  const auto nanoseconds = digits_at(fraction, 1, 9);
  if (!nanoseconds) return std::nullopt;
  const std::int64_t days = std::chrono::sys_days(date).time_since_epoch().count();
  const std::int64_t local_s = ((days * 24 + *hour) * 60 + *minute) * 60 + *second;
  const std::int64_t utc_s = local_s - std::llround(utc_offset_h * 3600.);
  return utc_s * 1'000'000'000 + *nanoseconds;
}

EncoderRecording read_ros_encoders(const std::filesystem::path& file,
                                   const RosEncoderOptions& options) {
  check_names("drive", options.drive, 1, kMaxDrives);
  check_names("steer", options.steer, 0, kMaxSteers);
  TableReader table(file);
  const StampReader stamp(table, options.clock);
  const std::size_t position = table.column(".position");
  const std::size_t drive = options.recording.drive_is_angle ? position : table.column(".velocity");
  JointFinder joints(table, options);
  EncoderCollector collector(options.recording, options.drive.size(), options.steer.size());
  EncoderReading reading;
  reading.n_drive = static_cast<int>(options.drive.size());
  reading.n_steer = static_cast<int>(options.steer.size());
  const auto read = [&] {
    if (!joints.find()) {
      collector.reject("row without one of the joints", table.reader());
      return;
    }
    reading.t_ns = stamp.read();
    pick(table, drive, joints.count(), joints.drive, reading.drive);
    pick(table, position, joints.count(), joints.steer, reading.steer_rad);
    collector.add(reading, table.reader());
  };
  table.for_each_row(read, [&](const BadRow& bad) { collector.reject_row(bad, table.reader()); });
  joints.finish();
  return collector.finish(table.reader());
}

PoseRecording read_ros_poses(const std::filesystem::path& file, const RosClock& clock,
                             const LogLimits& limits) {
  TableReader table(file);
  const StampReader stamp(table, clock);
  const std::array<std::size_t, 3> p = {table.column(".pose.position.x"),
                                        table.column(".pose.position.y"),
                                        table.column(".pose.position.z")};
  const std::array<std::size_t, 4> q = {
      table.column(".pose.orientation.x"), table.column(".pose.orientation.y"),
      table.column(".pose.orientation.z"), table.column(".pose.orientation.w")};
  PoseCollector collector(limits);
  const auto read = [&] {
    PoseSample pose;
    pose.t_ns = stamp.read();
    for (std::size_t i = 0; i < p.size(); ++i) pose.p_BinW_m[i] = table.number(p[i]);
    for (std::size_t i = 0; i < q.size(); ++i) pose.q_BtoW_xyzw[i] = table.number(q[i]);
    collector.add(pose, table.reader());
  };
  table.for_each_row(read, [&](const BadRow& bad) { collector.reject_row(bad, table.reader()); });
  return collector.finish(table.reader());
}

}  // namespace viwo::log

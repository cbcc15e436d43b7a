#include "viwo/log/tum.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <string>

#include "quaternion.hpp"
#include "viwo/api/status.hpp"
#include "viwo/log/stamp_filter.hpp"
#include "viwo/log/text.hpp"
#include "viwo/log/text_reader.hpp"
#include "viwo/math/number_text.hpp"

namespace viwo::log {
namespace {

constexpr std::size_t kFields = 8;
constexpr std::array<const char*, kFields> kNames = {"t", "x", "y", "z", "qx", "qy", "qz", "qw"};

std::array<std::string_view, kFields> split_pose(const TextReader& reader, std::string_view line) {
  std::array<std::string_view, kFields> fields;
  std::size_t n = 0;
  for (std::string_view rest = line; !rest.empty(); ++n) {
    const std::size_t end = std::min(rest.find_first_of(" \t"), rest.size());
    if (n < kFields) fields[n] = rest.substr(0, end);
    rest = trim(rest.substr(end));
  }
  if (n != kFields) {
    reader.fail("expected 8 numbers 't x y z qx qy qz qw', found " + std::to_string(n) +
                (n == 1 ? " field" : " fields"));
  }
  return fields;
}

StampedPose parse_pose(const TextReader& reader, std::string_view line) {
  const auto fields = split_pose(reader, line);
  StampedPose pose;
  const auto stamp = parse_seconds_ns(fields[0]);
  if (!stamp) reader.fail("column 't': " + quoted(fields[0]) + " is no time in seconds");
  pose.t_ns = *stamp;
  std::array<double, kFields> values{};
  for (std::size_t i = 1; i < kFields; ++i) {
    const auto value = parse_number(fields[i]);
    if (!value || !std::isfinite(*value)) {
      reader.fail(std::string("column '") + kNames[i] + "': " + quoted(fields[i]) +
                  (value ? " is not finite" : " is not a number"));
    }
    values[i] = *value;
  }
  pose.p_BinW << values[1], values[2], values[3];
  if (!(pose.p_BinW.cwiseAbs().maxCoeff() <= kFarthest_m)) reader.fail(kTooFar);
  pose.q_BtoW = Eigen::Quaterniond(values[7], values[4], values[5], values[6]);
  const double norm = pose.q_BtoW.norm();
  if (!make_unit(pose.q_BtoW)) {
    reader.fail("the quaternion has the norm " + number_text(norm) + ", not 1");
  }
  return pose;
}

/// Seconds with nine decimals.
std::string seconds_text(std::int64_t t_ns) {
  const std::lldiv_t parts = std::lldiv(t_ns, 1'000'000'000);
  const std::string decimals = std::to_string(std::llabs(parts.rem));
  std::string text(t_ns < 0 ? "-" : "");
  text += std::to_string(std::llabs(parts.quot));
  text += '.';
  text.append(9 - decimals.size(), '0');
  return text += decimals;
}

}  // namespace

Trajectory read_tum(const std::filesystem::path& file) {
  TextReader reader(file);
  Trajectory trajectory;
  std::string_view line;
  while (reader.next(line)) {
    line = trim(line);
    if (line.empty() || line.front() == '#') continue;
    const StampedPose pose = parse_pose(reader, line);
    if (!trajectory.empty() && pose.t_ns <= trajectory.back().t_ns) {
      reader.fail("the stamp is not after the previous one");
    }
    trajectory.push_back(pose);
  }
  if (trajectory.empty()) throw InputError(file.string() + "  holds no pose");
  return trajectory;
}

TumWriter::TumWriter(const std::filesystem::path& file, files::Appears appears)
    : out_(file, appears) {
  out_ << "# t[s] x[m] y[m] z[m] qx qy qz qw\n";
}

void TumWriter::add(const StampedPose& pose) {
  out_ << seconds_text(pose.t_ns);
  for (const double value : pose.p_BinW) out_ << " " << value;
  for (const double value : pose.q_BtoW.coeffs()) out_ << " " << value;  // stored as x y z w
  out_ << "\n";
}

void write_tum(const std::filesystem::path& file, const Trajectory& trajectory) {
  TumWriter out(file);
  for (const StampedPose& pose : trajectory) out.add(pose);
  out.close();
}

}  // namespace viwo::log

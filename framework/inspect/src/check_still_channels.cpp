#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <vector>

#include <Eigen/Cholesky>

#include "checks.hpp"
#include "viwo/eval/statistics.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/series/rate_grid.hpp"
#include "viwo/wheel/drive_ranges.hpp"

namespace viwo::inspect {

using series::Poses;
using series::RateGrid;
using series::Recording;
using series::Wheels;
using series::YawRates;

namespace {

constexpr int kFewestReadings = 100;  ///< samples before a verdict

/// How far from their middle poses go for a tenth of the time; 0 where they jump nearly as far from
/// one to the next, as those of a body at rest that are noisy.
double distance_of(const Trajectory& poses) {
  if (poses.size() < 2) return 0.;
  Eigen::Vector3d middle;
  for (Eigen::Index i = 0; i < 3; ++i) {
    std::vector<double> along;
    for (const StampedPose& pose : poses) along.push_back(pose.p_BinW[i]);
    middle[i] = eval::median(along);
  }
  std::vector<double> distances_m, steps_m;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    distances_m.push_back((poses[i].p_BinW - middle).norm());
    if (i > 0) steps_m.push_back((poses[i].p_BinW - poses[i - 1].p_BinW).norm());
  }
  const double distance_m = eval::quantile(distances_m, 0.9);
  return distance_m > 3. * eval::median(steps_m) ? distance_m : 0.;
}

/// Whether the wheels were read then.
bool is_meanwhile(const Wheels& wheels, std::int64_t t_ns) {
  return !wheels.samples.empty() && t_ns >= wheels.samples.front().begin_ns &&
         t_ns <= wheels.samples.back().end_ns;
}

/// What a tenth of the readings of the gyro are beyond, of those while the wheels were read, rad/s.
double turn_of(const std::vector<ImuSample>& imu, const Wheels& wheels) {
  std::vector<double> rates;
  for (const ImuSample& sample : imu) {
    if (!is_meanwhile(wheels, sample.t_ns)) continue;
    rates.push_back(to_vector(sample.gyro_rad_per_s).norm());
  }
  return rates.empty() ? 0. : eval::quantile(rates, 0.9);
}

/// What stands still, while poses go somewhere, or the gyro turns, if there are any.
Finding standstill(const Recording& recording, const Wheels& wheels, const std::string& label,
                   double fastest) {
  constexpr double kGoes_m = 0.3;
  Finding finding{label,
                  Severity::kNote,
                  "motion",
                  "the wheels do not turn in this recording",
                  {{"fastest drive", fastest, "rad/s"}}};
  for (const Poses& poses : recording.poses) {
    Trajectory meanwhile;
    for (const StampedPose& pose : poses.poses) {
      if (is_meanwhile(wheels, pose.t_ns)) meanwhile.push_back(pose);
    }
    const double distance_m = distance_of(meanwhile);
    if (distance_m < kGoes_m) continue;
    const std::string other = recording.label(poses);
    finding.severity = Severity::kFault;
    finding.what = "the wheels turn with no more than " + significant(fastest, 2) +
                   " rad/s, while " + other + " goes " + significant(distance_m, 2) +
                   " m: their unit, or not connected";
    finding.figures.push_back({"distance", distance_m, "m"});
  }
  constexpr double kTurns_rad_per_s = 0.3;
  const double turn = turn_of(recording.imu, wheels);
  if (finding.severity == Severity::kFault || turn < kTurns_rad_per_s) return finding;
  finding.severity = Severity::kFault;
  finding.what = "the wheels turn with no more than " + significant(fastest, 2) + " rad/s, while " +
                 recording.label<ImuSample>(recording.imu_sensor) + " turns with " +
                 significant(turn, 2) +
                 " rad/s: their unit, not connected, or the robot is carried";
  finding.figures.push_back({"turn", turn, "rad/s"});
  return finding;
}

/// Drives that give one number all the time while another moves.
void check_drives(const Recording& recording, const Wheels& wheels, const std::string& label,
                  Findings& out) {
  constexpr double kMoves_rad_per_s = 0.1;
  DriveRanges ranges(wheels.model->description().n_drive);
  for (const EncoderSample& sample : wheels.samples) ranges.add(sample);
  const double fastest = ranges.fastest();
  if (fastest < kMoves_rad_per_s) {
    return out.push_back(standstill(recording, wheels, label, fastest));
  }
  if (std::ssize(wheels.samples) < kFewestReadings) return;
  for (const auto& [drive, value] : ranges.stuck()) {
    out.push_back({label, Severity::kFault, "channel",
                   "drive_" + std::to_string(drive + 1) + " reads " + significant(value, 3) +
                       " rad/s all the time, while another turns with up to " +
                       significant(fastest, 3) + " rad/s: not connected, or not read"});
  }
}

/// By how much it turns otherwise than wheels that are never steered let it, rad/s: such a base
/// turns as fast as it drives, by one factor.
double turns_otherwise(const Wheels& wheels, const RateGrid& yaw) {
  Eigen::Matrix2d N = Eigen::Matrix2d::Zero();
  Eigen::Vector2d h = Eigen::Vector2d::Zero();
  double squares = 0.;
  for (const EncoderSample& sample : wheels.samples) {
    const std::int64_t cell = (sample.t_ns - yaw.begin_ns()) / RateGrid::kCellNs;
    if (sample.t_ns < yaw.begin_ns() || cell >= static_cast<std::int64_t>(yaw.size())) continue;
    if (!yaw.has(static_cast<std::size_t>(cell))) continue;
    const double rate = yaw[static_cast<std::size_t>(cell)].z();
    double drive = 0.;
    for (const double one : sample.drive_rad_per_s) drive += one;
    const Eigen::Vector2d a(drive, 1.);  // and the bias of the gyro
    N += a * a.transpose();
    h += rate * a;
    squares += rate * rate;
  }
  if (N(1, 1) < kFewestReadings) return 0.;
  const double left = squares - h.dot(N.ldlt().solve(h));
  const double mean = h[1] / N(1, 1);
  const double turns = squares / N(1, 1) - mean * mean;
  constexpr double kPart = 0.25;  // of the turning, what one factor leaves
  return left > kPart * turns * N(1, 1) ? std::sqrt(left / N(1, 1)) : 0.;
}

/// Steerings that give one number all the time, while others move, or the base turns otherwise.
void check_steerings(const Recording& recording, const Wheels& wheels, const std::string& label,
                     Findings& out) {
  constexpr double kSteers_rad = 0.1, kTurns_rad_per_s = 0.1;
  const auto n = static_cast<std::size_t>(wheels.model->description().n_steer);
  if (n == 0 || std::ssize(wheels.samples) < kFewestReadings) return;
  std::vector<double> ranges(n, 0.);
  double largest = 0.;
  for (std::size_t i = 0; i < n; ++i) {
    const auto angle = [i](const EncoderSample& sample) { return sample.steer_rad[i]; };
    const auto [least, most] = std::ranges::minmax_element(wheels.samples, {}, angle);
    ranges[i] = angle(*most) - angle(*least);
    largest = std::max(largest, ranges[i]);
  }
  std::string while_what;
  if (largest > kSteers_rad) {
    while_what = "another moves by " + significant(largest, 2) + " rad";
  } else {
    for (const YawRates& rates : yaw_rates_of(recording, wheels.prior)) {
      const series::Span span = span_of(recording);
      const double turns = turns_otherwise(wheels, {span.begin_ns, span.end_ns, rates.turns});
      if (turns < kTurns_rad_per_s) continue;
      while_what = rates.label + " turns by " + significant(turns, 2) +
                   " rad/s (standard deviation) otherwise than a base with such wheels can";
      break;
    }
  }
  if (while_what.empty()) return;
  for (std::size_t i = 0; i < n; ++i) {
    if (ranges[i] > 0.) continue;
    out.push_back({label, Severity::kFault, "channel",
                   "steer_" + std::to_string(i + 1) + " reads " +
                       significant(wheels.samples.front().steer_rad[i], 3) +
                       " rad all the time, while " + while_what + ": not connected, or not read"});
  }
}

}  // namespace

void check_still_channels(const Recording& recording, Findings& out) {
  for (const Wheels& wheels : recording.wheels) {
    if (!wheels.unusable.empty() || wheels.samples.empty()) continue;
    const std::string label = recording.label<EncoderSample>(wheels.sensor);
    check_drives(recording, wheels, label, out);
    check_steerings(recording, wheels, label, out);
  }
}

}  // namespace viwo::inspect

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "viwo/eval/statistics.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/series/rate_grid.hpp"
#include "viwo/wheel/contradicted_channels.hpp"
#include "viwo/wheel/drive_ranges.hpp"
#include "viwo/wheel_checks/wheel_checks.hpp"

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

/// Means over half a second, so that what shakes the gyro counts for little: its rate, and the one
/// rate of drives that all turn in proportion.
struct Together {
  double yaw = 0., drive = 0.;
};
std::vector<Together> means_of(const Wheels& wheels, const RateGrid& yaw) {
  constexpr std::int64_t kMean_ns = 500'000'000;
  const auto n = static_cast<Eigen::Index>(wheels.model->description().n_drive);
  const auto drives_of = [n](const EncoderSample& sample) {
    return Eigen::Map<const Eigen::VectorXd>(sample.drive_rad_per_s.data(), n);
  };
  Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(n, n);
  for (const EncoderSample& sample : wheels.samples) {
    squares += drives_of(sample) * drives_of(sample).transpose();
  }
  const Eigen::VectorXd one =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(squares).eigenvectors().col(n - 1);
  std::vector<Together> means;
  Together sum;
  double count = 0.;
  std::int64_t end_ns = 0;
  const std::int64_t later_ns = to_ns(wheels.prior.wheels.t_OtoI_s);
  for (const EncoderSample& sample : wheels.samples) {
    if (sample.t_ns >= end_ns) {
      constexpr double kFewest = 3.;
      if (count >= kFewest) means.push_back({sum.yaw / count, sum.drive / count});
      sum = {};
      count = 0.;
      end_ns = sample.t_ns + kMean_ns;
    }
    const std::int64_t since_ns = sample.t_ns + later_ns - yaw.begin_ns();
    const auto cell = static_cast<std::size_t>(since_ns / RateGrid::kCellNs);
    if (since_ns < 0 || cell >= yaw.size() || !yaw.has(cell)) continue;
    sum.yaw += yaw[cell].z();
    sum.drive += one.dot(drives_of(sample));
    count += 1.;
  }
  return means;
}

/// By how much it turns otherwise than wheels that are never steered let it, rad/s: such a base has
/// one motion alone, faster or slower, and turns in proportion to its drives.
double turns_otherwise(const std::vector<Together>& means) {
  constexpr double kFewestMeans = 20., kPart = 0.25;  // of the turning, what one factor leaves
  Eigen::Matrix2d N = Eigen::Matrix2d::Zero();
  Eigen::Vector2d h = Eigen::Vector2d::Zero();
  double squares = 0.;
  for (const Together& mean : means) {
    const Eigen::Vector2d a(mean.drive, 1.);  // and the bias of the gyro
    N += a * a.transpose();
    h += mean.yaw * a;
    squares += mean.yaw * mean.yaw;
  }
  const double n = N(1, 1);
  if (n < kFewestMeans) return 0.;
  const double left = (squares - h.dot(N.ldlt().solve(h))) / n;
  const double variance = squares / n - h[1] * h[1] / (n * n);
  return left > kPart * variance ? std::sqrt(left) : 0.;
}

/// Why none of the steerings can stand still; "" for no reason.
std::string turning_without_steering(const Recording& recording, const Wheels& wheels) {
  constexpr double kTurns_rad_per_s = 0.1;
  const series::Span span = span_of(recording);
  for (const YawRates& rates : yaw_rates_of(recording, wheels.prior)) {
    const double turns =
        turns_otherwise(means_of(wheels, {span.begin_ns, span.end_ns, rates.turns}));
    if (turns < kTurns_rad_per_s) continue;
    return rates.label + " turns by " + significant(turns, 2) +
           " rad/s (standard deviation) otherwise than a base with such wheels can";
  }
  return "";
}

/// Steerings that give one number all the time, while others move and contradict them, or while
/// none does and the base turns otherwise.
void check_steerings(const Recording& recording, const Wheels& wheels, const std::string& label,
                     Findings& out) {
  const auto n = static_cast<std::size_t>(wheels.model->description().n_steer);
  if (n == 0 || std::ssize(wheels.samples) < kFewestReadings) return;
  std::vector<std::size_t> still;
  for (std::size_t i = 0; i < n; ++i) {
    const double first = wheels.samples.front().steer_rad[i];
    const bool is_still = std::ranges::all_of(
        wheels.samples, [&](const EncoderSample& sample) { return sample.steer_rad[i] == first; });
    if (is_still) still.push_back(i);
  }
  if (still.empty()) return;
  const std::string turning = still.size() == n ? turning_without_steering(recording, wheels) : "";
  std::vector<ContradictedChannel> contradicted;
  if (still.size() < n) {
    const Intrinsics& sigma = wheels.prior.sigma_intrinsics;
    contradicted = contradicted_channels(wheels.samples, wheels.model, wheels.prior.wheels.x_WI,
                                         IntrinsicMatrix(sigma.cwiseAbs2().asDiagonal()));
  }
  for (const std::size_t i : still) {
    const std::string name = "steer_" + std::to_string(i + 1);
    const bool is_contradicted =
        std::ranges::any_of(contradicted, [&](const auto& one) { return one.name == name; });
    if (turning.empty() && !is_contradicted) continue;
    out.push_back({label, Severity::kFault, "channel",
                   name + " reads " + significant(wheels.samples.front().steer_rad[i], 3) +
                       " rad all the time, while " +
                       (turning.empty() ? "others move and contradict it" : turning) +
                       ": not connected, or not read"});
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

#include "motion_reference.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>

#include "recording_name.hpp"
#include "viwo/eval/hints.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/median.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/run/run.hpp"

namespace viwo::calibration {
namespace {

/// By how much the scatter about the axis of turning exceeds that about any other, at least.
constexpr double kStandsOut = 30.;

/// A label that is a number, if there is one of that name.
std::optional<double> number_of(const Recording& recording, const char* label, const char* what,
                                bool may_be_any) {
  const auto found = recording.labels.find(label);
  if (found == recording.labels.end()) return {};
  const std::string& text = found->second;
  double number = 0.;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || stop != end || !std::isfinite(number) ||
      !(may_be_any || number > 0.)) {
    fail(recording, ": " + std::string(label) + " is '" + text + "', not " + what);
  }
  return number;
}

StampedPose turned(std::int64_t t_ns, double yaw_rad) {
  StampedPose pose;
  pose.t_ns = t_ns;
  pose.q_BtoW = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ());
  return pose;
}

/// Whether the way goes on along a line: who goes to and fro may well turn at its ends.
bool goes_straight_on(const Trajectory& poses) {
  constexpr double kDetour = 1.5;
  return !eval::bends(poses) &&
         eval::way_m(poses) < kDetour * (poses.back().p_BinW - poses.front().p_BinW).norm();
}

/// By how much the wheels alone have the base turn where the reference gives the same orientation
/// all the time, as positions alone do; 0 where it gives orientations, or goes straight on.
double turn_unseen_by_poses(const RunSetup& setup, const RunData& data) {
  if (are_turned(data.reference) || goes_straight_on(data.reference)) return 0.;
  double turn_rad = 0.;
  for (const StampedPose& pose : run_odometry(setup, data).estimate) {
    turn_rad = std::max(turn_rad, std::abs(yaw(pose)));
  }
  return turn_rad;
}

}  // namespace

Eigen::Vector3d turning_axis(std::span<const ImuSample> imu) {
  Eigen::Vector3d rate = Eigen::Vector3d::Zero(), force = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : imu) {
    rate += to_vector(sample.gyro_rad_per_s);
    force += to_vector(sample.accel_m_per_s2);
  }
  rate /= static_cast<double>(imu.size());
  if (!(force.norm() > 0.)) {
    throw InputError("the accelerometer reads zero: which way is up is not known");
  }
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const ImuSample& sample : imu) {
    const Eigen::Vector3d deviation = to_vector(sample.gyro_rad_per_s) - rate;
    scatter += deviation * deviation.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scatter);
  if (eigen.eigenvalues()[2] < kStandsOut * eigen.eigenvalues()[1]) return force.normalized();
  const Eigen::Vector3d axis = eigen.eigenvectors().col(2);
  return axis.dot(force) < 0. ? Eigen::Vector3d(-axis) : axis;
}

Trajectory yaw_of_gyro(std::span<const ImuSample> imu) {
  const Eigen::Vector3d axis = turning_axis(imu);
  Trajectory out;
  out.reserve(imu.size());
  double yaw = 0., rate_before = 0.;
  for (const ImuSample& sample : imu) {
    const double rate = axis.dot(to_vector(sample.gyro_rad_per_s));
    if (!out.empty()) {
      yaw += 0.5 * (rate_before + rate) * seconds_between(out.back().t_ns, sample.t_ns);
    }
    rate_before = rate;
    out.push_back(turned(sample.t_ns, yaw));
  }
  return out;
}

Trajectory yaw_of_headings(std::span<const HeadingSample> headings) {
  Trajectory out;
  out.reserve(headings.size());
  for (const HeadingSample& heading : headings)
    out.push_back(turned(heading.t_ns, heading.yaw_rad));
  return out;
}

/// `usual_s`, or more where the samples are further apart all the time.
template <class SampleType>
static double longest_gap_s(std::span<const SampleType> samples, double usual_s) {
  constexpr double kPeriods = 2.5;
  std::vector<double> periods_s;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    periods_s.push_back(seconds_between(samples[i - 1].t_ns, samples[i].t_ns));
  }
  return periods_s.empty() ? usual_s : std::max(usual_s, kPeriods * upper_median(periods_s));
}

MotionReference motion_reference(const Recording& label, const RunSetup& setup, const RunData& data,
                                 ReferenceKind kind) {
  MotionReference out;
  out.kind = kind;
  const bool has_gyro = !data.imu().empty() || !data.headings().empty();
  if (kind == ReferenceKind::kAuto) {
    if (data.reference.empty() && !has_gyro) {
      fail(label,
           " has neither a reference nor a gyro to calibrate against; wheels alone, "
           "with distance_m or turn_deg as labels of the recordings, are reference: none");
    }
    out.kind = data.reference.empty() ? ReferenceKind::kGyro : ReferenceKind::kPoses;
  }
  if (out.kind == ReferenceKind::kPoses && !data.reference.empty()) {
    constexpr double kTurns_rad = 0.5;
    const double turn_rad = turn_unseen_by_poses(setup, data);
    if (turn_rad > kTurns_rad && kind == ReferenceKind::kAuto && has_gyro) {
      out.kind = ReferenceKind::kGyro;
    } else if (turn_rad > kTurns_rad) {
      fail(label,
           " has reference poses of one orientation all the time, while the wheels turn the "
           "base by " +
               significant(turn_rad, 2) +
               " rad: positions alone tell no turns - reference: gyro, where the log has "
               "one, or poses with their orientations");
    }
  }
  if (out.kind == ReferenceKind::kPoses) {
    if (data.reference.empty()) fail(label, " has no reference poses to calibrate against");
    out.poses = data.reference;
    out.offset_s = setup.reference_time_offset_s;
    out.max_gap_s = setup.evaluation.max_reference_gap_s;
  } else if (out.kind == ReferenceKind::kGyro) {
    if (!has_gyro) fail(label, " has no gyro to calibrate against");
    out.offset_s = setup.t_OtoI_s;
    // Headings are often logged where they change only.
    if (data.imu().empty()) {
      out.max_gap_s = longest_gap_s(data.headings(), 0.5);
      out.poses = yaw_of_headings(data.headings());
    } else {
      out.max_gap_s = longest_gap_s(data.imu(), 0.1);
      out.poses = yaw_of_gyro(data.imu());
    }
  }
  out.distance_m = number_of(label, "distance_m", "a distance in metres above 0", false);
  out.turn_rad = number_of(label, "turn_deg", "an angle in degrees", true);
  if (out.turn_rad) *out.turn_rad *= std::numbers::pi / 180.;
  return out;
}

}  // namespace viwo::calibration

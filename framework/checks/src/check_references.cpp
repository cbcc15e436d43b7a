#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "pose_orientation.hpp"
#include "viwo/checks/checks.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/series/beside_imu.hpp"
#include "viwo/series/lag.hpp"
#include "viwo/series/rate_grid.hpp"

namespace viwo::inspect {

using series::BesideGyro;
using series::Poses;
using series::RateGrid;
using series::Recording;
using series::Span;
using series::Vertical;

namespace {

constexpr double kDegrees = 180. / std::numbers::pi;

std::string angle_text(double rad) {
  return significant(1e3 * rad, 2) + " mrad (" + significant(kDegrees * rad, 2) + " deg)";
}

/// Of the body of the poses in the IMU, roughly.
Eigen::Matrix3d mounting_of(const Recording& recording, const Poses& poses) {
  if (poses.of_imu) return Eigen::Matrix3d::Identity();
  const Span span = span_of(recording);
  const auto R_ItoB =
      rotation_between(RateGrid(span.begin_ns, span.end_ns, series::turns_of(recording.imu)),
                       RateGrid(span.begin_ns, span.end_ns, series::turns_of(poses.poses)));
  return R_ItoB ? Eigen::Matrix3d(R_ItoB->transpose()) : Eigen::Matrix3d::Identity();
}

/// Noise of the orientations; worth knowing where it is more than the gyro's.
void check_orientations(const Recording& recording, const BesideGyro& beside,
                        const std::string& label, Findings& out) {
  constexpr double kOfGyro = 3.;
  const ImuNoise& noise = recording.setup->filter->options.filter.imu_noise;
  Finding finding{
      label,
      Severity::kFits,
      "orientation noise",
      "its orientations scatter by " + angle_text(beside.sigma_rad) + " per axis around what " +
          recording.label<ImuSample>(recording.imu_sensor) + " turns in a second",
      {{"sigma", beside.sigma_rad, "rad"}, {"pairs", static_cast<double>(beside.pairs), ""}}};
  if (beside.sigma_rad > kOfGyro * noise.gyro_rad_per_s_sqrt_hz) {  // over a second
    finding.severity = Severity::kNote;
    finding.what += ": errors of an orientation that are no larger, and their NEES, tell of it";
  }
  out.push_back(finding);
}

/// Whether the fit has found gravity: positions may be too noisy, or no motion tells it.
bool tells(const Vertical& vertical) {
  constexpr double kGravity = 9.81, kPart = 0.05, kUnknown_rad = 0.1;
  return std::abs(vertical.gravity_m_per_s2 / kGravity - 1.) < kPart &&
         vertical.sigma_rad < kUnknown_rad;
}

/// Whether its z is that of gravity, as a filter that starts from it takes it to be.
void check_vertical(const Recording& recording, const Poses& poses, const Vertical& vertical,
                    const std::string& label, Findings& out) {
  constexpr double kSigmas = 4., kStartSigmas = 3.;
  Finding finding{label,
                  Severity::kFits,
                  "vertical",
                  "the z axis of its world is " + angle_text(vertical.tilt_rad) + " +- " +
                      significant(1e3 * vertical.sigma_rad, 2) + " mrad off gravity's vertical",
                  {{"tilt", vertical.tilt_rad, "rad"},
                   {"sigma", vertical.sigma_rad, "rad"},
                   {"gravity", vertical.gravity_m_per_s2, "m/s^2"},
                   {"windows", static_cast<double>(vertical.windows), ""}}};
  if (vertical.tilt_rad > kSigmas * vertical.sigma_rad) {
    finding.severity = Severity::kNote;
    finding.what += ": roll and pitch against it are off by that";
    const auto& start = recording.setup->filter->start;
    if (poses.of_imu && start.mode == StartMode::kReference &&
        vertical.tilt_rad > kStartSigmas * start.sigma_orientation_rad) {
      finding.severity = Severity::kFault;
      finding.what += ", and a filter that starts from it as surely as that";
      finding.remedies = {
          {"estimator.sigma_start_orientation_rad", significant(vertical.tilt_rad, 2)}};
    }
  }
  out.push_back(finding);
}

}  // namespace

void check_references(const Recording& recording, Findings& out) {
  if (recording.imu.empty() || !recording.setup->filter) return;
  for (const Poses& poses : recording.poses) {
    const std::string label = recording.label(poses);
    const bool is_wrong = is_fault(out, label, "orientation") || is_fault(out, label, "axes") ||
                          is_fault(out, label, "clock") || is_fault(out, label, "jumps");
    if (is_wrong || !are_turned(poses.poses)) continue;
    const std::optional<BesideGyro> beside =
        series::compare_with_gyro(poses.poses, recording.imu, mounting_of(recording, poses));
    if (!beside) continue;
    check_orientations(recording, *beside, label, out);
    // A mounting that turns hardly tell looks like a bias.
    constexpr double kMounting_rad = 0.05;
    BesideGyro mounting = *beside;
    // The mean of a bias over the recording, which wanders on the way.
    const double walk =
        recording.setup->filter->options.filter.imu_noise.accel_walk_m_per_s3_sqrt_hz;
    double sigma_bias = std::hypot(
        recording.setup->filter->start.sigma_accel_bias_m_per_s2,
        walk *
            std::sqrt(seconds_between(recording.imu.front().t_ns, recording.imu.back().t_ns) / 3.));
    if (poses.of_imu) {
      mounting.R_BtoI.setIdentity();
    } else {
      sigma_bias = std::hypot(
          sigma_bias, kMounting_rad * recording.setup->filter->options.filter.gravity_m_per_s2);
    }
    const std::optional<Vertical> vertical =
        series::find_vertical(poses.poses, recording.imu, mounting, sigma_bias);
    if (vertical && tells(*vertical)) check_vertical(recording, poses, *vertical, label, out);
  }
}

}  // namespace viwo::inspect

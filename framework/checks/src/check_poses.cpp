#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "pose_jumps.hpp"
#include "pose_orientation.hpp"
#include "viwo/checks/checks.hpp"
#include "viwo/checks/clock_finding.hpp"
#include "viwo/eval/statistics.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/plausibility/channel_change.hpp"
#include "viwo/plausibility/yaw_order.hpp"
#include "viwo/series/lag.hpp"
#include "viwo/series/pose_speeds.hpp"
#include "viwo/series/wheel_calibration.hpp"

namespace viwo::inspect {

using series::CameraTurns;
using series::Lag;
using series::Poses;
using series::RateGrid;
using series::Recording;
using series::Span;
using series::Speeds;
using series::Turn;
using series::turns_of;
using series::Wheels;

namespace {

using Eigen::Vector3d;

constexpr std::size_t kFewestWindows = 5;
/// Slip, tyres and poses that are decimetres off stay within; a wrong diameter does not.
constexpr double kMostFactor = 0.15;
/// Of units that gears may look like: with a radius that is wrong, too, it is not known which it
/// is.
double most_off(double factor) { return factor > 50. ? kMostFactor : 0.05; }

struct Unit {
  double factor;  ///< of rad/s
  const char* name;
};

void check_heading(const Speeds& speeds, const std::string& label, const std::string& other,
                   Findings& out) {
  const Eigen::Vector2d mean = speeds.mean_direction();
  const double angle = std::atan2(mean.y(), mean.x());
  Finding heading{label,
                  Severity::kFits,
                  "heading",
                  "goes where " + other + " goes",
                  {{"angle", angle, "rad"}, {"in common", mean.norm(), ""}}};
  constexpr double kReversed_rad = 2.7, kTurned_rad = 0.1, kLeastInCommon = 0.7;
  if (mean.norm() < kLeastInCommon) {
    heading.severity = Severity::kFault;
    heading.what =
        "goes now to this and now to that side of where " + other +
        " goes: its positions and orientations do not belong together - x and y "
        "exchanged or mirrored, the unit, sign or column of the yaw - or zeros and signs "
        "of the wheels";
  } else if (std::abs(angle) > kReversed_rad) {
    heading.severity = Severity::kFault;
    heading.what =
        "goes backwards where " + other +
        " goes forwards: sign of all drives, or the frame of the poses is turned by half "
        "a turn";
  } else if (std::abs(angle) > kTurned_rad) {
    heading.severity = Severity::kNote;
    heading.what = "goes " + significant(angle, 3) + " rad beside where " + other +
                   " goes: the body of the poses is turned on the base (estimate_extrinsics: true "
                   "of viwo calibrate, evaluation.extrinsics_x_m_y_m_yaw_rad of a run), or zeros "
                   "of the steering";
  }
  out.push_back(heading);
}

/// Of a side, or a drive of two, that is reversed or has another gear: where the base goes straight
/// the one change without which the wheels go as far as the poses, and to where those go.
bool check_sides(const Wheels& wheels, const Poses& poses, const std::string& label,
                 const std::string& other, Findings& out) {
  std::optional<Finding> found;
  constexpr double kNoContradiction_m_per_s = 0.005;  // where nothing contradicts anything
  const Intrinsics& x_WI = wheels.prior.wheels.x_WI;
  const double as_it_is = parity_of(wheels, x_WI).rms;
  for (const ChannelChange& change : changes_by_gyro(wheels.model, x_WI)) {
    const bool is_scale =
        change.kind == ChannelChange::kSideScale || change.kind == ChannelChange::kDriveScale;
    if (!is_scale) continue;
    Wheels changed = wheels;
    for (EncoderSample& sample : changed.samples) change.undo(sample);
    if (parity_of(changed, x_WI).rms > 1.1 * as_it_is + kNoContradiction_m_per_s) continue;
    const Speeds speeds = speeds_of(changed, poses);
    if (speeds.ratio.size() < kFewestWindows || speeds.direction.empty()) continue;
    const double ratio = eval::median(speeds.ratio);
    if (std::abs(ratio - 1.) > kMostFactor || speeds.mean_direction().x() < 0.) continue;
    if (found) return false;  // whichever it is, if it is one of them
    found = {label,
             Severity::kFault,
             "order",
             change.text() + " (without that they go " + significant(ratio, 3) +
                 " times as far as " + other + ")",
             {{"wheels by poses", ratio, ""}},
             change.remedies(wheels.sensor, wheels.model->description())};
  }
  if (!found) return false;
  if (!is_fault(out, label, "order")) out.push_back(std::move(*found));
  return true;
}

/// Why wheels go `ratio` times as far as poses say: the unit of one of them, if that explains it.
void name_unit(double ratio, const Wheels& wheels, const Poses& poses, const std::string& other,
               Finding& finding) {
  // Of rates, and of speeds and positions that somebody has made metres of.
  const std::array<Unit, 6> units = {Unit{180. / std::numbers::pi, "deg/s"},
                                     Unit{30. / std::numbers::pi, "revolutions per minute"},
                                     Unit{0.5 / std::numbers::pi, "revolutions per second"},
                                     Unit{3.6, "km/h, taken for m/s"},
                                     Unit{100., "cm/s, taken for m/s"},
                                     Unit{1000., "mm/s, taken for m/s"}};
  constexpr std::array<std::pair<double, const char*>, 2> kOfPoses = {
      {{0.01, "cm"}, {0.001, "mm"}}};
  const auto unit = std::find_if(units.begin(), units.end(), [&](const Unit& u) {
    return std::abs(ratio / u.factor - 1.) < most_off(u.factor);
  });
  const auto* const of_poses = std::find_if(kOfPoses.begin(), kOfPoses.end(), [&](const auto& one) {
    return std::abs(ratio / one.first - 1.) < most_off(1. / one.first);
  });
  if (of_poses != kOfPoses.end()) {
    finding.what += ": positions of " + other + " are in " + of_poses->second;
    finding.remedies = {{"sensors." + poses.sensor + ".position_unit", of_poses->second}};
  } else if (unit != units.end()) {
    finding.what += std::string(": drives are in ") + unit->name;
    const auto entry = [&](std::size_t) { return significant(1. / unit->factor, 10); };
    const auto n = static_cast<std::size_t>(wheels.model->description().n_drive);
    finding.remedies = {{"sensors." + wheels.sensor + ".drive_scale", yaml_list(n, entry)}};
  } else {
    finding.what +=
        ": radius of the wheels (a diameter?), gear ratio or counts per turn, or "
        "their unit";
  }
}

/// How far the wheels say that the base went, by how far the poses say.
void check_speed(const Recording& recording, const Wheels& wheels, const Poses& poses,
                 const std::string& other, Findings& out) {
  const std::string label = recording.label<EncoderSample>(wheels.sensor);
  const Speeds speeds = speeds_of(wheels, poses);
  const bool has_heading = are_turned(poses.poses);
  if (speeds.ratio.size() < kFewestWindows) {
    // Of a base that turns all the time the direction shows in short ones.
    const Speeds brief = speeds_of(wheels, poses, {.length_s = 0.25, .way_m = 0.15});
    if (has_heading && brief.direction.size() >= 4 * kFewestWindows)
      check_heading(brief, label, other, out);
    return;
  }
  const double ratio = eval::median(speeds.ratio);
  Finding finding{label,
                  Severity::kFits,
                  "speed",
                  "goes " + significant(ratio, 3) + " times as far as " + other,
                  {{"wheels by poses", ratio, ""},
                   {"windows", static_cast<double>(speeds.ratio.size()), ""},
                   {"path", speeds.path_m, "m"}}};
  const double spread = 1.2 *
                        (eval::quantile(speeds.ratio, 0.75) - eval::quantile(speeds.ratio, 0.25)) /
                        std::sqrt(static_cast<double>(speeds.ratio.size()));
  finding.figures.push_back({"sigma", spread, ""});
  if (std::abs(ratio - 1.) > std::max(kMostFactor, 3. * spread)) {
    finding.severity = Severity::kFault;
    // A gyro tells it, if there is one.
    const bool has_gyro = !recording.imu.empty() || !recording.headings.empty();
    if (!has_gyro && check_sides(wheels, poses, label, other, out)) return;
    name_unit(ratio, wheels, poses, other, finding);
  }
  out.push_back(finding);
  if (has_heading && speeds.direction.size() >= kFewestWindows)
    check_heading(speeds, label, other, out);
}

/// Whether a camera that is turned from the IMU is turned as much as R says: then it is the IMU.
bool is_turned_likewise(const Recording& recording, const CameraTurns& camera,
                        const Eigen::Matrix3d& R, const Findings& findings) {
  constexpr double kAlike_rad = 0.26;
  if (!is_fault(findings, label_of(recording, camera), "axes")) return false;
  const Span span = span_of(recording);
  const auto of_camera =
      rotation_between(RateGrid(span.begin_ns, span.end_ns, turns_of(recording.imu)),
                       RateGrid(span.begin_ns, span.end_ns, turns_in_imu(recording, camera)));
  return of_camera && log_so3(of_camera->transpose() * R).norm() < kAlike_rad;
}

/// Whether the body of reference states is the IMU, as they are taken.
bool has_axes_of_imu(const Recording& recording, const Poses& poses, const std::string& label,
                     Findings& out) {
  const Span span = span_of(recording);
  const auto R = rotation_between(RateGrid(span.begin_ns, span.end_ns, turns_of(recording.imu)),
                                  RateGrid(span.begin_ns, span.end_ns, turns_of(poses.poses)));
  const double angle = R ? log_so3(*R).norm() * 180. / std::numbers::pi : 0.;
  constexpr double kMostAngle = 15.;
  if (angle <= kMostAngle) return true;
  const bool cameras_say_so = std::ranges::any_of(recording.cameras, [&](const auto& camera) {
    return is_turned_likewise(recording, camera, *R, out);
  });
  if (cameras_say_so) {
    const std::string imu = recording.label<ImuSample>(recording.imu_sensor);
    out.push_back({imu,
                   Severity::kFault,
                   "axes",
                   "turns otherwise than cameras and " + label +
                       " do: signs or order of its columns, or the unit of one",
                   {}});
    return false;
  }
  const Eigen::Quaterniond q(*R);
  out.push_back({label,
                 Severity::kFault,
                 "axes",
                 "its body is turned by " + significant(angle, 3) +
                     " deg from the IMU (quaternion xyzw of I in it " + significant(q.x(), 3) +
                     " " + significant(q.y(), 3) + " " + significant(q.z(), 3) + " " +
                     significant(q.w(), 3) +
                     "): reference states must be those of the IMU - turn them, or choose asl_pose",
                 {{"angle", angle, "deg"}}});
  return false;
}

/// By how much two may turn as fast as each other: beyond is a note, and a fault.
struct MostRatio {
  double note, fault;
};

/// Where `label` turns when `other` does, but `ratio` times as fast.
void check_size_of_turns(const std::string& label, const std::string& other, double ratio,
                         const MostRatio& most_ratio, const std::string& causes, Findings& out) {
  constexpr double kDegrees = 180. / std::numbers::pi;
  const double most = std::max(ratio, 1. / ratio);
  if (!(ratio > 0.) || most < most_ratio.note) return;
  const bool are_degrees = std::abs(most / kDegrees - 1.) < 0.2;
  out.push_back({label,
                 most < most_ratio.fault ? Severity::kNote : Severity::kFault,
                 "turns",
                 "turns " + significant(ratio, 3) + " times as fast as " + other + ": " +
                     (are_degrees ? "one of the two is in degrees" : causes),
                 {{"turns by " + other, ratio, ""}}});
}

/// Clock, sign and size of the turns of poses against others of the same frame.
void check_clock(const Recording& recording, std::vector<Turn> of_poses, const std::string& label,
                 const std::vector<Turn>& turns, const std::string& other, double configured_s,
                 Findings& out) {
  const Span span = span_of(recording);
  of_poses = shifted(std::move(of_poses), -configured_s);
  const RateGrid a(span.begin_ns, span.end_ns, turns), b(span.begin_ns, span.end_ns, of_poses);
  const std::optional<Lag> lag = find_lag(a, b);
  if (!lag) {
    out.push_back(
        {label, Severity::kNote, "clock",
         "too little rotation, or too little in common with " + other + ", to compare its clock"});
    return;
  }
  constexpr double kSameTurns = 0.9;
  if (lag->correlation > kSameTurns && recording.imu.empty()) {
    // Bases that slip are said to be wider than they are.
    check_size_of_turns(other, label, 1. / lag->slope, {.note = 1.25, .fault = 1.6},
                        "width of the base (baseline, track, centres of rotation), radii or gears "
                        "of the wheels, or units",
                        out);
  } else if (lag->correlation > kSameTurns) {
    // Least squares of one by the other, and of the other by the one: the truth is between them.
    const double least = lag->slope, most = least / (lag->correlation * lag->correlation);
    const double ratio = least > 1. ? least : std::min(most, 1.);
    check_size_of_turns(label, other, ratio, {.note = 1.03, .fault = 1.05},
                        "the scale of the gyro, or units of one of the two", out);
  }
  const double period_s = period_of(of_poses);
  const bool is_key = !recording.setup->filter;
  Finding clock = clock_finding(
      label,
      {"clock", "clock", is_key ? "odometry.reference_time_offset_s" : "the clock of the poses",
       other, -configured_s},
      *lag, 0., 2. * period_s);
  // t_reference = t_wheel + offset: what lags is later by that.
  if (!clock.remedies.empty()) {
    clock.remedies[0].value = significant(1e-4 * std::round(1e4 * (configured_s + lag->lag_s)), 6);
    if (!is_key) clock.remedies.clear();
  }
  // A reference is not what the filter runs on.
  if (clock.severity == Severity::kFault && !is_key) {
    clock.severity = Severity::kNote;
    clock.what += ": errors against it grow by the speed times that";
  }
  if (lag->correlation < -0.8) {
    clock.severity = Severity::kFault;
    clock.remedies.clear();
    clock.what = "turns opposite to " + other + " (correlation " +
                 significant(lag->correlation, 3) +
                 "): its z axis points down, its quaternion is inverted (world in body), or " +
                 other + " is reversed or has left and right exchanged";
  }
  out.push_back(clock);
}

/// Of what poses are compared with: turns about the vertical, as z.
struct YawTurns {
  std::vector<Turn> turns;
  std::string label;
  double configured_s = 0.;  ///< the clock of the poses by it, as configured
};
YawTurns yaw_turns_beside(const Recording& recording) {
  if (!recording.imu.empty()) {
    Vector3d up = up_of(recording.imu);
    if (up.norm() == 0. && !recording.wheels.empty()) {
      up = recording.wheels.front().prior.wheels.R_ItoO.row(2);
    }
    if (up.norm() == 0.) return {};
    return {about(turns_of(recording.imu), up), recording.label<ImuSample>(recording.imu_sensor)};
  }
  if (recording.wheels.empty() || recording.wheels.front().samples.empty()) return {};
  const Wheels& wheels = recording.wheels.front();
  return {turns_of(wheels), recording.label<EncoderSample>(wheels.sensor),
          recording.setup->reference_time_offset_s};
}

}  // namespace

void check_poses(const Recording& recording, Findings& out) {
  for (const Poses& poses : recording.poses) {
    if (poses.poses.size() < 10) continue;
    const std::string label = recording.label(poses);
    if (has_jumps(poses, label, out) || has_flips(poses, label, out)) continue;
    if (!recording.imu.empty() && poses.of_imu) {
      if (!has_axes_of_imu(recording, poses, label, out)) continue;
      check_clock(recording, turns_of(poses.poses), label, turns_of(recording.imu),
                  recording.label<ImuSample>(recording.imu_sensor), 0., out);
    } else if (const YawTurns yaw = yaw_turns_beside(recording); !yaw.turns.empty()) {
      if (!has_other_orientation(poses.poses, label, yaw.turns, yaw.label, out)) {
        check_clock(recording, turns_about(poses.poses), label, yaw.turns, yaw.label,
                    yaw.configured_s, out);
      }
    }
    if (is_fault(out, label, "orientation")) continue;
    for (const Wheels& wheels : recording.wheels) {
      if (!wheels.samples.empty()) check_speed(recording, wheels, poses, label, out);
    }
  }
}

}  // namespace viwo::inspect

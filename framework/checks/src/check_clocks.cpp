#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <string>

#include <Eigen/Cholesky>

#include "viwo/checks/checks.hpp"
#include "viwo/checks/clock_finding.hpp"
#include "viwo/eval/statistics.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/math/time_text.hpp"
#include "viwo/plausibility/imu_axes.hpp"
#include "viwo/plausibility/plausibility.hpp"
#include "viwo/series/lag.hpp"

namespace viwo::inspect {

using series::CameraTurns;
using series::Lag;
using series::RateGrid;
using series::Recording;
using series::Span;
using series::Turn;
using series::turns_of;
using series::Wheels;
using series::YawRates;

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// How the yaw rate that the gyro has comes from the twist that the wheels say, [b, c, 1]: wheels
/// that are not quite as configured take a part of a velocity for a turn, a base that drives in
/// curves both ways shows it, and it would be taken for a lag. Priors: 0.05 rad/m.
Vector3d yaw_of_twist(const RateGrid& gyro, const RateGrid& twists, double lag_s) {
  const auto lag = static_cast<std::int64_t>(std::lround(lag_s / RateGrid::kCell_s));
  Eigen::Matrix4d N = Eigen::Matrix4d::Zero();
  Eigen::Vector4d h = Eigen::Vector4d::Zero();
  double squares = 0., n = 0.;
  for (std::size_t i = 0; i < gyro.size(); ++i) {
    const std::int64_t j = static_cast<std::int64_t>(i) + lag;
    if (j < 0 || j >= static_cast<std::int64_t>(twists.size())) continue;
    const auto k = static_cast<std::size_t>(j);
    if (!gyro.has(i) || !twists.has(k)) continue;
    const Eigen::Vector4d by(1., twists[k].x(), twists[k].y(), twists[k].z());
    const double difference = gyro[i].z() - twists[k].z();
    N += by * by.transpose();
    h += difference * by;
    squares += difference * difference;
    n += 1.;
  }
  if (n < 100.) return Vector3d::UnitZ();
  const double left = (squares - h.dot(N.ldlt().solve(h))) / n;
  // What else they differ by, slopes of the ground or slip, lasts for half a second.
  constexpr double kSame = 0.5 / RateGrid::kCell_s, kPart = 0.05;
  N.diagonal().tail<3>().array() += kSame * std::max(left, 0.) / (kPart * kPart);
  const Eigen::Vector4d part = N.ldlt().solve(h);
  if (!part.allFinite() || part[3] <= -0.9) return Vector3d::UnitZ();
  return {part[1] / (1. + part[3]), part[2] / (1. + part[3]), 1.};
}

bool turns_meanwhile(const Recording& recording, std::int64_t from_ns, std::int64_t length_ns) {
  constexpr double kTurns_rad_per_s = 0.05;
  return std::any_of(recording.imu.begin(), recording.imu.end(), [&](const ImuSample& sample) {
    return sample.t_ns > from_ns && sample.t_ns < from_ns + length_ns &&
           to_vector(sample.gyro_rad_per_s).norm() > kTurns_rad_per_s;
  });
}

/// Images that show nothing, or the same again, while others come.
void check_tracks(const Recording& recording, const CameraTurns& camera, const std::string& label,
                  Findings& out) {
  constexpr double kLong_s = 1.;
  std::int64_t blind_ns = 0, blind_from_ns = 0, same_from_ns = 0, longest_ns = 0,
               longest_from_ns = 0;
  for (std::size_t i = 0; i < camera.turns.size(); ++i) {
    const Turn& turn = camera.turns[i];
    if (i > 0 && turn.begin_ns - camera.turns[i - 1].end_ns > blind_ns) {
      blind_ns = turn.begin_ns - camera.turns[i - 1].end_ns;
      blind_from_ns = camera.turns[i - 1].end_ns;
    }
    // No camera finds a hundred points where they were, to the last bit.
    constexpr double kSame = 1e-9;
    if (turn.rate.norm() > kSame || i == 0) same_from_ns = turn.end_ns;
    if (turn.end_ns - same_from_ns > longest_ns) {
      longest_ns = turn.end_ns - same_from_ns;
      longest_from_ns = same_from_ns;
    }
  }
  const auto from = [&](std::int64_t t_ns) { return time_text(t_ns - recording.begin_ns()); };
  const double blind_s = 1e-9 * static_cast<double>(blind_ns);
  if (blind_s > kLong_s) {
    out.push_back({label,
                   Severity::kNote,
                   "tracks",
                   "no two images share eight points for " + significant(blind_s, 2) + " s from " +
                       from(blind_from_ns) + " on",
                   {{"longest without points", blind_s, "s"}}});
  }
  const double points = std::accumulate(camera.points.begin(), camera.points.end(), 0.);
  const double far = camera.far / points;
  constexpr double kMostFar = 0.05;
  if (far > kMostFar) {
    out.push_back({label,
                   Severity::kFault,
                   "tracks",
                   significant(100. * far, 2) +
                       " % of the points are elsewhere in the next image, more than 14 deg from "
                       "where the others say: wrong matches, numbers that are used again, or "
                       "images of two cameras under one number",
                   {{"elsewhere", far, ""}}});
  }
  const double same_s = 1e-9 * static_cast<double>(longest_ns);
  if (same_s > kLong_s && turns_meanwhile(recording, longest_from_ns, longest_ns)) {
    out.push_back({label,
                   Severity::kFault,
                   "tracks",
                   "the same points in all images for " + significant(same_s, 2) + " s from " +
                       from(longest_from_ns) + " on, while the gyro turns: it was frozen",
                   {{"frozen", same_s, "s"}}});
  }
}

/// A camera that turns as the gyro does once it is turned by R, `angle` degrees.
bool is_mounted_otherwise(const Eigen::Matrix3d& R, double angle, const std::vector<Turn>& gyro,
                          const std::vector<Turn>& turns, const Span& span,
                          const std::string& label, const std::string& imu, Findings& out) {
  // Points that are near spoil the axes by less than that.
  constexpr double kMostAngle = 15.;
  if (angle <= kMostAngle) return false;
  const auto turned = find_lag(RateGrid(span.begin_ns, span.end_ns, gyro),
                               RateGrid(span.begin_ns, span.end_ns, rotated(turns, R.transpose())));
  if (!turned || turned->correlation <= 0.8) return false;
  out.push_back({label,
                 Severity::kFault,
                 "axes",
                 "turns as " + imu + " does only if it is mounted " + significant(angle, 3) +
                     " deg otherwise than the calibration says (correlation " +
                     significant(turned->correlation, 3) +
                     "): T_cam_imu in the file of section cameras is inverted, of another "
                     "camera, or of another IMU",
                 {{"angle", angle, "deg"}, {"correlation", turned->correlation, ""}}});
  return true;
}

}  // namespace

/// A gyro of which another axis turns as the wheels do than the vertical. `vertically`: the largest
/// correlation of wheels with that.
void check_gyro_columns(const Recording& recording, double vertically, Findings& out) {
  constexpr double kAlike = 0.8, kClearly = 0.3, kMostLag_s = 0.2, kMostScale = 2., kAlong = 0.7;
  if (recording.imu.empty() || vertically > kAlike) return;
  const Vector3d up = up_of(recording.imu);
  if (up.norm() == 0.) return;
  const Span span = span_of(recording);
  const std::vector<Turn> gyro = turns_of(recording.imu);
  double most = 0.;
  Vector3d axis = Vector3d::Zero();
  std::string label;
  for (const Wheels& wheels : recording.wheels) {
    if (wheels.samples.empty()) continue;
    const RateGrid b(span.begin_ns, span.end_ns, about(twists_of(wheels), Vector3d::UnitZ()));
    for (int i = 0; i < 3; ++i) {
      const Vector3d one = Vector3d::Unit(i);
      if (std::abs(up.dot(one)) > kAlong) continue;
      const auto lag = find_lag(RateGrid(span.begin_ns, span.end_ns, about(gyro, one)), b);
      // Exchanged columns keep time and scale; a chassis that pitches when it drives off does not.
      if (!lag || std::abs(lag->lag_s) > kMostLag_s || std::abs(lag->slope) > kMostScale ||
          std::abs(lag->slope) < 1. / kMostScale || std::abs(lag->correlation) <= most) {
        continue;
      }
      most = std::abs(lag->correlation);
      axis = std::copysign(1., lag->correlation) * one;
      label = recording.label<EncoderSample>(wheels.sensor);
    }
  }
  if (most < std::max(kAlike, vertically + kClearly)) return;
  out.push_back({recording.label<ImuSample>(recording.imu_sensor),
                 Severity::kFault,
                 "columns",
                 "its " + axis_of(axis) + " axis turns as " + label + " does (correlation " +
                     significant(most, 3) + "), but gravity is along its " + axis_of(up) +
                     " axis: columns of its gyro or its accelerometer are exchanged",
                 {{"correlation", most, ""}, {"correlation about the vertical", vertically, ""}}});
}

/// An epoch waits until the samples reach its end, and they come in cells.
constexpr double kEpoch_s = 0.1, kMargin_s = 0.2;

/// Of a wheel set against a gyro. Returns their correlation, regardless of sign, with an IMU.
double check_wheel_clock(const Recording& recording, const Wheels& wheels, const YawRates& rates,
                         Findings& out) {
  const Span span = span_of(recording);
  const std::string label = recording.label<EncoderSample>(wheels.sensor);
  std::vector<Turn> of_wheels = twists_of(wheels);
  const RateGrid a(span.begin_ns, span.end_ns, rates.turns);
  std::optional<Lag> lag =
      find_lag(a, RateGrid(span.begin_ns, span.end_ns, about(of_wheels, Vector3d::UnitZ())));
  const double correlation = lag ? std::abs(lag->correlation) : 0.;
  // What does not keep time has no constant part of a velocity.
  if (lag && lag->correlation > 0. && !drifts(*lag)) {
    const RateGrid twists(span.begin_ns, span.end_ns, of_wheels);
    const Vector3d row = yaw_of_twist(a, twists, lag->lag_s);
    const RateGrid b(span.begin_ns, span.end_ns, about(of_wheels, row));
    if (const auto better = find_lag(a, b)) lag = better;
  }
  // Nothing else is known of a heading.
  const bool is_heading =
      recording.imu.empty() || rates.label != recording.label<ImuSample>(recording.imu_sensor);
  const bool is_compared = lag && std::abs(lag->correlation) > 0.8;
  if (is_heading) {
    out.push_back({rates.label, is_compared ? Severity::kFits : Severity::kNote, "turns",
                   is_compared ? "compared with " + label
                               : "not looked at but for its stamps: its turns and those of " +
                                     label + " are too few, or too different"});
  }
  if (!lag) {
    out.push_back({label, Severity::kNote, "clock",
                   "too little rotation, or too little in common with " + rates.label +
                       ", to compare its clock and sign with the gyro"});
    return 0.;
  }
  std::string key = wheels.prior.name.empty()
                        ? "wheels.t_OtoI_s"
                        : "wheel_sets." + wheels.prior.name + ".wheels.t_OtoI_s";
  if (!recording.setup->filter) key.clear();
  Finding clock = clock_finding(
      label, {"clock", "clock", key, rates.label, wheels.prior.wheels.t_OtoI_s}, *lag,
      wheels.prior.sigma_time_offset_s, std::max(period_of(rates.turns), period_of(of_wheels)));
  clock.figures.push_back({"wheels by gyro", lag->slope, ""});
  // Put right, they come later than the filter waits for them.
  const double late_s = lag->lag_s - wheels.prior.wheels.t_OtoI_s;
  if (!clock.remedies.empty() && recording.setup->filter &&
      late_s > recording.setup->filter->options.schedule.max_wait_s - kEpoch_s) {
    clock.remedies.push_back({"estimator.max_wait_s", significant(late_s + kMargin_s, 2)});
  }
  if (lag->correlation < -0.8) {
    clock.severity = Severity::kFault;
    clock.remedies.clear();
    clock.what = "turns opposite to " + rates.label + " (correlation " +
                 significant(lag->correlation, 3) +
                 "): the gyro is upside down or reversed, all drives are reversed, or left and "
                 "right are exchanged";
  }
  out.push_back(clock);
  return is_heading ? 0. : correlation;
}

void check_wheel_clocks(const Recording& recording, Findings& out) {
  double vertically = 0.;
  for (const Wheels& wheels : recording.wheels) {
    if (wheels.samples.empty()) continue;
    for (const YawRates& rates : yaw_rates_of(recording, wheels.prior)) {
      vertically = std::max(vertically, check_wheel_clock(recording, wheels, rates, out));
    }
  }
  check_gyro_columns(recording, vertically, out);
}

std::string label_of(const Recording& recording, const CameraTurns& camera) {
  return recording.label<FeatureSample>(camera.sensor) + ", camera " +
         std::to_string(camera.camera);
}

std::vector<Turn> turns_in_imu(const Recording& recording, const CameraTurns& camera) {
  const CameraView& view =
      recording.setup->filter->cameras[static_cast<std::size_t>(camera.camera)].camera;
  return shifted(rotated(camera.turns, view.R_ItoC.transpose()), view.image_offset_s());
}

void check_camera_clocks(const Recording& recording, Findings& out) {
  if (recording.imu.empty() || !recording.setup->filter) return;
  const std::string imu = recording.label<ImuSample>(recording.imu_sensor);
  const std::vector<Turn> gyro = turns_of(recording.imu);
  const Span span = span_of(recording);
  const bool is_upside_down = std::ranges::any_of(
      recording.implausible, [](const viwo::Finding& one) { return one.key.ends_with(" up"); });
  for (const CameraTurns& camera : recording.cameras) {
    const CameraPrior& prior =
        recording.setup->filter->cameras[static_cast<std::size_t>(camera.camera)];
    const std::string label = label_of(recording, camera);
    if (camera.turns.empty()) {
      out.push_back({label, Severity::kNote, "tracks", "no two images share eight points"});
      continue;
    }
    check_tracks(recording, camera, label, out);
    const auto turns = turns_in_imu(recording, camera);
    const RateGrid a(span.begin_ns, span.end_ns, gyro), b(span.begin_ns, span.end_ns, turns);
    const auto R = rotation_between(a, b);
    const double angle = R ? log_so3(*R).norm() * 180. / std::numbers::pi : NAN;
    if (R && is_mounted_otherwise(*R, angle, gyro, turns, span, label, imu, out)) continue;
    const std::optional<Lag> lag = find_lag(a, b, 0.5);
    if (!lag) {
      out.push_back({label, Severity::kNote, "clock",
                     "too little rotation to compare its clock with " + imu});
      continue;
    }
    constexpr double kOpposite = -0.5;
    if (lag->correlation < kOpposite) {
      if (is_upside_down) continue;  // that tells it
      out.push_back({label,
                     Severity::kFault,
                     "axes",
                     "turns opposite to " + imu + " (correlation " +
                         significant(lag->correlation, 3) +
                         "): signs of the gyro, or T_cam_imu in the file of section cameras",
                     {{"correlation", lag->correlation, ""}}});
      continue;
    }
    Finding clock =
        clock_finding(label, {"clock", "clock", "timeshift_cam_imu", imu, prior.camera.t_CtoI_s},
                      *lag, prior.sigma_clock_s, std::max(period_of(gyro), period_of(turns)));
    clock.figures.push_back({"points in two images", eval::median(camera.points), ""});
    clock.figures.push_back({"angle to calibration", angle, "deg"});
    if (clock.severity == Severity::kFault) {
      clock.what += " in the file of section cameras";
    }
    out.push_back(clock);
  }
}

}  // namespace viwo::inspect

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "viwo/checks/checks.hpp"
#include "viwo/eval/statistics.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/time_text.hpp"
#include "viwo/plausibility/imu_axes.hpp"
#include "viwo/series/rate_grid.hpp"
#include "viwo/series/rests.hpp"

namespace viwo::inspect {

using series::Recording;
using series::Rest;

namespace {

using Eigen::Vector3d;

/// Gravity at sea level, from the equator to a pole, less what a mountain takes.
constexpr double kLeastGravity = 9.76, kMostGravity = 9.84;

/// Of a start without a filter's configuration, as that has them by default.
constexpr double kAccelBias_m_per_s2 = 0.05, kGyroBias_rad_per_s = 0.02;

double gravity_of(const Recording& recording) {
  const auto& filter = recording.setup->filter;
  return (filter ? filter->options : EstimatorOptions{}).filter.gravity_m_per_s2;
}

double degrees(double angle) { return angle * 180. / std::numbers::pi; }

/// Up in the next number that a reader would write.
std::string rounded_up(double value) {
  const double step = std::pow(10., std::floor(std::log10(value)) - 1.);
  return significant(std::ceil(value / step) * step, 3);
}

struct Means {
  Vector3d gyro = Vector3d::Zero(), accel = Vector3d::Zero();
};

Means means_of(const std::vector<ImuSample>& imu, std::size_t first, std::size_t last) {
  Means means;
  const auto n = static_cast<double>(last - first);
  for (std::size_t i = first; i < last; ++i) {
    means.gyro += to_vector(imu[i].gyro_rad_per_s) / n;
    means.accel += to_vector(imu[i].accel_m_per_s2) / n;
  }
  return means;
}

double tilt_of(const Vector3d& up) {
  return degrees(std::acos(std::clamp(up.cwiseAbs().maxCoeff(), 0., 1.)));
}

/// At rest the specific force is gravity and the rate is the gyro's bias: within what the start
/// from a rest allows (F-9), four and three sigma of the configured biases.
void check_rest(const Recording& recording, const Rest& rest, const std::string& label,
                Findings& out) {
  const auto& imu = recording.imu;
  const auto& filter = recording.setup->filter;
  const Means means = means_of(imu, rest.first, rest.last);
  const double length_s = seconds_between(imu[rest.first].t_ns, imu[rest.last - 1].t_ns);
  const double is = means.accel.norm(), expected = gravity_of(recording);
  const std::string at = " (mean of " + significant(length_s, 3) + " s at rest from " +
                         time_text(imu[rest.first].t_ns - recording.begin_ns()) + ")";
  Finding gravity{label,
                  Severity::kFits,
                  "gravity",
                  "gravity " + significant(is, 4) + " m/s^2 along " + axis_of(means.accel) + ", " +
                      significant(tilt_of(means.accel / is), 2) + " deg off" + at,
                  {{"gravity", is, "m/s^2"},
                   {"configured", expected, "m/s^2"},
                   {"up, x", means.accel.x() / is, ""},
                   {"up, y", means.accel.y() / is, ""},
                   {"up, z", means.accel.z() / is, ""},
                   {"rest", length_s, "s"}}};
  // Without a filter its defaults, beyond which nothing is wrong with a run of the wheels alone.
  const Severity beyond = filter ? Severity::kFault : Severity::kNote;
  const double sigma = filter ? filter->start.sigma_accel_bias_m_per_s2 : kAccelBias_m_per_s2;
  const double off = std::abs(is - expected);
  // More than a tenth is another unit or scale: `plausibility` names it.
  if (off > 4. * sigma && off < 0.1 * expected) {
    gravity.severity = beyond;
    gravity.what += ": estimator.gravity_m_per_s2 says " + significant(expected, 4) +
                    ", and the accelerometer's bias is thought to be within " +
                    significant(sigma, 2);
    if (is > kLeastGravity && is < kMostGravity) {
      if (filter) gravity.remedies = {{"estimator.gravity_m_per_s2", significant(is, 4)}};
    } else {
      gravity.what += "; no place on Earth has that gravity: it has a bias or a wrong scale";
      if (filter)
        gravity.remedies = {{"estimator.sigma_start_accel_bias_m_per_s2", rounded_up(0.5 * off)}};
    }
  }
  out.push_back(gravity);
  const double bias = means.gyro.cwiseAbs().maxCoeff();
  const double sigma_gyro = filter ? filter->start.sigma_gyro_bias_rad_per_s : kGyroBias_rad_per_s;
  Finding gyro{label,
               Severity::kFits,
               "gyro bias",
               "gyro bias up to " + significant(bias, 2) + " rad/s" + at,
               {{"gyro bias, x", means.gyro.x(), "rad/s"},
                {"gyro bias, y", means.gyro.y(), "rad/s"},
                {"gyro bias, z", means.gyro.z(), "rad/s"},
                {"sigma, configured", sigma_gyro, "rad/s"}}};
  if (bias > 3. * sigma_gyro) {
    gyro.severity = beyond;
    gyro.what += ": beyond three sigma of what the configuration expects (" +
                 significant(sigma_gyro, 2) + " rad/s)";
    if (filter)
      gyro.remedies = {{"estimator.sigma_start_gyro_bias_rad_per_s", rounded_up(0.5 * bias)}};
  }
  out.push_back(gyro);
}

/// Of readings that are all the same: so they are in a simulation without noise that stands still,
/// drives straight on or along a circle, but not where wheels turn the base now more and now less.
void check_all_constant(const Recording& recording, const std::string& label, Findings& out) {
  constexpr double kTurns_rad_per_s = 0.1;
  for (const series::Wheels& wheels : recording.wheels) {
    std::vector<double> rates;
    for (const series::Turn& turn : turns_of(wheels)) rates.push_back(turn.rate.z());
    if (rates.empty()) continue;
    const double range = eval::quantile(rates, 0.9) - eval::quantile(rates, 0.1);
    if (range < kTurns_rad_per_s) continue;
    out.push_back({label,
                   Severity::kFault,
                   "channel",
                   "all six numbers are the same in every reading, while " +
                       recording.label<EncoderSample>(wheels.sensor) +
                       " turns now more and now less, by " + significant(range, 2) +
                       " rad/s: it is not read",
                   {{"range", range, "rad/s"}}});
    return;
  }
}

/// A number that never changes, and two that are the same all the time.
void check_channels(const Recording& recording, const std::string& label, Findings& out) {
  const auto& imu = recording.imu;
  constexpr std::size_t kFewest = 100;
  if (imu.size() < kFewest) return;
  std::array<bool, 6> constant{};
  std::array<std::array<bool, 6>, 6> same{};
  constant.fill(true);
  for (auto& row : same) row.fill(true);
  for (const ImuSample& sample : imu) {
    const auto of = [](const ImuSample& s, std::size_t i) {
      return i < 3 ? s.gyro_rad_per_s[i] : s.accel_m_per_s2[i - 3];
    };
    for (std::size_t i = 0; i < 6; ++i) {
      constant[i] = constant[i] && of(sample, i) == of(imu.front(), i);
      for (std::size_t j = 0; j < i; ++j) same[i][j] = same[i][j] && of(sample, i) == of(sample, j);
    }
  }
  if (std::all_of(constant.begin(), constant.end(), [](bool c) { return c; })) {
    return check_all_constant(recording, label, out);
  }
  for (std::size_t i = 0; i < 6; ++i) {
    const double value = i < 3 ? imu.front().gyro_rad_per_s[i] : imu.front().accel_m_per_s2[i - 3];
    if (constant[i]) {
      out.push_back({label, Severity::kFault, "channel",
                     std::string("the ") + kImuAxes[i] + " reads " + significant(value, 4) +
                         " all the time: not connected, or not read"});
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (!same[i][j] || constant[i]) continue;
      out.push_back({label, Severity::kFault, "channel",
                     std::string("the ") + kImuAxes[i] + " and the " + kImuAxes[j] +
                         " are the same number in every reading: one of them is read twice"});
    }
  }
}

}  // namespace

void check_imu(const Recording& recording, Findings& out) {
  if (recording.imu.empty()) return;
  const std::string label = recording.label<ImuSample>(recording.imu_sensor);
  check_channels(recording, label, out);
  const std::vector<Rest> rests = rests_of(recording);
  if (!rests.empty()) return check_rest(recording, rests.front(), label, out);
  const Means means = means_of(recording.imu, 0, recording.imu.size());
  const Vector3d up = up_of(recording.imu);
  Finding gravity{
      label,
      Severity::kFits,
      "gravity",
      "no rest of a second; mean specific force " + significant(means.accel.norm(), 4) + " m/s^2",
      {{"mean specific force", means.accel.norm(), "m/s^2"}, {"rest", 0., "s"}}};
  if (up.norm() > 0.) gravity.what += " along " + axis_of(up);
  out.push_back(gravity);
}

}  // namespace viwo::inspect

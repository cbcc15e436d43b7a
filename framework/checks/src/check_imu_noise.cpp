#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "viwo/checks/checks.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/series/allan.hpp"
#include "viwo/series/rests.hpp"

namespace viwo::inspect {

using series::allan_deviation;
using series::AllanPoint;
using series::Recording;
using series::Rest;

namespace {

/// What the start of the filter takes for a vibration, too: three times the noise.
constexpr double kMostRatio = 3.;
/// Rests that are long enough to tell white noise: a hundred means at the time scale of an epoch.
constexpr double kWhiteRest_s = 5.;

/// Gyro or accelerometer: its noises as configured.
struct Part {
  const char* name;
  const char* unit;       ///< of the density of white noise
  const char* walk_unit;  ///< of that of the random walk
  const char* key;
  const char* walk_key;
  double density, walk;
  std::size_t first;  ///< of its three axes
};

double reading(const ImuSample& sample, std::size_t axis) {
  return axis < 3 ? sample.gyro_rad_per_s[axis] : sample.accel_m_per_s2[axis - 3];
}

/// The largest of the three axes.
struct Density {
  double per_sample = 0.;  ///< by the differences from one reading to the next
  double over_epoch = 0.;  ///< of means over a tenth of a second
  double walk = 0.;        ///< at the longest time that has ten means
};

Density density_of(const std::vector<ImuSample>& imu, const Rest& rest, std::size_t first_axis) {
  const double span_s = seconds_between(imu[rest.first].t_ns, imu[rest.last - 1].t_ns);
  const double step_s = span_s / static_cast<double>(rest.last - rest.first - 1);
  Density density;
  for (std::size_t axis = first_axis; axis < first_axis + 3; ++axis) {
    std::vector<double> values;
    for (std::size_t i = rest.first; i < rest.last; ++i) values.push_back(reading(imu[i], axis));
    AllanPoint longest{step_s, 0., 0.};
    for (const AllanPoint& point : allan_deviation(values, step_s)) {
      const double white = point.deviation * std::sqrt(point.tau_s);
      if (point.tau_s < 1.5 * step_s) density.per_sample = std::max(density.per_sample, white);
      const bool is_epoch = point.tau_s >= 0.07 && point.tau_s < 0.15;
      if (is_epoch || (point.tau_s < 1.5 * step_s && step_s >= 0.07)) {
        density.over_epoch = std::max(density.over_epoch, white);
      }
      constexpr double kFewestTerms = 10.;
      if (point.terms >= kFewestTerms) longest = point;
    }
    // Less what white noise has of it.
    const double of_white = density.per_sample * density.per_sample / longest.tau_s;
    const double square = std::max(longest.deviation * longest.deviation - of_white, 0.);
    density.walk = std::max(density.walk, std::sqrt(square * 3. / longest.tau_s));
  }
  return density;
}

void check_part(const Part& part, const Density& density, double rest_s, const std::string& label,
                Findings& out) {
  const double found = std::max(density.per_sample, density.over_epoch);
  const double ratio = found / part.density;
  Finding white{label,
                Severity::kFits,
                std::string(part.name) + " noise",
                std::string(part.name) + " noise " + significant(found, 2) + " " + part.unit +
                    ", " + significant(ratio, 2) + " times what is configured",
                {{"from reading to reading", density.per_sample, part.unit},
                 {"over 0.1 s", density.over_epoch, part.unit},
                 {"configured", part.density, part.unit},
                 {"found by configured", ratio, ""},
                 {"rest", rest_s, "s"}}};
  if (ratio > kMostRatio) {
    // Of a rest that is too short it is a guess.
    white.severity = rest_s < kWhiteRest_s ? Severity::kNote : Severity::kFault;
    if (density.per_sample > kMostRatio * density.over_epoch ||
        density.over_epoch > kMostRatio * density.per_sample) {
      white.what += ", more " +
                    std::string(density.per_sample > density.over_epoch ? "from reading to reading"
                                                                        : "over 0.1 s") +
                    ": the robot is shaken at rest";
    }
    white.what += "; a filter that is told too little believes the IMU too long";
    white.remedies = {{part.key, significant(found, 2)}};
  }
  out.push_back(white);
  // From there on the walk is more than the noise: K^2 tau / 3 = N^2 / tau.
  const double turn_s =
      part.walk > 0. ? std::sqrt(3.) * std::max(found, part.density) / part.walk : INFINITY;
  const double needed_s = 10. * turn_s;
  Finding walk{label,
               Severity::kFits,
               std::string(part.name) + " walk",
               "",
               {{"configured", part.walk, part.walk_unit},
                {"rest", rest_s, "s"},
                {"rest that is needed", needed_s, "s"}}};
  if (rest_s < needed_s) {
    walk.severity = Severity::kNote;
    walk.what = "random walk of the " + std::string(part.name) +
                "'s bias not looked at: " + significant(needed_s, 2) + " s at rest are needed, " +
                significant(rest_s, 2) + " s are there";
  } else {
    const double walk_ratio = density.walk / part.walk;
    walk.figures.push_back({"found", density.walk, part.walk_unit});
    walk.figures.push_back({"found by configured", walk_ratio, ""});
    walk.what = std::string(part.name) + " walk " + significant(density.walk, 2) + " " +
                part.walk_unit + ", " + significant(walk_ratio, 2) + " times what is configured";
    if (walk_ratio > kMostRatio) {
      walk.severity = Severity::kFault;
      walk.remedies = {{part.walk_key, significant(density.walk, 2)}};
    }
  }
  out.push_back(walk);
}

}  // namespace

void check_imu_noise(const Recording& recording, Findings& out) {
  if (recording.imu.empty()) return;
  const std::string label = recording.label<ImuSample>(recording.imu_sensor);
  if (!recording.setup->filter) {
    out.push_back(
        {label, Severity::kNote, "noise",
         "noises not looked at: there is no filter, whose section imu has some to compare "
         "them with"});
    return;
  }
  const std::vector<Rest> rests = rests_of(recording);
  const double rest_s = rests.empty() ? 0.
                                      : seconds_between(recording.imu[rests.front().first].t_ns,
                                                        recording.imu[rests.front().last - 1].t_ns);
  if (rest_s < 0.2 * kWhiteRest_s) return;
  if (rest_s < kWhiteRest_s) {
    out.push_back({label,
                   Severity::kNote,
                   "noise",
                   "noises only roughly: " + significant(kWhiteRest_s, 2) +
                       " s at rest are needed, " + significant(rest_s, 2) + " s are there",
                   {{"rest", rest_s, "s"}, {"rest that is needed", kWhiteRest_s, "s"}}});
  }
  const ImuNoise& noise = recording.setup->filter->options.filter.imu_noise;
  const std::array<Part, 2> parts = {
      Part{"gyro", "rad/s/sqrt(Hz)", "rad/s^2/sqrt(Hz)", "imu.sigma_gyro_rad_per_s_sqrt_hz",
           "imu.sigma_gyro_walk_rad_per_s2_sqrt_hz", noise.gyro_rad_per_s_sqrt_hz,
           noise.gyro_walk_rad_per_s2_sqrt_hz, 0},
      Part{"accelerometer", "m/s^2/sqrt(Hz)", "m/s^3/sqrt(Hz)", "imu.sigma_accel_m_per_s2_sqrt_hz",
           "imu.sigma_accel_walk_m_per_s3_sqrt_hz", noise.accel_m_per_s2_sqrt_hz,
           noise.accel_walk_m_per_s3_sqrt_hz, 3}};
  for (const Part& part : parts) {
    if (!(part.density > 0.)) continue;
    check_part(part, density_of(recording.imu, rests.front(), part.first), rest_s, label, out);
  }
}

}  // namespace viwo::inspect

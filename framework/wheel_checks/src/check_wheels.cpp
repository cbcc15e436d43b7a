#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "viwo/math/significant.hpp"
#include "viwo/plausibility/parity_watch.hpp"
#include "viwo/series/wheel_calibration.hpp"
#include "viwo/wheel/contradicted_channels.hpp"
#include "viwo/wheel/drive_ranges.hpp"
#include "viwo/wheel/twist_solver.hpp"
#include "viwo/wheel/wheel_noise.hpp"
#include "viwo/wheel_checks/wheel_checks.hpp"

namespace viwo::inspect {

using series::Calibration;
using series::Explained;
using series::Recording;
using series::Wheels;

namespace {

/// One intrinsic that is far from its prior, and explains what the wheels contradict each other by.
void check_intrinsics(const Wheels& wheels, const Calibration& calibration,
                      const std::string& label, Findings& out) {
  constexpr double kFar = 5., kMostOfIt = 0.7;
  const Explained& one = calibration.alone;
  const IntrinsicSpec& spec = wheels.model->description().intrinsics[one.intrinsic];
  const auto i = static_cast<Eigen::Index>(one.intrinsic);
  const double nominal = wheels.prior.wheels.x_WI[i];
  const double sigma = wheels.prior.sigma_intrinsics[i];
  if (one.part < kMostOfIt || !(sigma > 0.) || std::abs(one.value - nominal) < kFar * sigma) return;
  out.push_back({label,
                 Severity::kFault,
                 "intrinsics",
                 spec.name + " explains " + significant(100. * one.part, 2) +
                     " % of what the wheels contradict each other by if it is " +
                     significant(one.value, 4) + " " + spec.unit + " instead of " +
                     significant(nominal, 4) +
                     ": it, or unit, gear, sign or zero of a channel of that wheel",
                 {{spec.name, one.value, spec.unit}, {"part", one.part, ""}}});
}

/// Channels that the others contradict. Gives the wheels without the samples in which one is.
Wheels check_liars(const Recording& recording, const Wheels& wheels, const Calibration& calibration,
                   const std::string& label, Findings& out) {
  Wheels left = wheels;
  const std::vector<ContradictedChannel> channels = contradicted_channels(
      wheels.samples, wheels.model, calibration.x_WI, calibration.P, &left.samples);
  for (const ContradictedChannel& channel : channels) {
    out.push_back({label,
                   Severity::kFault,
                   "contradicted",
                   text_of(channel, recording.begin_ns()),
                   {{"share", channel.share, ""}, {"longest", channel.longest_s, "s"}}});
  }
  return left;
}

/// Samples of a tenth of a second each: means of those in it.
std::vector<EncoderSample> merged(const std::vector<EncoderSample>& samples) {
  constexpr double kLength_s = 0.1;
  std::vector<EncoderSample> out;
  for (std::size_t i = 0; i < samples.size();) {
    EncoderSample sum = samples[i];
    double n = 1.;
    for (++i; i < samples.size() && samples[i].begin_ns == sum.end_ns &&
              seconds_between(sum.begin_ns, samples[i].end_ns) <= 1.001 * kLength_s;
         ++i, n += 1.) {
      sum.end_ns = samples[i].end_ns;
      for (std::size_t k = 0; k < kMaxDrives; ++k) {
        sum.drive_rad_per_s[k] += samples[i].drive_rad_per_s[k];
      }
      for (std::size_t k = 0; k < kMaxSteers; ++k) sum.steer_rad[k] += samples[i].steer_rad[k];
    }
    for (double& rate : sum.drive_rad_per_s) rate /= n;
    for (double& angle : sum.steer_rad) angle /= n;
    sum.t_ns = sum.begin_ns + (sum.end_ns - sum.begin_ns) / 2;
    out.push_back(sum);
  }
  return out;
}

std::vector<NoiseFound> noises_of(const Wheels& wheels, const Calibration& calibration,
                                  const std::vector<EncoderSample>& samples) {
  WheelNoise noise(wheels.model);
  for (const EncoderSample& sample : samples) noise.add(sample, calibration.x_WI, calibration.P);
  std::vector<NoiseFound> found;
  noise.append_to(found);
  return found;
}

void check_parity(const Parity& parity, const Wheels& wheels, const std::string& label,
                  Findings& out) {
  Finding finding{label,
                  Severity::kFits,
                  "parity",
                  "rows disagree by " + significant(1e3 * parity.rms, 2) + " mm/s at " +
                      significant(parity.speed, 2) + " m/s of the wheels",
                  {{"parity residual", parity.rms, "m/s"}, {"speed", parity.speed, "m/s"}}};
  if (parity.rms < kExactly * parity.speed &&
      !has_copies(wheels.samples, wheels.model->description().n_drive)) {
    finding.severity = Severity::kFault;
    finding.what = std::string("the wheels agree ") + kSetpoints;
  } else if (parity.is_gross()) {
    finding.severity = Severity::kFault;
    if (!std::isfinite(parity.rms) || parity.refused > 0.5) {
      finding.what = "the kinematic model makes no motion of " +
                     significant(100. * std::max(parity.refused, 0.), 3) + " % of the samples";
    }
    finding.what +=
        ": the wheels contradict each other grossly - their order, or that of the wheels in "
        "kinematics, signs, units of drives or steering, zeros of the steering, or one of these in "
        "a part of the recording";
  }
  out.push_back(finding);
}

/// Of steering angles beyond 0.1 rad, or a third of what moves; or ten times what is configured
/// where the wheels contradict each other grossly.
bool is_no_noise(const NoiseFound& part, const Parity& parity) {
  if (part.unit == "rad" && part.found > 0.1) return true;
  if (part.unit == "rad/s" && part.found > parity.drive_rad_per_s / 3.) return true;
  if (part.unit == "m/s" && part.found > parity.speed / 3.) return true;
  return part.found > 10. * part.configured && parity.is_gross();
}

/// From sample to sample, and over a tenth of a second, which is what an epoch has: the steps of an
/// angle that is counted cancel out in it, slip does not. The smaller one counts.
void check_noises(const Wheels& wheels, const Calibration& calibration, const Parity& parity,
                  const std::string& label, Findings& out) {
  constexpr double kMostFactor = 3.;  // as a run warns of it
  std::vector<NoiseFound> found = noises_of(wheels, calibration, wheels.samples);
  const std::vector<EncoderSample> longer = merged(wheels.samples);
  const double times = std::sqrt(static_cast<double>(wheels.samples.size()) /
                                 static_cast<double>(std::max<std::size_t>(1, longer.size())));
  const std::vector<NoiseFound> over_epoch = noises_of(wheels, calibration, longer);
  const std::string section = wheels.prior.name.empty()
                                  ? "kinematics."
                                  : "wheel_sets." + wheels.prior.name + ".kinematics.";
  std::vector<double> per_samples;
  bool is_noise = true;
  for (NoiseFound& part : found) {
    per_samples.push_back(part.found);
    for (const NoiseFound& other : over_epoch) {
      if (other.name == part.name) part.found = std::min(part.found, other.found * times);
    }
    const bool is_large = part.found > kMostFactor * part.configured;
    is_noise = is_noise && !(is_large && is_no_noise(part, parity));
  }
  for (std::size_t i = 0; i < found.size(); ++i) {
    const NoiseFound& part = found[i];
    const double ratio = part.found / part.configured;
    Finding finding{label,
                    Severity::kFits,
                    part.name,
                    part.name + " " + significant(part.found, 2) + " " + part.unit + ", " +
                        significant(ratio, 2) + " times what is configured",
                    {{"found", part.found, part.unit},
                     {"from sample to sample", per_samples[i], part.unit},
                     {"configured", part.configured, part.unit},
                     {"found by configured", ratio, ""},
                     {"samples", static_cast<double>(part.count), ""}}};
    if (ratio > kMostFactor) {
      finding.severity = Severity::kFault;
      finding.what += ": the wheels contradict each other by more than it explains";
      if (!is_noise) {
        finding.what +=
            ", and no noise is like that: something else is wrong (signs, order, units, zeros)";
      } else if (part.name.find(' ') == std::string::npos) {
        finding.remedies = {{section + part.name, significant(part.found, 2)}};
      } else {
        finding.severity = Severity::kNote;  // one that is worse than the others of its kind
      }
    }
    out.push_back(finding);
  }
}

}  // namespace

void check_wheels(const Recording& recording, Findings& out) {
  for (const Wheels& wheels : recording.wheels) {
    const std::string label = recording.label<EncoderSample>(wheels.sensor);
    if (!wheels.unusable.empty()) {
      out.push_back({label, Severity::kFault, "channels", wheels.unusable});
      continue;
    }
    if (wheels.samples.empty() || wheels.model->n_rows() <= 3) continue;
    const std::optional<Calibration> calibration = calibrated(wheels);
    if (!calibration) {
      check_parity(parity_of(wheels, wheels.prior.wheels.x_WI), wheels, label, out);
      continue;
    }
    const Parity parity = parity_of(wheels, calibration->x_WI);
    check_parity(parity, wheels, label, out);
    check_intrinsics(wheels, *calibration, label, out);
    const std::size_t before = out.size();
    const Wheels left = check_liars(recording, wheels, *calibration, label, out);
    // Of wheels that contradict each other all the time one or the other is in the way of its
    // fellows now and then.
    if (parity.is_gross() && parity_of(left, calibration->x_WI).is_gross()) {
      for (std::size_t i = before; i < out.size(); ++i) out[i].severity = Severity::kNote;
    }
    check_noises(wheels, *calibration, parity, label, out);
  }
}

}  // namespace viwo::inspect

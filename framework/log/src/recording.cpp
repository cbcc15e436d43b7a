#include "viwo/log/recording.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "quaternion.hpp"
#include "viwo/api/status.hpp"

namespace viwo::log {
namespace {

bool is_finite(double value) { return std::isfinite(value); }

EncoderSample rate_sample(const EncoderReading& reading) {
  EncoderSample sample;
  sample.t_ns = reading.t_ns;
  sample.n_drive = reading.n_drive;
  sample.n_steer = reading.n_steer;
  sample.drive_rad_per_s = reading.drive;
  sample.steer_rad = reading.steer_rad;
  return sample;
}

}  // namespace

EncoderCollector::EncoderCollector(const EncoderRecordingOptions& options)
    : options_(options), filter_(options.limits) {}

void EncoderCollector::add(const EncoderReading& reading, const TextReader& at) {
  // Channels that are not used are zero, hence finite.
  if (!std::all_of(reading.drive.begin(), reading.drive.end(), is_finite) ||
      !std::all_of(reading.steer_rad.begin(), reading.steer_rad.end(), is_finite)) {
    filter_.reject(kNotFinite, at);
  } else if (filter_.accept(reading.t_ns, at)) {
    readings_.push_back(reading);
  }
}

EncoderRecording EncoderCollector::finish(const TextReader& at) const {
  filter_.finish(at);
  EncoderRecording out;
  out.rejections = filter_.counts();
  const double max_gap_s = options_.limits.max_gap_s;
  if (options_.drive_is_angle) {
    out.samples = cells_from_angles(readings_, max_gap_s, options_.stride);
    if (out.samples.empty()) {
      throw InputError(at.file().string() + "  has too few readings without a gap for a rate");
    }
  } else {
    std::transform(readings_.begin(), readings_.end(), std::back_inserter(out.samples),
                   rate_sample);
    make_cells(out.samples, max_gap_s);
  }
  return out;
}

PoseCollector::PoseCollector(const LogLimits& limits) : filter_(limits) {}

void PoseCollector::add(PoseSample pose, const TextReader& at) {
  if (!std::all_of(pose.p_BinW_m.begin(), pose.p_BinW_m.end(), is_finite) ||
      !std::all_of(pose.q_BtoW_xyzw.begin(), pose.q_BtoW_xyzw.end(), is_finite)) {
    filter_.reject(kNotFinite, at);
    return;
  }
  Eigen::Quaterniond q(Eigen::Map<const Eigen::Vector4d>(pose.q_BtoW_xyzw.data()));
  if (!make_unit(q)) {
    filter_.reject(kNotUnit, at);
    return;
  }
  pose.q_BtoW_xyzw = {q.x(), q.y(), q.z(), q.w()};
  if (filter_.accept(pose.t_ns, at)) poses_.push_back(pose);
}

PoseRecording PoseCollector::finish(const TextReader& at) const {
  filter_.finish(at);
  return {poses_, filter_.counts()};
}

}  // namespace viwo::log

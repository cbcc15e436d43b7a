#include "viwo/log/recording.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "quaternion.hpp"
#include "viwo/api/status.hpp"
#include "viwo/math/number_text.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo::log {
namespace {

bool is_too_far(const std::array<double, 3>& p_m) {
  return std::any_of(p_m.begin(), p_m.end(), [](double x) { return std::abs(x) > kFarthest_m; });
}

/// nullptr when the quaternion can be used; it is of unit norm then.
const char* why_not_unit(std::array<double, 4>& xyzw) {
  Eigen::Quaterniond q(Eigen::Map<const Eigen::Vector4d>(xyzw.data()));
  if (!make_unit(q)) return kNotUnit;
  xyzw = {q.x(), q.y(), q.z(), q.w()};
  return nullptr;
}

const char* why_rejected(StateSample& state) {
  if (!all_finite(state.q_ItoG_xyzw) || !all_finite(state.p_IinG_m) ||
      !all_finite(state.v_IinG_m_per_s) || !all_finite(state.gyro_bias_rad_per_s) ||
      !all_finite(state.accel_bias_m_per_s2)) {
    return kNotFinite;
  }
  if (is_too_far(state.p_IinG_m)) return kTooFar;
  return why_not_unit(state.q_ItoG_xyzw);
}

const char* why_rejected(const GnssSample& fix) { return fix.fault(); }
const char* why_rejected(const HeadingSample& heading) { return heading.fault(); }

}  // namespace

void sort_by_time(Recording<Measurement>& recording) {
  std::stable_sort(recording.samples.begin(), recording.samples.end(),
                   [](const Measurement& a, const Measurement& b) { return a.t_ns() < b.t_ns(); });
}

void PieceParams::bind(ParamBinder& b) {
  b(VIWO_PARAM(start_s), {.unit = "s",
                          .min = 0.,
                          .max = 1e9,
                          .help = "leaves out what was recorded earlier than this after the begin "
                                  "of what this section reads"});
  b(VIWO_PARAM(duration_s), {.unit = "s",
                             .min = 0.,
                             .max = 1e9,
                             .help = "how long a piece is read from there; 0: up to the end"});
}

void cut(const PieceParams& piece, Recording<Measurement>& recording) {
  if (recording.samples.empty() || (piece.start_s == 0. && piece.duration_s == 0.)) return;
  std::int64_t first_ns = std::numeric_limits<std::int64_t>::max();
  std::int64_t last_ns = std::numeric_limits<std::int64_t>::min();
  for (const Measurement& sample : recording.samples) {
    const SampleExtent extent = sample.view().extent();
    first_ns = std::min(first_ns, extent.begin_ns);
    last_ns = std::max(last_ns, extent.end_ns);
  }
  const std::int64_t from_ns = first_ns + to_ns(piece.start_s);
  const std::int64_t until_ns = piece.duration_s > 0. ? from_ns + to_ns(piece.duration_s) : last_ns;
  std::erase_if(recording.samples, [&](const Measurement& sample) {
    const SampleExtent extent = sample.view().extent();
    return extent.begin_ns < from_ns || extent.end_ns > until_ns;
  });
  if (!recording.samples.empty()) return;
  throw ParamError(from_ns > last_ns ? "start_s" : "duration_s",
                   "nothing is left: what is read is " +
                       number_text(seconds_between(first_ns, last_ns)) + " s long");
}

const char* why_rejected(PoseSample& pose) {
  if (!all_finite(pose.p_BinW_m) || !all_finite(pose.q_BtoW_xyzw)) return kNotFinite;
  if (is_too_far(pose.p_BinW_m)) return kTooFar;
  return why_not_unit(pose.q_BtoW_xyzw);
}

const char* why_rejected(const ImuSample& imu) {
  return all_finite(imu.gyro_rad_per_s) && all_finite(imu.accel_m_per_s2) ? nullptr : kNotFinite;
}

const char* why_rejected(const EncoderReading& reading) {
  return all_finite(reading.drive) && all_finite(reading.steer_rad) ? nullptr : kNotFinite;
}

EncoderCollector::EncoderCollector(const EncoderRecordingOptions& options, std::size_t n_drive,
                                   std::size_t n_steer)
    : options_(options),
      filter_(options.limits),
      joints_(options.joints, static_cast<int>(n_drive), static_cast<int>(n_steer),
              options.drive_is_angle, options.limits.max_gap_s) {}

void EncoderCollector::add(EncoderReading reading, const TextReader& at) {
  if (const char* const why = why_rejected(reading)) return filter_.reject(why, at);
  if (!filter_.accept(reading.t_ns, at)) return;
  if (const char* const why = joints_.convert(reading)) return filter_.reject_last(why, at);
  readings_.push_back(reading);
}

EncoderRecording EncoderCollector::finish(const TextReader& at) {
  filter_.finish(at);
  EncoderRecording out;
  out.rejections = filter_.counts();
  out.samples =
      samples_from(readings_, options_.drive_is_angle, options_.limits.max_gap_s, options_.stride);
  if (out.samples.empty()) {
    throw InputError(at.file().string() + "  has too few readings without a gap for a rate" +
                     spacing_text(readings_, options_.limits.max_gap_s));
  }
  return out;
}

template <class Sample>
void SampleCollector<Sample>::add(Sample sample, const TextReader& at) {
  if (const char* const reason = why_rejected(sample)) {
    filter_.reject(reason, at);
  } else if (filter_.accept(sample.t_ns, at)) {
    samples_.push_back(sample);
  }
}

template <class Sample>
Recording<Sample> SampleCollector<Sample>::finish(const TextReader& at) {
  filter_.finish(at);
  return {samples_, filter_.counts()};
}

template class SampleCollector<PoseSample>;
template class SampleCollector<ImuSample>;
template class SampleCollector<GnssSample>;
template class SampleCollector<HeadingSample>;
template class SampleCollector<StateSample>;

std::size_t FeatureCollector::find(std::int64_t t_ns, int camera) const {
  if (first_ == images_.size() || images_[first_].t_ns != t_ns) return images_.size();
  std::size_t i = first_;
  while (i < images_.size() && images_[i].camera != camera) ++i;
  return i;
}

std::size_t FeatureCollector::find_or_make(std::int64_t t_ns, int camera) {
  const std::size_t i = find(t_ns, camera);
  if (i < images_.size()) return i;
  if (first_ < images_.size() && images_[first_].t_ns != t_ns) {
    first_ = images_.size();
    ids_.clear();
  }
  images_.push_back({t_ns, camera, {}});
  ids_.emplace_back();
  return i;
}

void FeatureCollector::add(std::int64_t t_ns, int camera, const FeaturePoint& point,
                           const TextReader& at) {
  if (!std::isfinite(point.u_px) || !std::isfinite(point.v_px))
    return filter_.reject(kNotFinite, at);
  const std::size_t known = find(t_ns, camera);
  if (known < images_.size() && ids_[known - first_].contains(point.id)) {
    return filter_.reject(kIdTwice, at);
  }
  if (!filter_.accept_or_same(t_ns, at)) return;
  const std::size_t image = find_or_make(t_ns, camera);
  images_[image].points.push_back(point);
  ids_[image - first_].insert(point.id);
}

void FeatureCollector::add_image(std::int64_t t_ns, int camera, const TextReader& at) {
  if (filter_.accept_or_same(t_ns, at)) find_or_make(t_ns, camera);
}

FeatureRecording FeatureCollector::finish(const TextReader& at) {
  filter_.finish(at);
  return {images_, filter_.counts()};
}

}  // namespace viwo::log

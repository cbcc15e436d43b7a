// Complete recordings of one kind of measurement, and what every reader does with the rows of its
// file: check, count, make cells, gather the points of an image.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "viwo/api/measurement.hpp"
#include "viwo/api/params.hpp"
#include "viwo/api/sensor.hpp"
#include "viwo/log/cells.hpp"
#include "viwo/log/joints.hpp"
#include "viwo/log/stamp_filter.hpp"

namespace viwo::log {

struct EncoderRecordingOptions {
  LogLimits limits;
  bool drive_is_angle = false;  ///< angles [rad] instead of rates [rad/s]
  int stride = 1;               ///< with angles: use every n-th reading, see cells_from_angles()
  JointParams joints = {};      ///< from the log to rad and rad/s
};

/// Samples in time order, and what was dropped on the way.
template <class Sample>
struct Recording {
  std::vector<Sample> samples;
  std::vector<RejectionCount> rejections;
};
using EncoderRecording = Recording<EncoderSample>;
using PoseRecording = Recording<PoseSample>;
using ImuRecording = Recording<ImuSample>;
using GnssRecording = Recording<GnssSample>;
using HeadingRecording = Recording<HeadingSample>;
using FeatureRecording = Recording<FeatureSample>;
using StateRecording = Recording<StateSample>;
using CalibrationRecording = Recording<CalibrationSample>;

/// Takes over what was recorded of one kind, behind what is there; `name` stands before the
/// reasons, unless it is empty.
template <class Sample>
void append(Recording<Measurement>& out, Recording<Sample> more, const std::string& name) {
  for (Sample& sample : more.samples) out.samples.emplace_back(std::move(sample));
  for (RejectionCount& rejection : more.rejections) {
    if (!name.empty()) rejection.reason = name + ": " + rejection.reason;
    out.rejections.push_back(std::move(rejection));
  }
}
/// Into time order; samples of one time stay in the order in which their kinds were appended.
void sort_by_time(Recording<Measurement>& recording);

/// What of a log is played.
struct PieceParams {
  double start_s = 0.;
  double duration_s = 0.;

  void bind(ParamBinder& b);
};

/// Leaves out what is not of the piece, and the cells of encoders that lie across its ends. The
/// piece counts from where the first sample begins. ParamError when nothing is left.
void cut(const PieceParams& piece, Recording<Measurement>& recording);

/// Why a datum cannot be used (kNotFinite, kTooFar, kNotUnit); nullptr when it can. A quaternion
/// whose norm is off by less than 1e-3 is of unit norm then.
const char* why_rejected(PoseSample& pose);
const char* why_rejected(const ImuSample& imu);
/// Channels that are not used are zero, hence finite.
const char* why_rejected(const EncoderReading& reading);

/// Takes readings in the order of the file.
class EncoderCollector {
 public:
  /// Of a file with so many channels; ParamError for joints that it does not have.
  EncoderCollector(const EncoderRecordingOptions& options, std::size_t n_drive,
                   std::size_t n_steer);
  /// `at` is at the row of the reading.
  void add(EncoderReading reading, const TextReader& at);
  void reject(const std::string& reason, const TextReader& at) { filter_.reject(reason, at); }
  /// Counts a row that cannot be read.
  void reject_row(const BadRow& bad, const TextReader& at) { filter_.reject_row(bad, at); }
  /// InputError when too little is left (see StampFilter::finish).
  EncoderRecording finish(const TextReader& at);

 private:
  EncoderRecordingOptions options_;
  StampFilter filter_;
  JointMap joints_;
  std::vector<EncoderReading> readings_;
};

/// Takes samples that stand for themselves, in the order of the file: PoseSample, ImuSample,
/// HeadingSample, GnssSample and StateSample. Values must be finite; quaternions off the unit norm
/// by less than 1e-3 are normalised, others rejected.
template <class Sample>
class SampleCollector {
 public:
  explicit SampleCollector(const LogLimits& limits) : filter_(limits) {}
  /// `at` is at the row of the sample.
  void add(Sample sample, const TextReader& at);
  /// Counts a row that cannot be read.
  void reject_row(const BadRow& bad, const TextReader& at) { filter_.reject_row(bad, at); }
  /// InputError when too little is left (see StampFilter::finish).
  Recording<Sample> finish(const TextReader& at);

 private:
  StampFilter filter_;
  std::vector<Sample> samples_;
};
using PoseCollector = SampleCollector<PoseSample>;
using ImuCollector = SampleCollector<ImuSample>;
using GnssCollector = SampleCollector<GnssSample>;
using HeadingCollector = SampleCollector<HeadingSample>;
using StateCollector = SampleCollector<StateSample>;

extern template class SampleCollector<PoseSample>;
extern template class SampleCollector<ImuSample>;
extern template class SampleCollector<GnssSample>;
extern template class SampleCollector<HeadingSample>;
extern template class SampleCollector<StateSample>;

/// Gathers points to images: one for each camera at each time, in the order in which they come
/// first. Stamps must not go back; the cameras of one time may alternate. Points that are not
/// finite, and ids that an image already has, are rejected.
class FeatureCollector {
 public:
  explicit FeatureCollector(const LogLimits& limits) : filter_(limits) {}
  void add(std::int64_t t_ns, int camera, const FeaturePoint& point, const TextReader& at);
  /// An image, whether or not points of it follow.
  void add_image(std::int64_t t_ns, int camera, const TextReader& at);
  /// Counts a row that cannot be read.
  void reject_row(const BadRow& bad, const TextReader& at) { filter_.reject_row(bad, at); }
  FeatureRecording finish(const TextReader& at);

 private:
  /// Its index in images_; images_.size() when there is none.
  std::size_t find(std::int64_t t_ns, int camera) const;
  std::size_t find_or_make(std::int64_t t_ns, int camera);

  StampFilter filter_;
  std::vector<FeatureSample> images_;
  std::size_t first_ = 0;                              ///< image of the last stamp
  std::vector<std::unordered_set<std::int64_t>> ids_;  ///< of the images from first_ on
};

/// A sensor that plays a recording back: of one kind, or of measurements of several.
template <class T>
class RecordingSensor : public Sensor {
 public:
  SampleTypes yields() const final { return yields_; }
  Status next(Measurement& out) final {
    if (next_ == recording_.samples.size()) return Status::kEnd;
    out = recording_.samples[next_++];
    return Status::kOk;
  }
  void rejections(std::vector<RejectionCount>& out) const final {
    out.insert(out.end(), recording_.rejections.begin(), recording_.rejections.end());
  }

 protected:
  explicit RecordingSensor(Recording<T> recording)
      : RecordingSensor(std::move(recording), sample_types<T>()) {}
  /// `yields`: the kinds of the measurements, as they are configured.
  RecordingSensor(Recording<T> recording, SampleTypes yields)
      : recording_(std::move(recording)), yields_(std::move(yields)) {}

 private:
  Recording<T> recording_;
  SampleTypes yields_;
  std::size_t next_ = 0;
};

}  // namespace viwo::log

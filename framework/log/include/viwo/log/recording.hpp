// Complete recordings of encoders and poses, and what every reader does with the rows of its file:
// check, count, make cells.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "viwo/api/measurement.hpp"
#include "viwo/api/sensor.hpp"
#include "viwo/log/cells.hpp"
#include "viwo/log/stamp_filter.hpp"

namespace viwo::log {

struct EncoderRecordingOptions {
  LogLimits limits;
  bool drive_is_angle = false;  ///< multi-turn angles [rad] instead of rates [rad/s]
  int stride = 1;               ///< with angles: use every n-th reading, see cells_from_angles()
};

/// Samples in time order, and what was dropped on the way.
template <class Sample>
struct Recording {
  std::vector<Sample> samples;
  std::vector<RejectionCount> rejections;
};
using EncoderRecording = Recording<EncoderSample>;
using PoseRecording = Recording<PoseSample>;

/// Takes readings in the order of the file.
class EncoderCollector {
 public:
  explicit EncoderCollector(const EncoderRecordingOptions& options);
  /// `at` is at the row of the reading.
  void add(const EncoderReading& reading, const TextReader& at);
  void reject(const std::string& reason, const TextReader& at) { filter_.reject(reason, at); }
  /// InputError when too little is left (see StampFilter::finish).
  EncoderRecording finish(const TextReader& at) const;

 private:
  EncoderRecordingOptions options_;
  StampFilter filter_;
  std::vector<EncoderReading> readings_;
};

/// Takes poses in the order of the file; quaternions off the unit norm by less than 1e-3 are
/// normalised, others rejected.
class PoseCollector {
 public:
  explicit PoseCollector(const LogLimits& limits);
  void add(PoseSample pose, const TextReader& at);
  PoseRecording finish(const TextReader& at) const;

 private:
  StampFilter filter_;
  std::vector<PoseSample> poses_;
};

/// A sensor that plays a recording back.
template <class Sample>
class RecordingSensor : public Sensor {
 public:
  Status next(Measurement& out) final {
    if (next_ == recording_.samples.size()) return Status::kEnd;
    out = recording_.samples[next_++];
    return Status::kOk;
  }
  void rejections(std::vector<RejectionCount>& out) const final {
    out.insert(out.end(), recording_.rejections.begin(), recording_.rejections.end());
  }

 protected:
  explicit RecordingSensor(Recording<Sample> recording) : recording_(std::move(recording)) {}

 private:
  Recording<Sample> recording_;
  std::size_t next_ = 0;
};

}  // namespace viwo::log

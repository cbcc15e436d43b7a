#include "topic_readers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <utility>
#include <vector>

#include "bag_image.hpp"
#include "viwo/api/status.hpp"
#include "viwo/log/cells.hpp"
#include "viwo/log/text.hpp"

namespace viwo::bag {
namespace {

template <std::size_t N>
bool all_finite(const std::array<double, N>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

/// False when the norm is off by more than 1e-3; what rounding explains is left as it is.
bool make_unit(std::array<double, 4>& q) {
  double norm2 = 0.;
  for (const double value : q) norm2 += value * value;
  const double norm = std::sqrt(norm2);
  if (!(std::abs(norm - 1.) <= 1e-3)) return false;
  if (std::abs(norm - 1.) > 1e-12) {
    for (double& value : q) value /= norm;
  }
  return true;
}

class ImuReader final : public TopicReader {
 public:
  explicit ImuReader(const BagOptions& options) : TopicReader(options, options.imu_topic) {}

  void take(FieldReader& in, const Message& message) override {
    ImuSample imu = read_imu(in);
    imu.t_ns = stamp(imu.t_ns, message);
    if (!all_finite(imu.gyro_rad_per_s) || !all_finite(imu.accel_m_per_s2)) {
      return filter_.reject(log::kNotFinite, message);
    }
    if (filter_.accept(imu.t_ns, message)) samples_.push_back(imu);
  }

 private:
  void move_samples(BagSamples& out) override { out.imu = std::move(samples_); }

  std::vector<ImuSample> samples_;
};

class PoseReader final : public TopicReader {
 public:
  PoseReader(const BagOptions& options, Kind kind)
      : TopicReader(options, kind == Kind::kOdometry ? options.odometry_topic : options.pose_topic),
        kind_(kind) {}

  void take(FieldReader& in, const Message& message) override {
    PoseSample pose = read_pose(kind_, in);
    pose.t_ns = stamp(pose.t_ns, message);
    if (!all_finite(pose.p_BinW_m) || !all_finite(pose.q_BtoW_xyzw)) {
      return filter_.reject(log::kNotFinite, message);
    }
    if (!make_unit(pose.q_BtoW_xyzw)) return filter_.reject(log::kNotUnit, message);
    if (filter_.accept(pose.t_ns, message)) samples_.push_back(pose);
  }

 private:
  void move_samples(BagSamples& out) override { out.poses = std::move(samples_); }

  Kind kind_;
  std::vector<PoseSample> samples_;
};

class ImageReader final : public TopicReader {
 public:
  ImageReader(const BagOptions& options, Kind kind, int camera, std::shared_ptr<const Bag> bag)
      : TopicReader(options, options.image_topics[static_cast<std::size_t>(camera)]),
        is_compressed_(kind == Kind::kCompressedImage),
        camera_(camera),
        bag_(std::move(bag)) {}

  void take(FieldReader& in, const Message& message) override {
    const std::int64_t t_ns = stamp(is_compressed_ ? read_format(in) : read_encoding(in), message);
    if (!filter_.accept(t_ns, message)) return;
    const std::string where =
        *message.file + ": " + filter_.topic() + " message " + std::to_string(message.number);
    samples_.push_back(
        {t_ns, camera_, std::make_shared<BagImage>(bag_, message.load, is_compressed_, where)});
  }

 private:
  void move_samples(BagSamples& out) override {
    std::move(samples_.begin(), samples_.end(), std::back_inserter(out.images));
  }

  std::int64_t read_encoding(FieldReader& in) const {
    const ImageHead head = read_image_head(in);
    if (is_known_encoding(head.encoding)) return head.t_ns;
    throw InputError(bag_->name() + "  topic '" + filter_.topic() + "' has images of encoding " +
                     log::quoted(head.encoding) + ": what is read is " + known_encodings());
  }

  std::int64_t read_format(FieldReader& in) const {
    const std::int64_t t_ns = in.header();
    const std::string_view format = in.text();
    if (format.find("compressedDepth") == std::string_view::npos) return t_ns;
    throw InputError(bag_->name() + "  topic '" + filter_.topic() +
                     "' has images of depth (format " + log::quoted(format) +
                     "): grey or colour ones are needed");
  }

  bool is_compressed_;
  int camera_;
  std::shared_ptr<const Bag> bag_;
  std::vector<ImageSample> samples_;
};

class JointReader final : public TopicReader {
 public:
  explicit JointReader(const BagOptions& options)
      : TopicReader(options, options.joint_topic),
        options_(options.encoders),
        drive_(options.drive_joints),
        steer_(options.steer_joints) {}

  void take(FieldReader& in, const Message& message) override {
    Joints joints = read_joints(in);
    if (joints.names != names_) {
      names_ = std::move(joints.names);
      has_all_ = find(drive_) && find(steer_);
      any_has_all_ = any_has_all_ || has_all_;
      for (const std::string& name : names_) {
        if (std::find(known_.begin(), known_.end(), name) == known_.end()) known_.push_back(name);
      }
    }
    if (!has_all_) return filter_.reject("message without one of the joints", message);
    log::EncoderReading reading;
    reading.t_ns = stamp(joints.t_ns, message);
    reading.n_drive = static_cast<int>(drive_.names.size());
    reading.n_steer = static_cast<int>(steer_.names.size());
    if (!pick(steer_, joints.positions, reading.steer_rad) ||
        (options_.drive_is_angle && !pick(drive_, joints.positions, reading.drive))) {
      return filter_.reject("message without the positions of the joints", message);
    }
    if (!options_.drive_is_angle && !pick(drive_, joints.velocities, reading.drive)) {
      return filter_.reject("message without the velocities of the joints", message);
    }
    if (!all_finite(reading.drive) || !all_finite(reading.steer_rad)) {
      return filter_.reject(log::kNotFinite, message);
    }
    if (filter_.accept(reading.t_ns, message)) readings_.push_back(reading);
  }

 private:
  /// Joints that are wanted, and where they are in the messages of names_.
  struct Channels {
    explicit Channels(const std::vector<std::string>& wanted)
        : names(wanted), places(wanted.size()) {}
    std::vector<std::string> names;
    std::vector<std::size_t> places;
  };

  bool find(Channels& channels) const {
    for (std::size_t i = 0; i < channels.names.size(); ++i) {
      const auto found = std::find(names_.begin(), names_.end(), channels.names[i]);
      if (found == names_.end()) return false;
      channels.places[i] = static_cast<std::size_t>(found - names_.begin());
    }
    return true;
  }

  template <std::size_t N>
  static bool pick(const Channels& channels, const std::vector<double>& from,
                   std::array<double, N>& to) {
    for (std::size_t i = 0; i < channels.places.size(); ++i) {
      if (channels.places[i] >= from.size()) return false;
      to[i] = from[channels.places[i]];
    }
    return true;
  }

  void check_names(const char* key, const Channels& channels, const std::string& bag) const {
    for (const std::string& name : channels.names) {
      if (std::find(known_.begin(), known_.end(), name) != known_.end()) continue;
      throw ParamError(key, "no joint '" + name + "' on topic '" + filter_.topic() + "' in " + bag +
                                log::did_you_mean(name, known_));
    }
  }

  void check(const std::string& bag) const override {
    if (any_has_all_ || known_.empty()) return;
    check_names("drive_joints", drive_, bag);
    check_names("steer_joints", steer_, bag);
  }

  void move_samples(BagSamples& out) override {
    const double max_gap_s = options_.limits.max_gap_s;
    if (options_.drive_is_angle) {
      out.wheels = log::cells_from_angles(readings_, max_gap_s, options_.stride);
      if (!out.wheels.empty()) return;
      throw InputError("topic '" + filter_.topic() +
                       "' has too few messages without a gap for a rate");
    }
    for (const log::EncoderReading& reading : readings_) {
      EncoderSample sample;
      sample.t_ns = reading.t_ns;
      sample.n_drive = reading.n_drive;
      sample.n_steer = reading.n_steer;
      sample.drive_rad_per_s = reading.drive;
      sample.steer_rad = reading.steer_rad;
      out.wheels.push_back(sample);
    }
    log::make_cells(out.wheels, max_gap_s);
  }

  log::EncoderRecordingOptions options_;
  Channels drive_, steer_;
  std::vector<std::string> names_;  ///< of the last message
  std::vector<std::string> known_;  ///< of all messages
  bool has_all_ = false;
  bool any_has_all_ = false;
  std::vector<log::EncoderReading> readings_;
};

}  // namespace

void TopicReader::finish(const std::string& bag, BagSamples& out) {
  check(bag);
  filter_.finish(bag);
  move_samples(out);
  out.rejections.insert(out.rejections.end(), filter_.counts().begin(), filter_.counts().end());
}

std::unique_ptr<TopicReader> make_imu_reader(const BagOptions& options) {
  return std::make_unique<ImuReader>(options);
}

std::unique_ptr<TopicReader> make_pose_reader(const BagOptions& options, Kind kind) {
  return std::make_unique<PoseReader>(options, kind);
}

std::unique_ptr<TopicReader> make_joint_reader(const BagOptions& options) {
  return std::make_unique<JointReader>(options);
}

std::unique_ptr<TopicReader> make_image_reader(const BagOptions& options, Kind kind, int camera,
                                               const std::shared_ptr<const Bag>& bag) {
  return std::make_unique<ImageReader>(options, kind, camera, bag);
}

}  // namespace viwo::bag

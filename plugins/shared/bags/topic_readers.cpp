#include "topic_readers.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "bag_image.hpp"
#include "joint_reading.hpp"
#include "viwo/api/status.hpp"
#include "viwo/log/cells.hpp"
#include "viwo/log/recording.hpp"
#include "viwo/log/text.hpp"

namespace viwo::bag {
namespace {

/// Why a message gives no reading.
const char* reason_of(MissingJoint::What missing) {
  switch (missing) {
    case MissingJoint::What::kJoint:
      return "message without one of the joints";
    case MissingJoint::What::kPosition:
      return "message without the positions of the joints";
    case MissingJoint::What::kVelocity:
      return "message without the velocities of the joints";
    case MissingJoint::What::kRest:
    case MissingJoint::What::kAgain:
      break;  // no reason to reject it
  }
  return "";
}

class ImuReader final : public TopicReader {
 public:
  explicit ImuReader(const BagOptions& options) : TopicReader(options, options.imu_topic) {}

  void take(FieldReader& in, const Message& message) override {
    ImuSample imu = read_imu(in);
    imu.t_ns = stamp(imu.t_ns, message);
    if (const char* const why = log::why_rejected(imu)) return filter_.reject(why, message);
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
    if (const char* const why = log::why_rejected(pose)) return filter_.reject(why, message);
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
    if (!is_depth(format)) return t_ns;
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
  JointReader(const BagOptions& options, Kind kind)
      : TopicReader(options, options.joint_topic),
        options_(options),
        kind_(kind),
        parts_(options),
        joints_(options.joint_map()) {}

  void take(FieldReader& in, const Message& message) override {
    Joints joints = kind_ == Kind::kOdometry ? read_twist(in) : read_joints(in);
    log::EncoderReading reading;
    const auto missing = parts_.add(joints, reading);
    if (!missing || missing->what != MissingJoint::What::kJoint) any_has_all_ = true;
    if (joints.names != names_) {
      names_ = std::move(joints.names);
      for (const std::string& name : names_) {
        if (known_.size() >= kMostKnown) break;
        if (std::find(known_.begin(), known_.end(), name) == known_.end()) known_.push_back(name);
      }
    }
    if (missing && missing->what == MissingJoint::What::kRest) return;
    if (missing && missing->what == MissingJoint::What::kAgain) {
      return filter_.leave_out(kJointsCameAgain, message);
    }
    if (missing) return filter_.reject(reason_of(missing->what), message);
    if (log::why_rejected(reading) != nullptr) {
      return filter_.reject(not_finite(reading, options_), message);
    }
    reading.t_ns = stamp(reading.t_ns, message);
    if (!filter_.accept(reading.t_ns, message)) return;
    if (const char* const why = joints_.convert(reading)) return filter_.reject_last(why, message);
    readings_.push_back(reading);
  }

 private:
  void check_names(const char* key, const std::vector<std::string>& wanted,
                   const std::string& bag) const {
    for (const std::string& name : wanted) {
      if (std::find(known_.begin(), known_.end(), name) != known_.end()) continue;
      throw ParamError(key, "no joint '" + name + "' on topic '" + filter_.topic() + "' in " + bag +
                                log::did_you_mean(name, known_));
    }
  }

  void check(const std::string& bag) const override {
    if (any_has_all_ || known_.empty()) return;
    check_names("drive_joints", options_.drive_joints, bag);
    check_names("steer_joints", options_.steer_joints, bag);
  }

  void move_samples(BagSamples& out) override {
    out.wheels = log::samples_from(readings_, options_.drive_is_angle(), options_.max_gap_s,
                                   options_.stride);
    if (!out.wheels.empty()) return;
    throw InputError("topic '" + filter_.topic() +
                     "' has too few messages without a gap for a rate");
  }

  /// They are searched at each message, and suggested where a name is misspelt.
  static constexpr std::size_t kMostKnown = 1000;

  BagOptions options_;
  Kind kind_;
  JointReadings parts_;
  log::JointMap joints_;
  std::vector<std::string> names_;  ///< of the last message
  std::vector<std::string> known_;  ///< of all messages
  bool any_has_all_ = false;
  std::vector<log::EncoderReading> readings_;
};

class FixReader final : public TopicReader {
 public:
  /// Receivers are slow: their gaps are not counted.
  explicit FixReader(const BagOptions& options)
      : TopicReader(options, options.gnss_topic,
                    {std::numeric_limits<double>::infinity(), options.max_rejected_fraction}),
        stride_(options.gnss_stride) {}

  void take(FieldReader& in, const Message& message) override {
    std::optional<GnssSample> fix = read_fix(in);
    if (!fix) {
      any_without_ = true;
      return filter_.leave_out("message without a fix", message);
    }
    fix->t_ns = stamp(fix->t_ns, message);
    if (const char* const why = fix->fault()) return filter_.reject(why, message);
    if (!filter_.accept(fix->t_ns, message)) return;
    if (n_++ % stride_ == 0) samples_.push_back(*fix);
  }

 private:
  void check(const std::string& bag) const override {
    if (any_without_ && n_ == 0) {
      throw InputError(bag + "  topic '" + filter_.topic() + "' has messages, and none has a fix");
    }
  }
  void move_samples(BagSamples& out) override { out.fixes = std::move(samples_); }

  std::int64_t stride_;
  std::int64_t n_ = 0;
  bool any_without_ = false;
  std::vector<GnssSample> samples_;
};

}  // namespace

void TopicReader::finish(const std::string& bag, const std::string& lost, BagSamples& out) {
  check(bag);
  filter_.finish(bag, lost);
  move_samples(out);
  out.rejections.insert(out.rejections.end(), filter_.counts().begin(), filter_.counts().end());
}

std::unique_ptr<TopicReader> make_imu_reader(const BagOptions& options) {
  return std::make_unique<ImuReader>(options);
}

std::unique_ptr<TopicReader> make_pose_reader(const BagOptions& options, Kind kind) {
  return std::make_unique<PoseReader>(options, kind);
}

std::unique_ptr<TopicReader> make_joint_reader(const BagOptions& options, Kind kind) {
  return std::make_unique<JointReader>(options, kind);
}

std::unique_ptr<TopicReader> make_fix_reader(const BagOptions& options) {
  return std::make_unique<FixReader>(options);
}

std::unique_ptr<TopicReader> make_image_reader(const BagOptions& options, Kind kind, int camera,
                                               const std::shared_ptr<const Bag>& bag) {
  return std::make_unique<ImageReader>(options, kind, camera, bag);
}

}  // namespace viwo::bag

#include "intake.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "ros1_fields.hpp"
#include "ros_messages.hpp"
#include "viwo/api/status.hpp"
#include "viwo/image/image_file.hpp"
#include "viwo/log/stamp_filter.hpp"
#include "viwo/log/text.hpp"

namespace viwo::ros1 {
namespace {

using bag::Kind;

template <std::size_t N>
bool all_finite(const std::array<double, N>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

/// Of the definition that is read.
const char* md5_of(Kind kind) {
  using ros::message_traits::md5sum;
  switch (kind) {
    case Kind::kImu:
      return md5sum<msg::Imu>();
    case Kind::kImage:
      return md5sum<msg::Image>();
    case Kind::kCompressedImage:
      return md5sum<msg::CompressedImage>();
    case Kind::kJoints:
      return md5sum<msg::JointState>();
    case Kind::kPose:
      return md5sum<msg::PoseStamped>();
    case Kind::kPoseWithCovariance:
      return md5sum<msg::PoseWithCovarianceStamped>();
    case Kind::kOdometry:
      return md5sum<msg::Odometry>();
  }
  return "*";
}

/// The image in a message, decoded when it is needed.
class MessageImage final : public ImageSource {
 public:
  MessageImage(boost::shared_ptr<const RawMessage> message, bool is_compressed, std::string where)
      : message_(std::move(message)), is_compressed_(is_compressed), where_(std::move(where)) {}

  void read(Image& out) const override {
    try {
      bag::Ros1Fields in(message_->bytes);
      if (is_compressed_) {
        in.header();
        in.text();  // the format, which the bytes tell, too
        decode_image(in.bytes(), where_, out);
      } else {
        const bag::ImageHead head = bag::read_image_head(in);
        bag::to_grey(head, in.bytes(), out);
      }
    } catch (const bag::BrokenMessage& broken) {
      throw InputError(where_ + ": " + broken.what());
    }
  }

 private:
  boost::shared_ptr<const RawMessage> message_;
  bool is_compressed_;
  std::string where_;
};

/// The values of the joints `wanted`, in this order. Says what is missing, if something is.
template <std::size_t N>
std::string pick(const bag::Joints& joints, const std::vector<std::string>& wanted,
                 const std::vector<double>& from, const char* what, std::array<double, N>& to) {
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const auto found = std::find(joints.names.begin(), joints.names.end(), wanted[i]);
    if (found == joints.names.end()) {
      return "no joint '" + wanted[i] + "'" + log::did_you_mean(wanted[i], joints.names);
    }
    const auto place = static_cast<std::size_t>(found - joints.names.begin());
    if (place >= from.size()) return "no " + std::string(what) + " of joint '" + wanted[i] + "'";
    to[i] = from[place];
  }
  return {};
}

}  // namespace

Intake::Intake(const TopicOptions& options, const HostServices& services, LiveQueue& queue)
    : options_(options),
      services_(services),
      queue_(queue),
      cells_(options.drive_is_angle, options.max_gap_s),
      image_order_(options.image_topics.size()) {
  const auto want = [this](const std::string& name, std::vector<Kind> kinds, int camera = -1) {
    if (!name.empty()) topics_.push_back({name, std::move(kinds), camera});
  };
  want(options.imu_topic, {Kind::kImu});
  want(options.joint_topic, {Kind::kJoints});
  want(options.pose_topic, {Kind::kPose, Kind::kPoseWithCovariance});
  want(options.odometry_topic, {Kind::kOdometry});
  for (std::size_t i = 0; i < options.image_topics.size(); ++i) {
    want(options.image_topics[i], {Kind::kImage, Kind::kCompressedImage}, static_cast<int>(i));
  }
  states_.resize(topics_.size());
}

void Intake::take(std::size_t topic, const std::string& type, const std::string& md5,
                  const boost::shared_ptr<const RawMessage>& message) {
  const std::scoped_lock lock(mutex_);
  const auto kind = bag::kind_of(type);
  const auto& kinds = topics_[topic].kinds;
  if (!kind || std::find(kinds.begin(), kinds.end(), *kind) == kinds.end()) {
    return reject(
        topic, "a " + type + " where a " + std::string(bag::type_name(kinds.front())) + " must be",
        0);
  }
  if (md5 != "*" && md5 != md5_of(*kind)) {
    return reject(topic, "another definition of " + type + " (md5 " + md5 + ")", 0);
  }
  try {
    read(topic, *kind, message);
  } catch (const bag::BrokenMessage& broken) {
    reject(topic, std::string("message that is broken: ") + broken.what(), 0);
  }
}

void Intake::read(std::size_t topic, Kind kind,
                  const boost::shared_ptr<const RawMessage>& message) {
  bag::Ros1Fields in(message->bytes);
  switch (kind) {
    case Kind::kImu:
      return take_imu(topic, bag::read_imu(in));
    case Kind::kJoints:
      return take_joints(topic, bag::read_joints(in));
    case Kind::kPose:
    case Kind::kPoseWithCovariance:
    case Kind::kOdometry:
      return take_pose(topic, bag::read_pose(kind, in));
    case Kind::kImage: {
      const bag::ImageHead head = bag::read_image_head(in);
      if (!bag::is_known_encoding(head.encoding)) {
        return reject(topic,
                      "image of encoding " + log::quoted(head.encoding) + ": what is read is " +
                          bag::known_encodings(),
                      head.t_ns);
      }
      return take_image(
          topic, {head.t_ns, topics_[topic].camera,
                  std::make_shared<MessageImage>(message, false,
                                                 "image on topic '" + topics_[topic].name +
                                                     "' of " + std::to_string(head.t_ns) + " ns")});
    }
    case Kind::kCompressedImage: {
      const std::int64_t t_ns = in.header();
      return take_image(
          topic, {t_ns, topics_[topic].camera,
                  std::make_shared<MessageImage>(message, true,
                                                 "image on topic '" + topics_[topic].name +
                                                     "' of " + std::to_string(t_ns) + " ns")});
    }
  }
}

void Intake::take_imu(std::size_t topic, const ImuSample& imu) {
  if (!all_finite(imu.gyro_rad_per_s) || !all_finite(imu.accel_m_per_s2)) {
    return reject(topic, log::kNotFinite, imu.t_ns);
  }
  if (accept(topic, imu.t_ns)) queue_.push(imu);
}

void Intake::take_pose(std::size_t topic, PoseSample pose) {
  auto& q = pose.q_BtoW_xyzw;
  if (!all_finite(pose.p_BinW_m) || !all_finite(q)) {
    return reject(topic, log::kNotFinite, pose.t_ns);
  }
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(std::abs(norm - 1.) <= 1e-3)) return reject(topic, log::kNotUnit, pose.t_ns);
  if (std::abs(norm - 1.) > 1e-12) {  // what rounding explains is left as it is
    for (double& value : q) value /= norm;
  }
  if (accept(topic, pose.t_ns)) queue_.push(pose);
}

void Intake::take_joints(std::size_t topic, const bag::Joints& joints) {
  log::EncoderReading reading;
  reading.t_ns = joints.t_ns;
  reading.n_drive = static_cast<int>(options_.drive_joints.size());
  reading.n_steer = static_cast<int>(options_.steer_joints.size());
  std::string missing =
      options_.drive_is_angle
          ? pick(joints, options_.drive_joints, joints.positions, "position", reading.drive)
          : pick(joints, options_.drive_joints, joints.velocities, "velocity", reading.drive);
  if (missing.empty()) {
    missing = pick(joints, options_.steer_joints, joints.positions, "position", reading.steer_rad);
  }
  if (!missing.empty()) return reject(topic, missing, joints.t_ns);
  if (!all_finite(reading.drive) || !all_finite(reading.steer_rad)) {
    return reject(topic, log::kNotFinite, joints.t_ns);
  }
  if (!accept(topic, reading.t_ns)) return;
  if (const auto cell = cells_.add(reading)) queue_.push(*cell);
}

void Intake::take_image(std::size_t topic, const ImageSample& image) {
  if (!accept(topic, image.t_ns)) return;
  ready_.clear();
  if (!image_order_.add(image, ready_)) {
    return reject(topic, "image that came when later ones had been passed on", image.t_ns);
  }
  for (ImageSample& ready : ready_) queue_.push(std::move(ready));
}

bool Intake::accept(std::size_t topic, std::int64_t t_ns) {
  State& state = states_[topic];
  if (t_ns == 0) {
    reject(topic, "message without a stamp", t_ns);
    return false;
  }
  if (state.last_ns && t_ns <= *state.last_ns) {
    reject(topic, log::kStampNotAfter, t_ns);
    return false;
  }
  if (state.last_ns && seconds_between(*state.last_ns, t_ns) > options_.max_gap_s) {
    count(topic, "gap longer than " + log::number_text(options_.max_gap_s) + " s", t_ns,
          "it is counted");
  }
  state.last_ns = t_ns;
  state.last_use = Clock::now();
  last_use_ = state.last_use;
  return true;
}

void Intake::reject(std::size_t topic, const std::string& reason, std::int64_t t_ns) {
  count(topic, reason, t_ns, "it is dropped, and others like it are counted");
}

void Intake::count(std::size_t topic, const std::string& reason, std::int64_t t_ns,
                   const std::string& consequence) {
  const std::string full = topics_[topic].name + ": " + reason;
  const auto known = std::find_if(counts_.begin(), counts_.end(),
                                  [&](const RejectionCount& c) { return c.reason == full; });
  if (known != counts_.end()) {
    ++known->count;
    return;
  }
  counts_.push_back({full, 1, "stamp " + std::to_string(t_ns) + " ns"});
  services_.log(LogLevel::kWarning, "topic " + full + "; " + consequence);
}

std::optional<Intake::Clock::time_point> Intake::last_use() const {
  const std::scoped_lock lock(mutex_);
  return last_use_;
}

std::vector<std::string> Intake::silent_topics(std::chrono::milliseconds longer_than) const {
  const std::scoped_lock lock(mutex_);
  std::vector<std::string> silent;
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    if (Clock::now() - states_[i].last_use > longer_than) silent.push_back(topics_[i].name);
  }
  return silent;
}

void Intake::rejections(std::vector<RejectionCount>& out) const {
  const std::scoped_lock lock(mutex_);
  out.insert(out.end(), counts_.begin(), counts_.end());
}

}  // namespace viwo::ros1

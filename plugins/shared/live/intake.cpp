#include "intake.hpp"

#include <algorithm>
#include <memory>
#include <string_view>
#include <utility>

#include "bag_image.hpp"
#include "viwo/api/status.hpp"
#include "viwo/log/recording.hpp"
#include "viwo/log/stamp_filter.hpp"
#include "viwo/log/text.hpp"

namespace viwo::live {
namespace {

using bag::Kind;

/// What the images that wait anywhere, or are being looked at, may take together.
constexpr std::size_t kMostHeldBytes = std::size_t{512} << 20;
constexpr std::size_t kMostBytes = std::size_t{128} << 20;  ///< of a message

/// The image in a message, decoded when it is needed.
class MessageImage final : public ImageSource {
 public:
  /// `held`: bytes of all such images that there are.
  MessageImage(std::shared_ptr<const bag::Bytes> message, MakeFields make_fields,
               bool is_compressed, std::string where, std::shared_ptr<HeldBytes> held)
      : message_(std::move(message)),
        make_fields_(make_fields),
        is_compressed_(is_compressed),
        where_(std::move(where)),
        held_(std::move(held)) {
    *held_ += message_->size();
  }
  ~MessageImage() override { *held_ -= message_->size(); }
  MessageImage(const MessageImage&) = delete;
  MessageImage& operator=(const MessageImage&) = delete;

  void read(Image& out) const override {
    with_fields([&](bag::FieldReader& in) { bag::read_image(in, is_compressed_, where_, out); });
  }
  void read_of_size(int width_px, int height_px, Image& out) const override {
    with_fields([&](bag::FieldReader& in) {
      bag::read_image_of_size(in, is_compressed_, where_, width_px, height_px, out);
    });
  }

 private:
  template <class Work>
  void with_fields(const Work& work) const {
    try {
      work(*make_fields_(*message_));
    } catch (const bag::BrokenMessage& broken) {
      throw InputError(where_ + ": " + broken.what());
    }
  }

  std::shared_ptr<const bag::Bytes> message_;
  MakeFields make_fields_;
  bool is_compressed_;
  std::string where_;
  std::shared_ptr<HeldBytes> held_;
};

/// Why a message gives no reading.
std::string reason_of(const bag::MissingJoint& missing, const bag::Joints& joints) {
  using What = bag::MissingJoint::What;
  const std::string joint = "joint '" + missing.joint + "'";
  if (missing.what == What::kJoint) {
    return "no " + joint + log::did_you_mean(missing.joint, joints.names);
  }
  return (missing.what == What::kPosition ? "no position of " : "no velocity of ") + joint;
}

}  // namespace

std::vector<Topic> wanted_topics(const bag::TopicOptions& options) {
  std::vector<Topic> topics;
  const auto want = [&topics](const std::string& name, std::vector<Kind> kinds, int camera = -1) {
    if (!name.empty()) topics.push_back({name, std::move(kinds), camera});
  };
  want(options.imu_topic, {Kind::kImu});
  want(options.joint_topic, {Kind::kJoints, Kind::kOdometry});
  want(options.pose_topic, {Kind::kPose, Kind::kPoseWithCovariance});
  want(options.odometry_topic, {Kind::kOdometry});
  want(options.gnss_topic, {Kind::kNavSatFix});
  for (std::size_t i = 0; i < options.image_topics.size(); ++i) {
    want(options.image_topics[i], {Kind::kImage, Kind::kCompressedImage}, static_cast<int>(i));
  }
  return topics;
}

Intake::Intake(const bag::TopicOptions& options, const HostServices& services,
               MeasurementQueue& queue, MakeFields make_fields, Pace pace)
    : options_(options),
      services_(services),
      queue_(queue),
      make_fields_(make_fields),
      pace_(pace),
      topics_(wanted_topics(options)),
      parts_(options),
      joints_(options.joint_map()),
      cells_(options.drive_is_angle(), options.max_gap_s),
      log_cells_(options.drive_is_angle(), options.max_gap_s),
      image_order_(options.image_topics.size()) {
  for (const Topic& topic : topics_) states_.emplace_back().jump = jump_of(topic);
}

void Intake::take(std::size_t topic, const std::string& type, const std::string& md5,
                  const std::shared_ptr<const bag::Bytes>& message) {
  const std::scoped_lock lock(mutex_);
  const auto kind = bag::kind_of(type);
  const auto& kinds = topics_[topic].kinds;
  if (!kind || std::find(kinds.begin(), kinds.end(), *kind) == kinds.end()) {
    return drop(topic,
                "a " + type + " where a " + std::string(bag::type_name(kinds.front())) + " must be",
                0);
  }
  if (md5 != "*" && md5 != bag::ros1_md5(*kind)) {
    return drop(topic, "another definition of " + type + " (md5 " + md5 + ")", 0);
  }
  if (message->size() > kMostBytes) return drop(topic, "message of more than 128 MiB", 0);
  try {
    read(topic, *kind, message);
  } catch (const bag::BrokenMessage& broken) {
    drop(topic, std::string("message that is broken: ") + broken.what(), 0);
  }
}

void Intake::read(std::size_t topic, Kind kind, const std::shared_ptr<const bag::Bytes>& message) {
  const std::unique_ptr<bag::FieldReader> fields = make_fields_(*message);
  bag::FieldReader& in = *fields;
  switch (kind) {
    case Kind::kImu:
      return take_imu(topic, bag::read_imu(in));
    case Kind::kJoints:
      return take_joints(topic, bag::read_joints(in));
    case Kind::kOdometry:
      if (topics_[topic].kinds.front() == Kind::kJoints) {
        return take_joints(topic, bag::read_twist(in));
      }
      [[fallthrough]];
    case Kind::kPose:
    case Kind::kPoseWithCovariance:
      return take_pose(topic, bag::read_pose(kind, in));
    case Kind::kNavSatFix:
      return take_fix(topic, bag::read_fix(in));
    case Kind::kImage: {
      const bag::ImageHead head = bag::read_image_head(in);
      if (!bag::is_known_encoding(head.encoding)) {
        return drop(topic,
                    "image of encoding " + log::quoted(head.encoding) + ": what is read is " +
                        bag::known_encodings(),
                    head.t_ns);
      }
      return take_image(topic, head.t_ns, message, false);
    }
    case Kind::kCompressedImage: {
      const std::int64_t t_ns = in.header();
      const std::string_view format = in.text();
      if (bag::is_depth(format)) {
        return drop(
            topic,
            "image of depth (format " + log::quoted(format) + "): grey or colour ones are needed",
            t_ns);
      }
      return take_image(topic, t_ns, message, true);
    }
  }
}

void Intake::take_imu(std::size_t topic, const ImuSample& imu) {
  if (const char* const why = log::why_rejected(imu)) return drop(topic, why, imu.t_ns);
  if (accept(topic, imu.t_ns)) queue_.push(imu, topic);
}

void Intake::take_pose(std::size_t topic, PoseSample pose) {
  if (const char* const why = log::why_rejected(pose)) return drop(topic, why, pose.t_ns);
  if (accept(topic, pose.t_ns)) queue_.push(pose, topic);
}

void Intake::take_fix(std::size_t topic, const std::optional<GnssSample>& fix) {
  if (!fix) return drop(topic, "message without a fix", 0);
  if (const char* const why = fix->fault()) return drop(topic, why, fix->t_ns);
  if (accept(topic, fix->t_ns)) queue_.push(*fix, topic);
}

void Intake::take_joints(std::size_t topic, const bag::Joints& joints) {
  log::EncoderReading reading;
  if (const auto missing = parts_.add(joints, reading)) {
    if (missing->what == bag::MissingJoint::What::kRest) return;
    if (missing->what == bag::MissingJoint::What::kAgain) {
      return count(topic, bag::kJointsCameAgain, joints.t_ns, "the newest ones are taken");
    }
    return drop(topic, reason_of(*missing, joints), joints.t_ns);
  }
  if (log::why_rejected(reading) != nullptr) {
    return drop(topic, bag::not_finite(reading, options_), joints.t_ns);
  }
  if (!accept(topic, reading.t_ns)) return;
  if (const char* const why = joints_.convert(reading)) return drop(topic, why, reading.t_ns);
  const auto cell = pace_ == Pace::kInStep ? log_cells_.add(reading) : cells_.add(reading);
  if (cell) queue_.push(*cell, topic);
}

bool Intake::is_full(std::size_t topic) const {
  return topics_[topic].camera >= 0 && *held_ >= kMostHeldBytes;
}

void Intake::take_image(std::size_t topic, std::int64_t t_ns,
                        const std::shared_ptr<const bag::Bytes>& message, bool is_compressed) {
  if (!accept(topic, t_ns)) return;
  if (pace_ == Pace::kLive && *held_ + message->size() > kMostHeldBytes) {
    return drop(topic, "image beyond the 512 MiB that images may take while they wait", t_ns);
  }
  const std::string where =
      "image on topic '" + topics_[topic].name + "' of " + std::to_string(t_ns) + " ns";
  const ImageSample image{
      t_ns, topics_[topic].camera,
      std::make_shared<MessageImage>(message, make_fields_, is_compressed, where, held_)};
  if (pace_ == Pace::kInStep) return queue_.push(image, topic);
  ready_.clear();
  if (!image_order_.add(image, ready_)) {
    return drop(topic, "image that came when later ones had been passed on", image.t_ns);
  }
  for (ImageSample& ready : ready_) queue_.push(std::move(ready), topic);
}

void Intake::finish(std::size_t topic) {
  const std::scoped_lock lock(mutex_);
  if (pace_ != Pace::kInStep || topics_[topic].kinds.front() != Kind::kJoints) return;
  if (const auto cell = log_cells_.finish()) queue_.push(*cell, topic);
}

/// Receivers of satellites give a fix in a second or so.
bool Intake::is_slow(std::size_t topic) const {
  return topics_[topic].kinds.front() == Kind::kNavSatFix;
}

/// An IMU has no pauses of a second, and what images and joints have is soon seen. Poses and fixes
/// may be seldom from the first on. In step it is as in a bag.
StampJump Intake::jump_of(const Topic& topic) const {
  if (pace_ == Pace::kInStep) return StampJump();
  switch (topic.kinds.front()) {
    case Kind::kImu:
      return StampJump(1., 0);
    case Kind::kJoints:
    case Kind::kImage:
      return StampJump(1.);
    default:
      return StampJump();
  }
}

/// Forgets what came on a topic before.
void Intake::begin_again(std::size_t topic) {
  State& state = states_[topic];
  state.last_ns.reset();
  state.clock = State().clock;
  state.jump = jump_of(topics_[topic]);
  const Kind kind = topics_[topic].kinds.front();
  if (kind == Kind::kJoints) {
    parts_.restart();
    joints_.restart();
    cells_ = LiveCells(options_.drive_is_angle(), options_.max_gap_s);
  }
  if (kind == Kind::kImage) image_order_ = ImageOrder(options_.image_topics.size());
}

bool Intake::accept(std::size_t topic, std::int64_t t_ns) {
  State& state = states_[topic];
  if (t_ns == 0) {
    drop(topic, "message without a stamp", t_ns);
    return false;
  }
  // It was set back, or the stamp that the others are compared with was broken.
  const bool is_set_back = state.last_ns && state.clock.see(t_ns, *state.last_ns);
  if (state.last_ns && t_ns <= *state.last_ns) {
    if (pace_ == Pace::kInStep || !is_set_back) {
      drop(topic, kStampNotAfter, t_ns);
      return false;
    }
    count(topic, "clock set back", t_ns, "its messages are taken from here on");
    begin_again(topic);
  }
  if (!state.jump.is_believed(t_ns)) {
    drop(topic, kStampFarAhead, t_ns);
    return false;
  }
  if (state.last_ns && !is_slow(topic) &&
      seconds_between(*state.last_ns, t_ns) > options_.max_gap_s) {
    count(topic, gap_reason(options_.max_gap_s), t_ns, "it is counted");
  }
  state.last_ns = t_ns;
  state.last_use = Clock::now();
  last_use_ = state.last_use;
  return true;
}

void Intake::reject(std::size_t topic, const std::string& reason, std::int64_t t_ns,
                    std::int64_t n) {
  const std::scoped_lock lock(mutex_);
  drop(topic, reason, t_ns, n);
}

void Intake::drop(std::size_t topic, const std::string& reason, std::int64_t t_ns, std::int64_t n) {
  count(topic, reason, t_ns, "it is dropped, and others like it are counted", n);
}

void Intake::count(std::size_t topic, const std::string& reason, std::int64_t t_ns,
                   const char* consequence, std::int64_t n) {
  const std::string full = topics_[topic].name + ": " + reason;
  if (!counts_.add(
          full, [t_ns] { return stamp_text(t_ns); }, n)) {
    return;
  }
  services_.log(LogLevel::kWarning, "topic " + full + "; " + consequence);
}

std::optional<Intake::Clock::time_point> Intake::last_use() const {
  const std::scoped_lock lock(mutex_);
  return last_use_;
}

std::optional<std::int64_t> Intake::newest_ns() const {
  const std::scoped_lock lock(mutex_);
  std::optional<std::int64_t> newest;
  for (const State& state : states_) newest = std::max(newest, state.last_ns);
  return newest;
}

std::vector<std::string> Intake::silent_topics(std::chrono::milliseconds longer_than) const {
  const std::scoped_lock lock(mutex_);
  std::vector<std::string> silent;
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    const auto limit = is_slow(i) ? 5 * longer_than : longer_than;
    if (Clock::now() - states_[i].last_use > limit) silent.push_back(topics_[i].name);
  }
  return silent;
}

void Intake::rejections(std::vector<RejectionCount>& out) const {
  const std::scoped_lock lock(mutex_);
  counts_.append_to(out);
}

}  // namespace viwo::live

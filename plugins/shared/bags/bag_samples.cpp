#include "bag_samples.hpp"

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <limits>
#include <string>
#include <utility>

#include "messages.hpp"
#include "topic_readers.hpp"
#include "viwo/api/status.hpp"
#include "viwo/log/text.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo::bag {
namespace {

/// "a, b" of the topics that have one of the kinds.
std::string topics_of(const Bag& bag, std::initializer_list<Kind> kinds) {
  std::string names;
  for (const Topic& topic : bag.topics()) {
    const auto kind = kind_of(topic.type);
    if (!kind || std::find(kinds.begin(), kinds.end(), *kind) == kinds.end()) continue;
    names += (names.empty() ? "" : ", ") + topic.name;
  }
  return names;
}

std::string types_text(std::initializer_list<Kind> kinds) {
  std::string names;
  for (const Kind kind : kinds)
    names += (names.empty() ? "" : " or ") + std::string(type_name(kind));
  return names;
}

[[noreturn]] void no_such_topic(const Bag& bag, const std::string& key, const std::string& name,
                                std::initializer_list<Kind> kinds) {
  std::vector<std::string> all;
  for (const Topic& topic : bag.topics()) all.push_back(topic.name);
  std::string text = "no topic '" + name + "' in " + bag.name();
  const std::string near = log::did_you_mean(name, all);
  if (near.starts_with(" - did you mean")) text += near;
  const std::string same_type = topics_of(bag, kinds);
  text += same_type.empty() ? " - there is no topic of type " + types_text(kinds)
                            : " - of type " + types_text(kinds) + " there are: " + same_type;
  if (const std::string damage = bag.damage(); !damage.empty()) {
    text += "; the bag is damaged, what is missing may have been there: " + damage;
  }
  throw ParamError(key, text);
}

/// Which of the kinds the topic has.
Kind kind_of_topic(const Bag& bag, const std::string& key, const std::string& name,
                   std::initializer_list<Kind> kinds) {
  for (const Topic& topic : bag.topics()) {
    if (topic.name != name) continue;
    const auto kind = kind_of(topic.type);
    if (kind && std::find(kinds.begin(), kinds.end(), *kind) != kinds.end()) return *kind;
    const std::string others = topics_of(bag, kinds);
    throw ParamError(key, "topic '" + name + "' in " + bag.name() + " is of type " + topic.type +
                              ", needed is " + types_text(kinds) +
                              (others.empty() ? " - there is none" : " - there are: " + others));
  }
  no_such_topic(bag, key, name, kinds);
}

/// The readers of what is wanted, in the order of `wanted`.
struct Readers {
  std::vector<Wanted> wanted;
  std::vector<std::unique_ptr<TopicReader>> readers;

  void add(const std::string& topic, bool large, std::unique_ptr<TopicReader> reader) {
    wanted.push_back({topic, large});
    readers.push_back(std::move(reader));
  }
};

Readers make_readers(const std::shared_ptr<const Bag>& bag, const BagOptions& options) {
  Readers all;
  if (!options.imu_topic.empty()) {
    kind_of_topic(*bag, "imu_topic", options.imu_topic, {Kind::kImu});
    all.add(options.imu_topic, false, make_imu_reader(options));
  }
  for (std::size_t camera = 0; camera < options.image_topics.size(); ++camera) {
    const std::string& topic = options.image_topics[camera];
    const Kind kind =
        kind_of_topic(*bag, "image_topics", topic, {Kind::kImage, Kind::kCompressedImage});
    all.add(topic, true, make_image_reader(options, kind, static_cast<int>(camera), bag));
  }
  if (!options.joint_topic.empty()) {
    const Kind kind =
        kind_of_topic(*bag, "joint_topic", options.joint_topic, {Kind::kJoints, Kind::kOdometry});
    all.add(options.joint_topic, false, make_joint_reader(options, kind));
  }
  if (!options.pose_topic.empty()) {
    const Kind kind = kind_of_topic(*bag, "pose_topic", options.pose_topic,
                                    {Kind::kPose, Kind::kPoseWithCovariance});
    all.add(options.pose_topic, false, make_pose_reader(options, kind));
  }
  if (!options.odometry_topic.empty()) {
    kind_of_topic(*bag, "odometry_topic", options.odometry_topic, {Kind::kOdometry});
    all.add(options.odometry_topic, false, make_pose_reader(options, Kind::kOdometry));
  }
  if (!options.gnss_topic.empty()) {
    kind_of_topic(*bag, "gnss_topic", options.gnss_topic, {Kind::kNavSatFix});
    all.add(options.gnss_topic, false, make_fix_reader(options));
  }
  return all;
}

}  // namespace

BagSamples read_samples(const std::shared_ptr<const Bag>& bag, const BagOptions& options) {
  const Readers all = make_readers(bag, options);
  std::int64_t from_ns = std::numeric_limits<std::int64_t>::min();
  std::int64_t until_ns = std::numeric_limits<std::int64_t>::max();
  if (options.start_s > 0.) from_ns = bag->begin_ns() + to_ns(options.start_s);
  if (options.duration_s > 0.) {
    until_ns = bag->begin_ns() + to_ns(options.start_s) + to_ns(options.duration_s);
  }
  Rejections damage;
  const auto take = [&](const Message& message) {
    TopicReader& reader = *all.readers[message.topic];
    try {
      reader.take(*bag->fields(message.bytes), message);
    } catch (const BrokenMessage& broken) {
      reader.reject(std::string("broken message: ") + broken.what(), message);
    }
  };
  bag->read(all.wanted, from_ns, until_ns, take, damage);
  BagSamples out;
  damage.append_to(out.rejections);
  std::string lost;
  if (!damage.counts().empty()) {
    const RejectionCount& first = damage.counts().front();
    lost = "; the bag is damaged: " + first.reason + " (" + std::to_string(first.count) +
           ", first at " + first.first + ")";
  }
  for (const auto& reader : all.readers) reader->finish(bag->name(), lost, out);
  // Cameras of one time stay in their order.
  std::stable_sort(out.images.begin(), out.images.end(),
                   [](const ImageSample& a, const ImageSample& b) { return a.t_ns < b.t_ns; });
  return out;
}

}  // namespace viwo::bag

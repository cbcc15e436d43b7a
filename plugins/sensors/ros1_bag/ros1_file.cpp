#include "ros1_file.hpp"

#include <algorithm>
#include <cstdint>
#include <exception>
#include <map>
#include <mutex>
#include <system_error>
#include <utility>

#include <rosbag/bag.h>
#include <rosbag/view.h>

#include "messages.hpp"
#include "ros1_fields.hpp"
#include "ros1_structure.hpp"
#include "viwo/api/status.hpp"
#include "viwo/log/text.hpp"

namespace viwo::bag {
namespace {

namespace fs = std::filesystem;

/// Where rosbag_storage puts the bytes of a message, once it knows how many they are.
struct Sink {
  Bytes& bytes;
  std::uint8_t* advance(std::uint32_t n) {
    bytes.resize(n);
    return bytes.data();
  }
};

struct File {
  std::string name;
  rosbag::Bag bag;
  mutable std::mutex mutex;  ///< of the bag, which has one file position and one open chunk
  std::int64_t begin_ns = 0;
  std::uint64_t whole_bytes = 0;  ///< of its chunks, decompressed
};

std::int64_t to_ns(const ros::Time& time) {
  return std::int64_t{time.sec} * 1'000'000'000 + time.nsec;
}

/// The nearest time that there is in ROS.
ros::Time to_time(std::int64_t t_ns) {
  if (t_ns <= to_ns(ros::TIME_MIN)) return ros::TIME_MIN;
  if (t_ns >= to_ns(ros::TIME_MAX)) return ros::TIME_MAX;
  ros::Time time;
  return time.fromNSec(static_cast<std::uint64_t>(t_ns));
}

void load(const rosbag::MessageInstance& message, Bytes& out) {
  out.clear();
  Sink sink{out};
  message.write(sink);
}

std::unique_ptr<File> open_file(const fs::path& path) {
  auto file = std::make_unique<File>();
  file->name = path.string();
  file->whole_bytes = check_structure(file->name);
  try {
    file->bag.open(file->name, rosbag::bagmode::Read);
    rosbag::View all(file->bag);
    if (all.size() > 0) file->begin_ns = to_ns(all.getBeginTime());
  } catch (const std::exception& broken) {
    throw InputError(file->name + "  is damaged: " + broken.what());
  }
  return file;
}

class Ros1Recording final : public Bag {
 public:
  Ros1Recording(std::string name, std::vector<std::unique_ptr<File>> files)
      : name_(std::move(name)), files_(std::move(files)) {
    for (const auto& file : files_) {
      rosbag::View all(file->bag);
      if (all.size() > 0 && (begin_ns_ == 0 || file->begin_ns < begin_ns_)) {
        begin_ns_ = file->begin_ns;
      }
      for (const rosbag::ConnectionInfo* connection : all.getConnections()) {
        add_topic(name_, {connection->topic, connection->datatype}, topics_);
      }
    }
  }

  const std::string& name() const override { return name_; }
  const std::vector<Topic>& topics() const override { return topics_; }
  std::int64_t begin_ns() const override { return begin_ns_; }

  void read(const std::vector<Wanted>& wanted, std::int64_t from_ns, std::int64_t to_ns,
            const std::function<void(const Message&)>& visit,
            Rejections& /*damage*/) const override {  // is an error
    for (const auto& file : files_) {
      const std::scoped_lock lock(file->mutex);
      try {
        read_file(*file, wanted, to_time(from_ns), to_time(to_ns), visit);
      } catch (const InputError&) {
        throw;
      } catch (const std::exception& broken) {
        throw InputError(file->name + "  is damaged: " + broken.what());
      }
    }
  }

  std::unique_ptr<FieldReader> fields(std::span<const std::uint8_t> message) const override {
    return std::make_unique<Ros1Fields>(message);
  }

 private:
  /// The layout of the messages must be the one that is read.
  static void check_definition(const File& file, const rosbag::MessageInstance& message) {
    const auto kind = kind_of(message.getDataType());
    if (!kind || message.getMD5Sum() == ros1_md5(*kind)) return;
    throw InputError(file.name + "  topic '" + message.getTopic() + "' has another definition of " +
                     message.getDataType() + " (md5 " + message.getMD5Sum() + ", known is " +
                     std::string(ros1_md5(*kind)) + ")");
  }

  static void read_file(const File& file, const std::vector<Wanted>& wanted, const ros::Time& from,
                        const ros::Time& to, const std::function<void(const Message&)>& visit) {
    std::map<std::string, std::size_t> index;
    std::vector<std::string> names;
    for (const Wanted& topic : wanted) {
      index[topic.name] = names.size();
      names.push_back(topic.name);
    }
    std::vector<std::int64_t> numbers(wanted.size(), 0);
    std::vector<const void*> publishers(wanted.size(), nullptr);
    // From the beginning, for the numbers: what is passed over is not loaded.
    rosbag::View view(file.bag, rosbag::TopicQuery(names), ros::TIME_MIN, to);
    Bytes bytes;
    std::uint64_t read = 0;
    for (const rosbag::MessageInstance& instance : view) {
      Message message;
      message.topic = index.at(instance.getTopic());
      message.number = ++numbers[message.topic];
      // A topic may have several publishers.
      const void* const publisher = instance.getConnectionHeader().get();
      if (std::exchange(publishers[message.topic], publisher) != publisher) {
        check_definition(file, instance);
      }
      if (instance.getTime() < from) continue;
      message.received_ns = to_ns(instance.getTime());
      message.file = &file.name;
      load(instance, bytes);
      read += bytes.size();
      if (read > file.whole_bytes) {  // an index may name one of them any number of times
        throw InputError(file.name + "  is damaged: its messages have more bytes than its chunks");
      }
      message.bytes = bytes;
      if (wanted[message.topic].large) {
        message.load = [&file, instance](Bytes& out) { load_again(file, instance, out); };
      }
      visit(message);
    }
  }

  static void load_again(const File& file, const rosbag::MessageInstance& message, Bytes& out) {
    const std::scoped_lock lock(file.mutex);
    try {
      load(message, out);
    } catch (const std::exception& broken) {
      throw InputError(file.name + "  is damaged: " + broken.what());
    }
  }

  std::string name_;
  std::vector<std::unique_ptr<File>> files_;
  std::vector<Topic> topics_;
  std::int64_t begin_ns_ = 0;
};

}  // namespace

std::shared_ptr<const Bag> open_ros1(const fs::path& path, const std::vector<std::string>& names) {
  std::vector<std::unique_ptr<File>> files;
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) {
    if (!names.empty()) {
      throw ParamError("paths",
                       "names of bags need a folder as path, not the file " + path.string());
    }
    files.push_back(open_file(path));
    return std::make_shared<Ros1Recording>(path.string(), std::move(files));
  }
  for (const std::string& name : names) {
    if (!fs::exists(path / name, ignored)) {
      std::vector<std::string> there;
      for (const auto& entry : fs::directory_iterator(path)) {
        if (entry.path().extension() == ".bag") there.push_back(entry.path().filename().string());
      }
      std::sort(there.begin(), there.end());
      throw ParamError(
          "paths", "no file '" + name + "' in " + path.string() + log::did_you_mean(name, there));
    }
    files.push_back(open_file(path / name));
  }
  if (names.empty()) {
    for (const auto& entry : fs::directory_iterator(path)) {
      if (entry.path().extension() == ".bag") files.push_back(open_file(entry.path()));
    }
    if (files.empty()) {
      const bool is_ros2 = fs::exists(path / "metadata.yaml");
      throw ParamError("path", "no *.bag in the folder " + path.string() +
                                   (is_ros2 ? " - did you mean type: ros2_bag?" : ""));
    }
    std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) {
      return std::pair(a->begin_ns, a->name) < std::pair(b->begin_ns, b->name);
    });
  }
  return std::make_shared<Ros1Recording>(path.string(), std::move(files));
}

}  // namespace viwo::bag

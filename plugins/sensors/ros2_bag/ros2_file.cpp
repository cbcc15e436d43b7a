#include "ros2_file.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "bag_file.hpp"
#include "database.hpp"
#include "mcap_file.hpp"
#include "ros2_fields.hpp"
#include "viwo/api/status.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/log/text.hpp"

namespace viwo::bag {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRemedy =
    ": what is read is mcap (whatever its chunks are compressed by) and sqlite3 without "
    "compression "
    "- `ros2 bag convert` makes it";
constexpr const char* kMcap = ".mcap";

/// The text at a key of a section; empty if there is none.
std::string text_at(const config::Node& section, std::string_view key) {
  const config::Node* const value = section.find(key);
  return value != nullptr && value->is_scalar() ? value->scalar() : "";
}

/// What `unzstd` makes of a file beside it.
fs::path decompressed(const fs::path& file) {
  if (file.extension() != ".zstd") return file;
  fs::path whole = file;
  whole.replace_extension();
  std::error_code ignored;
  if (fs::exists(whole, ignored)) return whole;
  if (!fs::exists(file, ignored)) return file;  // who opens it says so
  throw InputError(file.string() + "  is compressed as a whole: `unzstd " + file.string() +
                   "` makes what is read, beside it");
}

/// The files that metadata.yaml lists.
std::vector<fs::path> files_of(const fs::path& folder, const fs::path& metadata) {
  const config::Node root = config::load_file(metadata);
  const config::Node* const info = root.find("rosbag2_bagfile_information");
  if (info == nullptr || !info->is_map()) {
    throw InputError(metadata.string() + "  has no rosbag2_bagfile_information");
  }
  const std::string storage = text_at(*info, "storage_identifier");
  if (storage != "sqlite3" && storage != "mcap") {
    throw InputError(folder.string() + "  is stored as '" + storage + "'" + kRemedy);
  }
  // Whole files are read when somebody has decompressed them.
  const std::string compression = text_at(*info, "compression_format");
  const bool are_files = compression == "zstd" && text_at(*info, "compression_mode") == "FILE";
  if (!compression.empty() && !are_files) {
    throw InputError(folder.string() + "  is compressed (" + compression + ")" + kRemedy);
  }
  std::vector<fs::path> files;
  if (const config::Node* const listed = info->find("relative_file_paths")) {
    for (const config::Node& file : listed->items()) {
      if (!file.is_scalar()) config::fail(file.mark(), "the name of a file must be a single value");
      // Early versions write the folder, too.
      files.push_back(folder / fs::path(file.scalar()).filename());
      if (are_files) files.back() = decompressed(files.back());
      const bool is_twice =
          std::find(files.begin(), files.end() - 1, files.back()) != files.end() - 1;
      if (is_twice) config::fail(file.mark(), log::quoted(file.scalar()) + " is listed twice");
    }
  }
  if (files.empty()) throw InputError(metadata.string() + "  lists no files");
  return files;
}

std::vector<fs::path> files_of(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) {
    const std::string extension = path.extension().string();
    if (extension == ".zstd" && fs::exists(path, ignored)) return {decompressed(path)};
    if (extension == ".lz4") {
      throw InputError(path.string() + "  is a file " + extension + kRemedy);
    }
    if (extension == ".bag" && fs::exists(path, ignored)) {
      throw InputError(path.string() + "  is no ROS 2 bag - did you mean type: ros1_bag?");
    }
    return {path};
  }
  const fs::path metadata = path / "metadata.yaml";
  if (fs::exists(metadata, ignored)) return files_of(path, metadata);
  std::vector<fs::path> files;  // its recording was not ended
  for (const auto& entry : fs::directory_iterator(path)) {
    const fs::path extension = entry.path().extension();
    if (extension == ".db3" || extension == kMcap) files.push_back(entry.path());
  }
  if (files.empty()) {
    throw InputError(path.string() +
                     "  is no ROS 2 bag: it has neither metadata.yaml nor *.mcap or *.db3");
  }
  return files;
}

class Ros2Recording final : public Bag {
 public:
  Ros2Recording(std::string name, std::vector<std::unique_ptr<BagFile>> files)
      : name_(std::move(name)), files_(std::move(files)) {
    std::sort(files_.begin(), files_.end(), [](const auto& a, const auto& b) {
      return std::pair(a->begin_ns(), a->name()) < std::pair(b->begin_ns(), b->name());
    });
    bool is_first = true;
    for (const auto& file : files_) {
      for (const Topic& topic : file->topics()) add_topic(name_, topic, topics_);
      if (file->is_empty() || !is_first) continue;
      is_first = false;
      begin_ns_ = file->begin_ns();
    }
  }

  const std::string& name() const override { return name_; }
  const std::vector<Topic>& topics() const override { return topics_; }
  std::int64_t begin_ns() const override { return begin_ns_; }
  std::string damage() const override {
    for (const auto& file : files_) {
      if (!file->damage().empty()) return file->damage();
    }
    return {};
  }
  void read(const std::vector<Wanted>& wanted, std::int64_t from_ns, std::int64_t to_ns,
            const std::function<void(const Message&)>& visit, Rejections& damage) const override {
    for (const auto& file : files_) file->read(wanted, from_ns, to_ns, visit, damage);
  }
  std::unique_ptr<FieldReader> fields(std::span<const std::uint8_t> message) const override {
    return std::make_unique<Ros2Fields>(message);
  }

 private:
  std::string name_;
  std::vector<std::unique_ptr<BagFile>> files_;
  std::vector<Topic> topics_;
  std::int64_t begin_ns_ = 0;
};

}  // namespace

std::shared_ptr<const Bag> open_ros2(const fs::path& path) {
  std::vector<std::unique_ptr<BagFile>> files;
  for (const fs::path& file : files_of(path)) {
    if (file.extension() == kMcap) {
      files.push_back(std::make_unique<McapFile>(file));
    } else {
      files.push_back(std::make_unique<Database>(file));
    }
  }
  return std::make_shared<Ros2Recording>(path.string(), std::move(files));
}

}  // namespace viwo::bag

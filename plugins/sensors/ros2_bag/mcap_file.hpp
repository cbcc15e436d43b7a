// One .mcap of a ROS 2 bag.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "bag_file.hpp"
#include "file_bytes.hpp"
#include "mcap_channels.hpp"
#include "mcap_chunk.hpp"
#include "mcap_structure.hpp"

namespace viwo::bag {

class McapFile final : public BagFile {
 public:
  explicit McapFile(const std::filesystem::path& file);

  const std::string& name() const override { return file_.name(); }
  const std::vector<Topic>& topics() const override { return topics_; }
  bool is_empty() const override { return structure_.chunks.empty(); }
  std::int64_t begin_ns() const override;
  std::string damage() const override { return damage_; }
  /// Chunk after chunk, each of them once; what was received before the next chunk begins is
  /// visited then.
  void read(const std::vector<Wanted>& wanted, std::int64_t from_ns, std::int64_t to_ns,
            const std::function<void(const Message&)>& visit, Rejections& damage) const override;

 private:
  class Reading;
  using Records = std::shared_ptr<const mcap::Content>;

  /// The channels that the file describes in its chunks only.
  void find_channels();
  /// The records of a chunk; those of the last chunks are kept.
  Records load(std::size_t chunk) const;
  void load(std::size_t chunk, std::size_t offset, std::size_t size, Bytes& out) const;
  [[noreturn]] void fail(std::size_t chunk, const std::string& what) const;

  FileBytes file_;
  mcap::Structure structure_;
  std::map<std::uint16_t, mcap::Channel> channels_;
  std::vector<Topic> topics_;
  std::string damage_;        ///< of a chunk that may describe channels
  mutable std::mutex mutex_;  ///< of what is kept
  mutable std::list<std::pair<std::size_t, Records>> kept_;  ///< the last one first
};

}  // namespace viwo::bag

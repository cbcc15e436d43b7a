// Channels of an MCAP file and the schemas that say of what type their messages are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace viwo::bag::mcap {

struct Channel {
  std::string topic;
  std::string type;      ///< the name of its schema; in words, where there is none
  std::string encoding;  ///< of its messages: "cdr"
};

class Channels {
 public:
  /// What was said before may be said again. BrokenRecord where it is said in another way.
  void add_schema(std::span<const std::uint8_t> fields);
  void add_channel(std::span<const std::uint8_t> fields);

  std::size_t size() const { return channels_.size(); }
  /// By their numbers.
  std::map<std::uint16_t, Channel> all() const;

 private:
  struct Schema {
    std::uint32_t crc;
    std::string name;
  };
  struct Described {
    std::uint32_t crc;
    std::uint16_t schema;
    std::string topic, encoding;
  };

  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Described> channels_;
};

}  // namespace viwo::bag::mcap

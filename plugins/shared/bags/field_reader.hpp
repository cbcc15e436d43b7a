// The fields of one serialised message, in their order: what the formats of ROS 1 and ROS 2 have in
// common.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string_view>

namespace viwo::bag {

/// A message that ends too early or is of another format. Counted, not fatal.
class BrokenMessage : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads field after field; BrokenMessage when the message does not have it.
class FieldReader {
 public:
  virtual ~FieldReader() = default;
  /// std_msgs/Header up to its frame: its stamp [ns].
  virtual std::int64_t stamp() = 0;
  virtual std::uint8_t u8() = 0;
  virtual std::uint16_t u16() = 0;
  virtual std::uint32_t u32() = 0;
  virtual double f64() = 0;
  /// Views into the message.
  virtual std::string_view text() = 0;
  virtual std::span<const std::uint8_t> bytes() = 0;
  /// Bytes behind the fields that have been read.
  virtual std::size_t left() const = 0;

  /// std_msgs/Header: its stamp [ns].
  std::int64_t header() {
    const std::int64_t t_ns = stamp();
    text();  // frame
    return t_ns;
  }

  /// The length of a list whose items take at least `item_bytes` each: never more than there can
  /// be.
  std::size_t count(std::size_t item_bytes) {
    const std::size_t n = u32();
    if (n > left() / item_bytes) throw BrokenMessage("a list is longer than its message");
    return n;
  }
};

}  // namespace viwo::bag

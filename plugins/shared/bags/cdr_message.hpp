// A message of ROS 2 in the making: CDR with its encapsulation, in either byte order.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "cdr.hpp"

namespace viwo::bag {

class CdrMessage {
 public:
  using Cdr = eprosima::fastcdr::Cdr;

  explicit CdrMessage(Cdr::Endianness order = Cdr::LITTLE_ENDIANNESS)
      : out_(buffer_, order, kDdsCdr) {
    out_.serialize_encapsulation();
  }
  template <class T>
  CdrMessage& operator<<(const T& value) {
    out_ << value;
    return *this;
  }
  /// std_msgs/Header.
  CdrMessage& header(std::int64_t t_ns, const std::string& frame = "f") {
    return stamp(t_ns) << frame;
  }
  /// builtin_interfaces/Time.
  CdrMessage& stamp(std::int64_t t_ns) {
    constexpr std::int64_t kSecond = 1'000'000'000;
    return *this << static_cast<std::int32_t>(t_ns / kSecond)
                 << static_cast<std::uint32_t>(t_ns % kSecond);
  }
  std::span<const std::uint8_t> bytes() {
    return {reinterpret_cast<const std::uint8_t*>(buffer_.getBuffer()), written(out_)};
  }

 private:
  eprosima::fastcdr::FastBuffer buffer_;
  Cdr out_;
};

}  // namespace viwo::bag

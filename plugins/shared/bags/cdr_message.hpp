// A message of ROS 2 in the making: CDR with its encapsulation, in either byte order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cdr.hpp"

namespace viwo::bag {

class CdrMessage {
 public:
  using Cdr = eprosima::fastcdr::Cdr;

  explicit CdrMessage(Cdr::Endianness order = Cdr::LITTLE_ENDIANNESS) : order_(order) {
    resize(kFirstBytes, 0);
  }
  CdrMessage(const CdrMessage&) = delete;
  CdrMessage& operator=(const CdrMessage&) = delete;

  template <class T>
  CdrMessage& operator<<(const T& value) {
    while (true) {
      const std::size_t before = written(*out_);
      try {
        *out_ << value;
        return *this;
      } catch (const eprosima::fastcdr::exception::NotEnoughMemoryException&) {
        resize(2 * bytes_.size(), before);
      }
    }
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
    return {reinterpret_cast<const std::uint8_t*>(bytes_.data()), written(*out_)};
  }

 private:
  static constexpr std::size_t kFirstBytes = 1024, kEncapsulationBytes = 4;

  /// The library steps over the bytes between numbers that are aligned: in a buffer of its own they
  /// are what the memory had before. Here they are zero.
  void resize(std::size_t n_bytes, std::size_t n_written) {
    bytes_.resize(n_bytes, 0);
    out_.reset();
    buffer_.emplace(bytes_.data(), bytes_.size());
    out_.emplace(*buffer_, order_, kDdsCdr);
    out_->serialize_encapsulation();
    if (n_written <= kEncapsulationBytes) return;
    // The last byte is written again: the next number is aligned by the size of what was before it.
    out_->jump(n_written - kEncapsulationBytes - 1);
    *out_ << bytes_[n_written - 1];
  }

  Cdr::Endianness order_;
  std::vector<char> bytes_;
  std::optional<eprosima::fastcdr::FastBuffer> buffer_;
  std::optional<Cdr> out_;
};

}  // namespace viwo::bag

// The fields of a serialised ROS 2 message: CDR with its encapsulation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "cdr.hpp"
#include "field_reader.hpp"

namespace viwo::bag {

class Ros2Fields final : public FieldReader {
 public:
  explicit Ros2Fields(std::span<const std::uint8_t> message)
      // A buffer has no constant form; reading does not write.
      : buffer_(reinterpret_cast<char*>(const_cast<std::uint8_t*>(message.data())), message.size()),
        in_(buffer_, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN, kDdsCdr) {
    // Of the encodings of DDS the one that ROS 2 writes, in either byte order: others are aligned
    // in another way, or have lists of parameters.
    if (message.size() < 4 || message[0] != 0 || message[1] > 1) {
      throw BrokenMessage("it does not begin like CDR");
    }
    try {
      in_.read_encapsulation();
    } catch (const eprosima::fastcdr::exception::Exception&) {
      throw BrokenMessage("it does not begin like CDR");
    }
  }

  std::int64_t stamp() override {
    const std::int64_t seconds = read<std::int32_t>();
    const std::int64_t nanoseconds = u32();
    return seconds * 1'000'000'000 + nanoseconds;
  }
  std::uint8_t u8() override { return read<std::uint8_t>(); }
  std::uint16_t u16() override { return read<std::uint16_t>(); }
  std::uint32_t u32() override { return read<std::uint32_t>(); }
  double f64() override { return read<double>(); }
  std::string_view text() override {
    const auto all = bytes();  // with a zero at the end
    return {reinterpret_cast<const char*>(all.data()), all.empty() ? 0 : all.size() - 1};
  }
  std::span<const std::uint8_t> bytes() override {
    const std::size_t n = count(1);
    const auto* const begin = reinterpret_cast<const std::uint8_t*>(position(in_));
    if (n == 0) return {};
    // The last byte is read: the next number is aligned by the size of what was read before it.
    if (!in_.jump(n - 1)) throw BrokenMessage("it ends too early");
    u8();
    return {begin, n};
  }
  std::size_t left() const override {
    auto& in = const_cast<eprosima::fastcdr::Cdr&>(in_);
    const auto read = static_cast<std::size_t>(position(in) - buffer_begin(in));
    return buffer_.getBufferSize() - read;
  }

 private:
  template <class T>
  T read() {
    try {
      T value{};
      in_ >> value;
      return value;
    } catch (const eprosima::fastcdr::exception::Exception&) {
      throw BrokenMessage("it ends too early");
    }
  }

  eprosima::fastcdr::FastBuffer buffer_;
  eprosima::fastcdr::Cdr in_;
};

}  // namespace viwo::bag

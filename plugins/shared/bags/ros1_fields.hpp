// The fields of a serialised ROS 1 message: packed, little endian.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <ros/serialization.h>

#include "field_reader.hpp"

namespace viwo::bag {

class Ros1Fields final : public FieldReader {
 public:
  explicit Ros1Fields(std::span<const std::uint8_t> message)
      // The stream has no constant form; reading does not write.
      : in_(const_cast<std::uint8_t*>(message.data()), static_cast<std::uint32_t>(message.size())) {
  }

  std::int64_t stamp() override {
    u32();  // sequence number
    const std::int64_t seconds = u32();
    const std::int64_t nanoseconds = u32();
    return seconds * 1'000'000'000 + nanoseconds;
  }
  std::uint8_t u8() override { return read<std::uint8_t>(); }
  std::uint16_t u16() override { return read<std::uint16_t>(); }
  std::uint32_t u32() override { return read<std::uint32_t>(); }
  double f64() override { return read<double>(); }
  std::string_view text() override {
    const auto all = bytes();
    return {reinterpret_cast<const char*>(all.data()), all.size()};
  }
  std::span<const std::uint8_t> bytes() override {
    const auto n = static_cast<std::uint32_t>(count(1));
    return {in_.advance(n), n};
  }
  std::size_t left() const override { return const_cast<Stream&>(in_).getLength(); }

 private:
  using Stream = ros::serialization::IStream;

  template <class T>
  T read() {
    if (left() < sizeof(T)) throw BrokenMessage("it ends too early");
    T value{};
    ros::serialization::deserialize(in_, value);
    return value;
  }

  Stream in_;
};

}  // namespace viwo::bag

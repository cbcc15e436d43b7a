// Messages of any type as roscpp receives them: their bytes. One kind of subscriber then serves
// topics whose type is not known before the first message comes (raw or compressed images), and the
// fields are read by the code that reads them from bags.
#pragma once

#include <cstdint>
#include <vector>

#include <ros/message_traits.h>
#include <ros/serialization.h>

namespace viwo::ros1 {

struct RawMessage {
  std::vector<std::uint8_t> bytes;
};

}  // namespace viwo::ros1

// What roscpp asks of a message; "*" stands for every type.
namespace ros {
namespace message_traits {

template <>
struct IsMessage<viwo::ros1::RawMessage> : TrueType {};
template <>
struct IsMessage<const viwo::ros1::RawMessage> : TrueType {};

template <>
struct MD5Sum<viwo::ros1::RawMessage> {
  static const char* value() { return "*"; }
  static const char* value(const viwo::ros1::RawMessage& /*message*/) { return "*"; }
};
template <>
struct DataType<viwo::ros1::RawMessage> {
  static const char* value() { return "*"; }
  static const char* value(const viwo::ros1::RawMessage& /*message*/) { return "*"; }
};

}  // namespace message_traits

namespace serialization {

template <>
struct Serializer<viwo::ros1::RawMessage> {
  template <class Stream>
  static void read(Stream& stream, viwo::ros1::RawMessage& message) {
    message.bytes.assign(stream.getData(), stream.getData() + stream.getLength());
  }
};

}  // namespace serialization
}  // namespace ros

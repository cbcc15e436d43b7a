// Fast DDS 2 (Debian 12) and 3 (Debian 13) by the same names.
#pragma once

#include <cstdint>
#include <cstring>
#include <functional>
#include <span>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#if __has_include(<fastdds/config.hpp>)
#include <fastdds/config.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.hpp>
#include <fastdds/utils/IPLocator.hpp>
#else
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastrtps/config.h>
#include <fastrtps/utils/IPLocator.h>
#endif

#include "bag.hpp"

namespace viwo::ros2 {

namespace dds = eprosima::fastdds::dds;

#ifdef FASTDDS_VERSION_MAJOR
namespace rtps = eprosima::fastdds::rtps;
inline bool is_ok(dds::ReturnCode_t code) { return code == dds::RETCODE_OK; }
#else
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::types::ReturnCode_t;
inline bool is_ok(const ReturnCode_t& code) { return code == ReturnCode_t::RETCODE_OK; }
#endif

/// What is left unread of a message that is longer.
inline constexpr std::uint32_t kMaxMessageBytes = 256U << 20U;

/// A type of any name whose samples are bag::Bytes: CDR as it comes and goes, with its
/// encapsulation. A message beyond kMaxMessageBytes is given as an empty one.
class RawType final : public dds::TopicDataType {
 public:
  explicit RawType(const char* name) {
#ifdef FASTDDS_VERSION_MAJOR
    set_name(name);
    max_serialized_type_size = kUsualBytes;
#else
    setName(name);
    m_typeSize = kUsualBytes;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
#endif
  }

#ifdef FASTDDS_VERSION_MAJOR
  bool serialize(const void* data, rtps::SerializedPayload_t& payload,
                 dds::DataRepresentationId_t /*representation*/) override {
    return write(*static_cast<const bag::Bytes*>(data), payload);
  }
  bool deserialize(rtps::SerializedPayload_t& payload, void* data) override {
    read(payload, *static_cast<bag::Bytes*>(data));
    return true;
  }
  std::uint32_t calculate_serialized_size(const void* data,
                                          dds::DataRepresentationId_t /*representation*/) override {
    return size_of(data);
  }
  void* create_data() override { return new bag::Bytes; }
  void delete_data(void* data) override { delete static_cast<bag::Bytes*>(data); }
  bool compute_key(rtps::SerializedPayload_t& /*payload*/, rtps::InstanceHandle_t& /*handle*/,
                   bool /*force_md5*/) override {
    return false;
  }
  bool compute_key(const void* /*data*/, rtps::InstanceHandle_t& /*handle*/,
                   bool /*force_md5*/) override {
    return false;
  }
#else
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    return write(*static_cast<const bag::Bytes*>(data), *payload);
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    read(*payload, *static_cast<bag::Bytes*>(data));
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return size_of(data); };
  }
  void* createData() override { return new bag::Bytes; }
  void deleteData(void* data) override { delete static_cast<bag::Bytes*>(data); }
  bool getKey(void* /*data*/, rtps::InstanceHandle_t* /*handle*/, bool /*force_md5*/) override {
    return false;
  }
#endif

 private:
  static constexpr std::uint32_t kUsualBytes = 1024;  ///< memory grows where it is more

  static std::uint32_t size_of(const void* data) {
    return static_cast<std::uint32_t>(static_cast<const bag::Bytes*>(data)->size());
  }
  static bool write(const bag::Bytes& bytes, rtps::SerializedPayload_t& payload) {
    if (bytes.size() > payload.max_size) return false;
    std::memcpy(payload.data, bytes.data(), bytes.size());
    payload.length = static_cast<std::uint32_t>(bytes.size());
    payload.encapsulation = CDR_LE;
    return true;
  }
  static void read(const rtps::SerializedPayload_t& payload, bag::Bytes& bytes) {
    bytes.clear();
    if (payload.length > kMaxMessageBytes) return;
    bytes.assign(payload.data, payload.data + payload.length);
  }
};

}  // namespace viwo::ros2

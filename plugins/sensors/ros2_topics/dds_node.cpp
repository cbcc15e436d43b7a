#include "dds_node.hpp"

#include <memory>
#include <utility>

#include "dds_names.hpp"
#include "viwo/api/status.hpp"

namespace viwo::ros2 {
namespace {

/// Of a socket, as far as the system gives it (net.core.rmem_max): an image has many parts.
constexpr std::uint32_t kReceiveBytes = 8U << 20U;
/// Participants of one machine that are asked where there is no multicast.
constexpr std::uint32_t kMostPerPeer = 32;

rtps::Locator_t locator(const std::string& address) {
  rtps::Locator_t out;
  out.kind = LOCATOR_KIND_UDPv4;
  rtps::IPLocator::setIPv4(out, address);
  out.port = 0;  // those of the domain
  return out;
}

dds::DomainParticipantQos qos_of(const DdsSettings& settings) {
  dds::DomainParticipantQos qos =
      dds::DomainParticipantFactory::get_instance()->get_default_participant_qos();
  qos.name("viwo");
  const std::string enclave = "enclave=/;";  // as ROS 2 says it of its participants
  qos.user_data().data_vec({enclave.begin(), enclave.end()});
  qos.transport().listen_socket_buffer_size = kReceiveBytes;
  auto& wire = qos.wire_protocol();
  for (const std::string& peer : settings.peers) {
    wire.builtin.initialPeersList.push_back(locator(peer));
  }
  const bool is_restricted = !settings.interfaces.empty();
  if (!settings.peers.empty()) {
    // Where there is a list of unicast addresses, DDS adds no multicast.
    const auto own = is_restricted ? settings.interfaces : std::vector<std::string>{"0.0.0.0"};
    for (const std::string& address : own) {
      wire.builtin.metatrafficUnicastLocatorList.push_back(locator(address));
    }
  }
  if (is_restricted || !settings.peers.empty()) {
    const auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList = settings.interfaces;
    udp->receiveBufferSize = kReceiveBytes;
    udp->maxInitialPeersRange = kMostPerPeer;
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(udp);
    qos.transport().user_transports.push_back(
        std::make_shared<eprosima::fastdds::rtps::SharedMemTransportDescriptor>());
  }
  return qos;
}

template <class Qos>
void say_type(Qos& qos, const std::string& dds_type) {
  const std::string said = said_of_type(ros_type(dds_type));
  qos.user_data().data_vec({said.begin(), said.end()});
}

/// DDS tells a participant of its own writers, too.
bool is_own(const rtps::GUID_t& writer, const dds::DomainParticipant& participant) {
  return writer.guidPrefix == participant.guid().guidPrefix;
}

}  // namespace

DdsNode::DdsNode(const DdsSettings& settings, std::function<void()> on_change)
    : on_change_(std::move(on_change)) {
  // Of the statuses only those that this listener has something to do for.
  dds::StatusMask mask = dds::StatusMask::data_available();
  participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(
      settings.domain, qos_of(settings), this, mask);
  if (participant_ == nullptr) {
    throw InputError("no participant of DDS in domain " + std::to_string(settings.domain) +
                     ": are there fewer than a hundred participants?");
  }
  subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
  publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
}

DdsNode::~DdsNode() {
  participant_->set_listener(nullptr);
  participant_->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

#ifdef FASTDDS_VERSION_MAJOR
void DdsNode::on_data_writer_discovery(dds::DomainParticipant* participant,
                                       rtps::WriterDiscoveryStatus reason,
                                       const dds::PublicationBuiltinTopicData& info,
                                       bool& /*should_be_ignored*/) {
  const bool is_there = reason == rtps::WriterDiscoveryStatus::DISCOVERED_WRITER ||
                        reason == rtps::WriterDiscoveryStatus::CHANGED_QOS_WRITER;
  if (is_own(info.guid, *participant)) return;
  note(info.guid, is_there,
       {info.topic_name.c_str(), info.type_name.c_str(),
        info.reliability.kind == dds::RELIABLE_RELIABILITY_QOS});
}
#else
void DdsNode::on_publisher_discovery(dds::DomainParticipant* participant,
                                     rtps::WriterDiscoveryInfo&& info) {
  if (is_own(info.info.guid(), *participant)) return;
  note(info.info.guid(), info.status != rtps::WriterDiscoveryInfo::REMOVED_WRITER,
       {info.info.topicName().c_str(), info.info.typeName().c_str(),
        info.info.m_qos.m_reliability.kind == dds::RELIABLE_RELIABILITY_QOS});
}
#endif

void DdsNode::note(const rtps::GUID_t& writer, bool is_there, const Published& published) {
  {
    const std::scoped_lock lock(mutex_);
    if (is_there) {
      published_[writer] = published;
    } else {
      published_.erase(writer);
    }
    ++generation_;
  }
  on_change_();
}

std::vector<DdsNode::Published> DdsNode::published() const {
  const std::scoped_lock lock(mutex_);
  std::vector<Published> all;
  for (const auto& [writer, published] : published_) all.push_back(published);
  return all;
}

dds::Topic& DdsNode::topic_of(const std::string& topic, const std::string& type) {
  if (participant_->find_type(type).empty()) {
    dds::TypeSupport(new RawType(type.c_str())).register_type(participant_);
  }
  dds::Topic* const made = participant_->create_topic(topic, type, dds::TOPIC_QOS_DEFAULT);
  if (made == nullptr) throw InputError("DDS makes no topic '" + topic + "' of type " + type);
  return *made;
}

dds::DataReader& DdsNode::make_reader(const std::string& topic, const std::string& type,
                                      Delivery delivery, int most) {
  dds::DataReaderQos qos = dds::DATAREADER_QOS_DEFAULT;
  say_type(qos, type);
  qos.reliability().kind = delivery == Delivery::kBestEffort ? dds::BEST_EFFORT_RELIABILITY_QOS
                                                             : dds::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = delivery == Delivery::kLatched ? dds::TRANSIENT_LOCAL_DURABILITY_QOS
                                                         : dds::VOLATILE_DURABILITY_QOS;
  qos.history().kind =
      delivery == Delivery::kEverything ? dds::KEEP_ALL_HISTORY_QOS : dds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = most;
  qos.resource_limits().max_instances = 1;
  qos.resource_limits().max_samples = most;
  qos.resource_limits().max_samples_per_instance = most;
  qos.resource_limits().allocated_samples = 0;
  qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  dds::DataReader* const made = subscriber_->create_datareader(&topic_of(topic, type), qos);
  if (made == nullptr) throw InputError("DDS makes no reader of topic '" + topic + "'");
  return *made;
}

dds::DataWriter& DdsNode::make_writer(const std::string& topic, const std::string& type, int most) {
  dds::DataWriterQos qos = dds::DATAWRITER_QOS_DEFAULT;
  say_type(qos, type);
  qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = dds::VOLATILE_DURABILITY_QOS;
  qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = most;
  qos.resource_limits().max_instances = 1;
  qos.resource_limits().max_samples = most;
  qos.resource_limits().max_samples_per_instance = most;
  qos.resource_limits().allocated_samples = 0;
  qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  // An estimate must not wait for a subscriber that is slow.
  qos.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;
  dds::DataWriter* const made = publisher_->create_datawriter(&topic_of(topic, type), qos);
  if (made == nullptr) throw InputError("DDS makes no writer of topic '" + topic + "'");
  return *made;
}

void DdsNode::on_data_available(dds::DataReader* reader) {
  {
    const std::scoped_lock lock(mutex_);
    has_data_.insert(reader);
  }
  on_change_();
}

bool DdsNode::take(dds::DataReader& reader, bag::Bytes& out, dds::SampleInfo& info) {
  {
    // Fast DDS ends the process (an assertion) where its first message is taken before it has told
    // that it is there.
    const std::scoped_lock lock(mutex_);
    if (!has_data_.contains(&reader)) return false;
  }
  return is_ok(reader.take_next_sample(&out, &info));
}

bool write(dds::DataWriter& writer, bag::Bytes message) {
#ifdef FASTDDS_VERSION_MAJOR
  return is_ok(writer.write(&message));
#else
  return writer.write(&message);
#endif
}

}  // namespace viwo::ros2

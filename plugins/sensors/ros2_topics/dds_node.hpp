// A participant of DDS: what is published by others, readers and writers of CDR.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "dds_settings.hpp"
#include "fast_dds.hpp"

namespace viwo::ros2 {

class DdsNode final : private dds::DomainParticipantListener {
 public:
  /// What another participant publishes, by the names of DDS.
  struct Published {
    std::string topic;
    std::string type;
    bool reliable = false;
  };
  /// Of a reader.
  enum class Delivery {
    kBestEffort,  ///< from any publisher
    kReliable,    ///< what is lost is sent again; only from publishers that do
    kLatched,     ///< reliable, with what was sent before there was a reader
    kEverything,  ///< reliable, and publishers wait that are made to
  };

  /// `on_change`, from threads of DDS: somebody has come or gone, or messages are there. InputError
  /// when there can be no participant.
  DdsNode(const DdsSettings& settings, std::function<void()> on_change);
  ~DdsNode() override;
  DdsNode(const DdsNode&) = delete;
  DdsNode& operator=(const DdsNode&) = delete;

  std::vector<Published> published() const;
  /// Another number whenever published() is another.
  int generation() const { return generation_; }
  /// They live as long as the node. InputError when they cannot be made. `most`: messages that wait
  /// to be read.
  dds::DataReader& make_reader(const std::string& topic, const std::string& type, Delivery delivery,
                               int most);
  /// Reliable; late readers get nothing of before. `most`: messages that wait to be sent.
  dds::DataWriter& make_writer(const std::string& topic, const std::string& type, int most);

  /// Takes a message; false when there is none. A message of which only an end is told (no data)
  /// is empty.
  bool take(dds::DataReader& reader, bag::Bytes& out, dds::SampleInfo& info);

 private:
  void on_data_available(dds::DataReader* reader) override;
#ifdef FASTDDS_VERSION_MAJOR
  void on_data_writer_discovery(dds::DomainParticipant* participant,
                                rtps::WriterDiscoveryStatus reason,
                                const dds::PublicationBuiltinTopicData& info,
                                bool& should_be_ignored) override;
#else
  void on_publisher_discovery(dds::DomainParticipant* participant,
                              rtps::WriterDiscoveryInfo&& info) override;
#endif
  void note(const rtps::GUID_t& writer, bool is_there, const Published& published);
  dds::Topic& topic_of(const std::string& topic, const std::string& type);

  std::function<void()> on_change_;
  mutable std::mutex mutex_;
  std::map<rtps::GUID_t, Published> published_;
  std::set<const dds::DataReader*> has_data_;  ///< readers that had some
  std::atomic<int> generation_ = 0;
  dds::DomainParticipant* participant_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
};

/// Whether it could be given to DDS.
bool write(dds::DataWriter& writer, bag::Bytes message);

}  // namespace viwo::ros2

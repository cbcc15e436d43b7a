#include "mcap_channels.hpp"

#include <utility>

#include <zlib.h>

#include "mcap_records.hpp"

namespace viwo::bag::mcap {
namespace {

std::uint32_t crc_of(std::span<const std::uint8_t> bytes) {
  return static_cast<std::uint32_t>(crc32_z(0, bytes.data(), bytes.size()));
}

/// Names are kept, and there may be 65535 of them.
std::string name_of(Fields& in) {
  constexpr std::size_t kMost = 1024;
  const std::string_view name = in.text();
  if (name.size() > kMost) {
    throw BrokenRecord("a name of " + std::to_string(name.size()) + " bytes");
  }
  return std::string(name);
}

template <class Item>
void keep(std::map<std::uint16_t, Item>& items, std::uint16_t id, Item item, const char* what) {
  const auto [known, is_new] = items.emplace(id, std::move(item));
  if (!is_new && known->second.crc != item.crc) {
    throw BrokenRecord(std::string(what) + " " + std::to_string(id) + " is described in two ways");
  }
}

}  // namespace

void Channels::add_schema(std::span<const std::uint8_t> fields) {
  Fields in(fields);
  const std::uint16_t id = in.u16();
  if (id == 0) return;  // of the specification: invalid, and to be passed over
  std::string name = name_of(in);
  keep(schemas_, id, {crc_of(fields), std::move(name)}, "schema");
}

void Channels::add_channel(std::span<const std::uint8_t> fields) {
  Fields in(fields);
  const std::uint16_t id = in.u16();
  const std::uint16_t schema = in.u16();
  std::string topic = name_of(in);
  std::string encoding = name_of(in);
  keep(channels_, id, {crc_of(fields), schema, std::move(topic), std::move(encoding)}, "channel");
}

std::map<std::uint16_t, Channel> Channels::all() const {
  std::map<std::uint16_t, Channel> out;
  for (const auto& [id, channel] : channels_) {
    const auto schema = schemas_.find(channel.schema);
    const char* const none = channel.schema == 0 ? "(a channel without a schema)"
                                                 : "(a channel whose schema is missing)";
    out[id] = {channel.topic, schema == schemas_.end() ? none : schema->second.name,
               channel.encoding};
  }
  return out;
}

}  // namespace viwo::bag::mcap

// The records of MCAP (https://mcap.dev/spec): what they begin with, and their fields.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

namespace viwo::bag::mcap {

inline constexpr std::array<std::uint8_t, 8> kMagic{0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};

enum Op : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0b,
  kSummaryOffset = 0x0e,
  kDataEnd = 0x0f
};

/// Kind and length, before the fields of a record.
inline constexpr std::size_t kRecordHead = 9;
/// Of a message, before its data: channel, sequence, time of recording, time of publication.
inline constexpr std::size_t kMessageHead = 22;

/// What cannot be; who knows the place tells it.
class BrokenRecord : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads fields one after the other, little endian. BrokenRecord where there are too few bytes.
class Fields {
 public:
  explicit Fields(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  std::uint8_t u8() { return number<std::uint8_t>(); }
  std::uint16_t u16() { return number<std::uint16_t>(); }
  std::uint32_t u32() { return number<std::uint32_t>(); }
  std::uint64_t u64() { return number<std::uint64_t>(); }
  std::string_view text() {
    const auto all = bytes(u32());
    return {reinterpret_cast<const char*>(all.data()), all.size()};
  }
  std::span<const std::uint8_t> bytes(std::uint64_t n) {
    if (n > rest_.size()) throw BrokenRecord("a record ends within its fields");
    const auto out = rest_.first(static_cast<std::size_t>(n));
    rest_ = rest_.subspan(out.size());
    return out;
  }
  std::span<const std::uint8_t> rest() const { return rest_; }

 private:
  template <class T>
  T number() {
    T value = 0;  // the byte order of all that this is built for
    std::memcpy(&value, bytes(sizeof(value)).data(), sizeof(value));
    return value;
  }

  std::span<const std::uint8_t> rest_;
};

/// Calls visit(kind, fields, offset of the record) for the records in `bytes`. BrokenRecord for one
/// that goes beyond them, unless they are `cut`: then there are no more.
template <class Visit>
void for_each_record(std::span<const std::uint8_t> bytes, bool is_cut, const Visit& visit) {
  std::size_t at = 0;
  while (at < bytes.size()) {
    const auto rest = bytes.subspan(at);
    std::uint64_t length = 0;
    if (rest.size() >= kRecordHead) length = Fields(rest.subspan(1)).u64();
    if (rest.size() < kRecordHead || length > rest.size() - kRecordHead) {
      if (is_cut) return;
      throw BrokenRecord("a record goes beyond the end of its chunk");
    }
    const auto content = rest.subspan(kRecordHead, static_cast<std::size_t>(length));
    visit(rest[0], content, at);
    at += kRecordHead + content.size();
  }
}

}  // namespace viwo::bag::mcap

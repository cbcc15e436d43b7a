#include "log_file.hpp"

#include <algorithm>
#include <array>

#include "viwo/api/status.hpp"
#include "viwo/log/text.hpp"

namespace viwo::wpilog {
namespace {

constexpr std::string_view kMagic = "WPILOG";
constexpr const char* kCutShort = "log cut short";
constexpr const char* kNoRecord = "bytes that are no record: the rest is not read";

}  // namespace

std::uint64_t little_endian(const char* bytes, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = size; i-- > 0;) value = value << 8U | static_cast<unsigned char>(bytes[i]);
  return value;
}

LogFile::LogFile(const std::filesystem::path& file) : file_(file), bytes_(file) { read_header(); }

std::string LogFile::where(std::int64_t offset) const {
  return file_.filename().string() + ": byte " + std::to_string(offset);
}

std::size_t LogFile::take(char* into, std::size_t size) {
  std::size_t taken = 0;
  while (taken < size) {
    const std::size_t n = bytes_.read(into + taken, size - taken);
    if (n == 0) break;
    taken += n;
  }
  offset_ += static_cast<std::int64_t>(taken);
  if (taken < size && !bytes_.fault().empty() && !bytes_.truncated()) {
    throw InputError(file_.string() + "  byte " + std::to_string(offset_) + ": " + bytes_.fault());
  }
  return taken;
}

bool LogFile::pass_over(std::uint64_t size) {
  while (size > 0) {
    payload_.resize(std::min<std::uint64_t>(size, kMaxPayload));
    const std::size_t n = take(payload_.data(), payload_.size());
    if (n == 0) return false;
    size -= n;
  }
  return true;
}

void LogFile::read_header() {
  std::array<char, 12> head{};
  const std::size_t n = take(head.data(), head.size());
  const std::string_view begin(head.data(), std::min(n, kMagic.size()));
  if (n == 0) throw InputError(file_.string() + "  is empty");
  if (begin != kMagic) {
    throw InputError(file_.string() + "  is no WPILOG: it begins with " + log::quoted(begin));
  }
  if (n < head.size() || !pass_over(little_endian(&head[8], 4))) {
    throw InputError(file_.string() + "  is cut short within its header");
  }
  if (head[7] == 1) return;
  throw InputError(file_.string() + "  is a WPILOG of version " + std::to_string(head[7]) + "." +
                   std::to_string(head[6]) + ": what is read is version 1");
}

/// Whether gzip data are corrupt may show at their end only.
bool LogFile::stop(const char* fault) {
  fault_ = fault;
  payload_.resize(kMaxPayload);
  while (take(payload_.data(), payload_.size()) > 0) {
  }
  return false;
}

bool LogFile::next(Record& out) {
  if (fault_ != nullptr) return false;
  record_ = offset_;
  std::array<char, 17> head{};
  if (take(head.data(), 1) == 0) return stop(bytes_.truncated() ? kCutShort : nullptr);
  const auto lengths = static_cast<unsigned char>(head[0]);
  if ((lengths & 0x80U) != 0) return stop(kNoRecord);  // a spare bit, zero in every record
  const std::size_t entry = 1 + (lengths & 3U);
  const std::size_t size = 1 + (lengths >> 2U & 3U);
  const std::size_t time = 1 + (lengths >> 4U & 7U);
  if (take(&head[1], entry + size + time) < entry + size + time) return stop(kCutShort);
  out.entry = static_cast<std::uint32_t>(little_endian(&head[1], entry));
  out.size = static_cast<std::uint32_t>(little_endian(&head[1 + entry], size));
  out.t_us = static_cast<std::int64_t>(little_endian(&head[1 + entry + size], time));
  out.offset = record_;
  out.payload = {};
  if (out.size > kMaxPayload) return pass_over(out.size) || stop(kCutShort);
  payload_.resize(out.size);
  if (take(payload_.data(), out.size) < out.size) return stop(kCutShort);
  out.payload = {payload_.data(), out.size};
  return true;
}

}  // namespace viwo::wpilog

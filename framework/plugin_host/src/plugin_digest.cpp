#include "plugin_digest.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>
#include <span>
#include <vector>

#include <zlib.h>

#include "elf.hpp"
#include "viwo/plugin_host/build_record_check.hpp"

namespace viwo {
namespace {

using elf::fits;

std::string hexadecimal(std::uint32_t value) {
  std::array<char, 9> text{};
  std::snprintf(text.data(), text.size(), "%08x", value);
  return text.data();
}

/// Writes eight digits into every build record.
void set_digest(std::string& bytes, std::string_view digits) {
  for (const std::string& record : find_build_records(bytes)) {
    const std::string_view old = digest_in(record);
    if (old.size() != digits.size()) continue;
    const auto offset = static_cast<std::size_t>(old.data() - record.data());
    for (std::size_t at = bytes.find(record); at != std::string::npos;
         at = bytes.find(record, at + record.size())) {
      bytes.replace(at + offset, digits.size(), digits);
    }
  }
}

void blank_place_of_sections(std::string& bytes) {
  auto header = elf::copy_at<elf::Header>(bytes, 0);
  header.e_shoff = 0;
  header.e_shentsize = header.e_shnum = header.e_shstrndx = 0;
  std::memcpy(bytes.data(), &header, sizeof(header));
}

std::optional<std::size_t> offset_of(std::uint64_t address, std::span<const elf::Segment> segments,
                                     std::size_t size) {
  for (const elf::Segment& segment : segments) {
    if (segment.p_type != PT_LOAD || address < segment.p_vaddr) continue;
    const std::uint64_t within = address - segment.p_vaddr;
    if (within < segment.p_filesz && fits(segment.p_offset, within, size)) {
      return static_cast<std::size_t>(segment.p_offset + within);
    }
  }
  return std::nullopt;
}

/// An installation writes another path, or takes the entry out and moves up those behind it.
void blank_search_path(std::string& bytes, std::span<const elf::Segment> segments) {
  const auto found = std::find_if(segments.begin(), segments.end(),
                                  [](const auto& s) { return s.p_type == PT_DYNAMIC; });
  if (found == segments.end() || !fits(found->p_offset, found->p_filesz, bytes.size())) return;
  const std::size_t begin = found->p_offset, n = found->p_filesz / sizeof(elf::Dynamic);
  std::vector<elf::Dynamic> kept;
  std::vector<std::uint64_t> paths;
  std::uint64_t strings = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const auto entry = elf::copy_at<elf::Dynamic>(bytes, begin + i * sizeof(elf::Dynamic));
    if (entry.d_tag == DT_STRTAB) strings = entry.d_un.d_ptr;
    if (entry.d_tag == DT_RPATH || entry.d_tag == DT_RUNPATH) {
      paths.push_back(entry.d_un.d_val);
    } else {
      kept.push_back(entry);
    }
  }
  if (n == 0) return;
  kept.resize(n);
  std::memcpy(bytes.data() + begin, kept.data(), n * sizeof(elf::Dynamic));
  for (const std::uint64_t path : paths) {
    for (auto at = offset_of(strings + path, segments, bytes.size());
         at && *at < bytes.size() && bytes[*at] != '\0'; ++*at) {
      bytes[*at] = '\0';
    }
  }
}

}  // namespace

std::string plugin_digest(std::string bytes) {
  const std::vector<elf::Segment> segments = elf::segments(bytes);
  set_digest(bytes, hexadecimal(0));
  blank_place_of_sections(bytes);
  blank_search_path(bytes, segments);
  uLong crc = 0;
  const auto add = [&](std::uint64_t offset, std::uint64_t size) {
    crc = crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()) + offset, size);
  };
  add(0, sizeof(elf::Header));
  add(elf::copy_at<elf::Header>(bytes, 0).e_phoff, segments.size() * sizeof(elf::Segment));
  for (const elf::Segment& segment : segments) {
    if (segment.p_type == PT_LOAD) add(segment.p_offset, segment.p_filesz);
  }
  return hexadecimal(static_cast<std::uint32_t>(crc));
}

std::string_view digest_in(std::string_view record) {
  const std::string field = ";" + std::string(kDigestField) + "=";
  const std::size_t at = record.rfind(field);
  if (at == std::string_view::npos) return {};
  const std::string_view value = record.substr(at + field.size());
  return value.substr(0, value.find(';'));
}

std::string sealed(std::string bytes) {
  set_digest(bytes, plugin_digest(bytes));
  return bytes;
}

}  // namespace viwo

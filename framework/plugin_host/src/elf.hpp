// The parts of an ELF file that the loader reads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <vector>

#include <link.h>

namespace viwo::elf {

using Header = ElfW(Ehdr);
using Segment = ElfW(Phdr);
using Dynamic = ElfW(Dyn);

/// Whether [offset, offset + size) lies within `total` bytes.
inline bool fits(std::uint64_t offset, std::uint64_t size, std::uint64_t total) {
  return offset <= total && size <= total - offset;
}

/// It must fit.
template <class T>
T copy_at(std::string_view bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

/// Of a file whose table of segments fits.
inline std::vector<Segment> segments(std::string_view bytes) {
  const auto header = copy_at<Header>(bytes, 0);
  std::vector<Segment> out;
  for (std::size_t i = 0; i < header.e_phnum; ++i) {
    out.push_back(copy_at<Segment>(bytes, header.e_phoff + i * sizeof(Segment)));
  }
  return out;
}

}  // namespace viwo::elf

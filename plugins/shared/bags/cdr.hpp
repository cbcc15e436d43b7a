// fastcdr 1 (Debian 12) and 2 (Debian 13) by the same names.
#pragma once

#include <cstddef>

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastcdr/config.h>
#include <fastcdr/exceptions/Exception.h>
#include <fastcdr/exceptions/NotEnoughMemoryException.h>

namespace viwo::bag {

#if FASTCDR_VERSION_MAJOR < 2
inline constexpr auto kDdsCdr = eprosima::fastcdr::Cdr::DDS_CDR;
inline const char* position(eprosima::fastcdr::Cdr& cdr) { return cdr.getCurrentPosition(); }
inline const char* buffer_begin(eprosima::fastcdr::Cdr& cdr) { return cdr.getBufferPointer(); }
inline std::size_t written(const eprosima::fastcdr::Cdr& cdr) {
  return cdr.getSerializedDataLength();
}
#else
inline constexpr auto kDdsCdr = eprosima::fastcdr::CdrVersion::DDS_CDR;
inline const char* position(eprosima::fastcdr::Cdr& cdr) { return cdr.get_current_position(); }
inline const char* buffer_begin(eprosima::fastcdr::Cdr& cdr) { return cdr.get_buffer_pointer(); }
inline std::size_t written(const eprosima::fastcdr::Cdr& cdr) {
  return cdr.get_serialized_data_length();
}
#endif

}  // namespace viwo::bag

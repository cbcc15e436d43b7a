// The digest in the build record of a plugin's file: that its bytes are those that were linked.
#pragma once

#include <string>
#include <string_view>

namespace viwo {

/// Of the bytes of a shared library (read_library): eight hexadecimal digits, the CRC-32 of
/// all that the loader takes from it: header, table of segments, segments. Left out is what
/// stripping and installing change: where the sections are, the path that libraries are searched
/// in, and the digest itself.
std::string plugin_digest(std::string bytes);

/// The digest in a build record: "--------" where none was written; empty where there is no such
/// field.
std::string_view digest_in(std::string_view record);

/// The same library with its digest in its build records.
std::string sealed(std::string bytes);

}  // namespace viwo

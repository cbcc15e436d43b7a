// The memory of a loaded library, made independent of its file.
#pragma once

#include <filesystem>

namespace viwo {

/// Copies all that is mapped of the library that `inside` lies in, loaded from `file`, to memory of
/// its own, at the same addresses: whoever overwrites or truncates the file changes nothing in this
/// process, which would end with a SIGBUS otherwise. To be called before anything else runs in the
/// library. std::system_error when there is no memory, or the system forbids it.
void keep_pages_of(const void* inside, const std::filesystem::path& file);

}  // namespace viwo

// Parts of the program that are libraries of their own, because of what they bring with them.
#pragma once

#include <string>

namespace viwo {

/// The function `entry` of viwo/`library` beside libviwo_api.so, where it is built as where it is
/// installed. It stays loaded until the process ends. std::runtime_error when it cannot be had:
/// "`loss`: what the loader says (`remedy`)".
void* load_part(const std::string& library, const char* entry, const std::string& loss,
                const std::string& remedy);

}  // namespace viwo

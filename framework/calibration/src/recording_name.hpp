// How messages call a recording, and where it is.
#pragma once

#include <string>

#include "viwo/setup/configuration.hpp"

namespace viwo::calibration {

/// Where there is only one, it may have no name.
inline std::string name_of(const Recording& recording) {
  return recording.name.empty() ? "the recording" : "recording '" + recording.name + "'";
}

/// InputError at the place of the recording; `what` goes on behind its name.
[[noreturn]] inline void fail(const Recording& recording, const std::string& what) {
  config::fail(recording.mark, name_of(recording) + what);
}

}  // namespace viwo::calibration

// How messages call a recording.
#pragma once

#include <string>

#include "viwo/setup/configuration.hpp"

namespace viwo::calibration {

/// Where there is only one, it may have no name.
inline std::string name_of(const Recording& recording) {
  return recording.name.empty() ? "the recording" : "recording '" + recording.name + "'";
}

}  // namespace viwo::calibration

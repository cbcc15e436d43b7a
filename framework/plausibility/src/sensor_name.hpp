// How a sensor is called.
#pragma once

#include <string>

namespace viwo {

struct SensorName {
  std::string text;    ///< by texts: with its kind, if it gives several
  std::string sensor;  ///< by the configuration

  /// The dotted path of one of its parameters.
  std::string key(const char* parameter) const { return "sensors." + sensor + "." + parameter; }
};

}  // namespace viwo

// Units as suffixes of configuration keys: "sigma_drive_rad_per_s" is a sigma_drive in rad/s.
#pragma once

#include <string>
#include <string_view>

namespace viwo::config {

/// A key without its unit suffix, and that suffix ("" if it has none).
struct KeyUnit {
  std::string_view base;
  std::string_view suffix;  ///< without the leading underscore
};
KeyUnit split_unit(std::string_view key);

/// "rad_per_s" as "rad/s".
std::string unit_text(std::string_view suffix);

}  // namespace viwo::config

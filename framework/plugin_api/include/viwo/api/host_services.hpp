// What the host offers to a plugin. The only way back into the host.
#pragma once

#include <cstdint>
#include <string_view>

namespace viwo {

enum class LogLevel : std::uint8_t { kInfo, kWarning };

/// Valid as long as the plugin object lives. Seeds differ per plugin instance and are reproducible.
struct HostServices {
  void* host = nullptr;
  void (*log_text)(void* host, LogLevel level, const char* text, std::uint64_t size) = nullptr;
  /// For this instance's random numbers. Sensors of a run have neighbouring seeds: seed + i for the
  /// i-th of several streams is the seed of another sensor.
  std::uint64_t seed = 0;
  /// For analyses along a motion that is known (viwo observability). A sensor that simulates leaves
  /// out all noise and draws no errors; an update linearises once, at the estimate, and adds no
  /// noise for what its linearisation leaves out.
  bool exact = false;

  void log(LogLevel level, std::string_view text) const {
    if (log_text != nullptr) log_text(host, level, text.data(), text.size());
  }
};

}  // namespace viwo

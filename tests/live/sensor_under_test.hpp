// A sensor of a running system as the host loads it, with what it says.
#pragma once

#include <algorithm>
#include <mutex>
#include <string>
#include <vector>

#include "viwo/config/yaml.hpp"
#include "viwo/plugin_host/registry.hpp"

namespace viwo::testing {

/// What the sensors have said to the host, from any thread.
class Said {
 public:
  void add(std::string_view text) {
    const std::scoped_lock lock(mutex_);
    texts_.emplace_back(text);
  }
  bool has(const std::string& text) const {
    const std::scoped_lock lock(mutex_);
    return std::find(texts_.begin(), texts_.end(), text) != texts_.end();
  }
  std::string all() const {
    const std::scoped_lock lock(mutex_);
    std::string joined;
    for (const std::string& text : texts_) joined += text + "\n";
    return joined;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> texts_;
};

inline Said& said() {
  static Said the_said;
  return the_said;
}

/// `rest`: further parameters, ", key: value". Throws InputError with what the host would print.
inline std::shared_ptr<Sensor> make_sensor(const std::string& type, const std::string& rest) {
  static PluginRegistry registry(
      {VIWO_TEST_PLUGIN_DIR},
      [](const PluginInfo&, LogLevel, std::string_view text) { said().add(text); });
  config::Errors errors;
  const auto loaded = registry.make_sensor(
      config::parse("{type: " + type + rest + "}", "test.yaml"), "sensor", 1, errors);
  errors.throw_if_any();
  return loaded.object;
}

inline std::shared_ptr<Sensor> make_ros1_topics(const std::string& rest) {
  return make_sensor("ros1_topics", rest);
}

}  // namespace viwo::testing

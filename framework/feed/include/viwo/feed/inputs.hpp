// Sensors as inputs of others.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "viwo/feed/run_data.hpp"

namespace viwo {

/// Keeps what the inputs of other sensors gave, and plays it to those. Images among it have not
/// been read yet: that is little.
class Inputs {
 public:
  explicit Inputs(const std::vector<SensorEntry>& sensors);
  /// Whether another sensor reads what this one gives.
  bool is_input(const SensorEntry& entry) const { return kept_.contains(entry.name); }
  /// Keeps a measurement of a sensor that is an input; of others, does nothing.
  void keep(const SensorEntry& entry, const Measurement& measurement);
  /// What an input gave, which has been read to its end, once more.
  std::shared_ptr<Sensor> replay(const std::string& input) const;
  /// Gives a sensor its input, which must have been read to its end; null if it takes none. It must
  /// live as long as the sensor is read.
  [[nodiscard]] std::shared_ptr<Sensor> connect(const SensorEntry& entry);

 private:
  std::map<std::string, std::shared_ptr<std::vector<Measurement>>> kept_;
};

bool is_live(const SensorEntry& entry);

/// InputError for a sensor that never ends.
void require_no_live_sensor(const RunSetup& setup, const SensorEntry& entry);

}  // namespace viwo

// Sensor: yields measurements in time order.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "viwo/api/export.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/api/status.hpp"

namespace viwo {

/// One kind of datum that a sensor dropped, and how often: never silently.
struct RejectionCount {
  std::string reason;      ///< "stamp not after the previous one", ...
  std::int64_t count = 0;  ///< how often
  std::string first;       ///< where it happened first, e.g. "odom_1.csv.gz:17"
};

/// A source of measurements: a log, a simulator, a device. Calls are serialised by the host.
class VIWO_API Sensor {
 public:
  virtual ~Sensor();

  /// The next measurement in time order; kEnd when there is none. Throws InputError when the source
  /// is broken beyond single data (not a number where one must be, missing column, truncated file).
  virtual Status next(Measurement& out) = 0;

  /// What was dropped so far; appended to `out`.
  virtual void rejections(std::vector<RejectionCount>& out) const;
};

}  // namespace viwo

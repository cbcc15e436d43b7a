// The estimate of a run as a file that others show while and after it is written. What writes it
// (CDR, compression) is a library that is loaded when a file is opened.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "viwo/api/sensor.hpp"

namespace viwo::log {

/// A tracked point of an image.
struct SeenPoint {
  double u_px = 0.;
  double v_px = 0.;
  double age = 0.;  ///< 0: first seen in this image, 1: seen for long
};

/// What one camera saw in an epoch.
struct SeenImage {
  int camera = 0;
  std::int64_t t_ns = 0;  ///< in the clock of the camera
  std::vector<SeenPoint> points;
};

class EstimateLog {
 public:
  virtual ~EstimateLog() = default;
  /// The next epoch. std::runtime_error when it cannot be written.
  virtual void write(const EstimateSample& estimate, std::span<const SeenImage> images) = 0;
  /// Ends the file: the last state, why the run is not to be trusted ("" if it is), and what the
  /// run has warned of since the last epoch. std::runtime_error when not all of it could be
  /// written; what has been stays readable.
  virtual void close(const std::string& failure, const std::vector<std::string>& warnings) = 0;
};

/// The one name that the library exports, an EstimateLogMaker. Program and library are of one
/// build.
inline constexpr const char* kMcapLibraryEntry = "viwo_mcap_library";
using EstimateLogMaker = EstimateLog* (*)(const std::filesystem::path& file);

}  // namespace viwo::log

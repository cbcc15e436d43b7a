// Writing what the sensors of a run yield as a log folder.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <variant>

#include "viwo/experiment/run.hpp"

namespace viwo::experiment {

/// How many measurements of each kind were written; the index is that of the kind in Measurement.
struct SimulateResult {
  std::array<std::int64_t, std::variant_size_v<Measurement>> counts{};
};

/// Reads all sensors to their end and writes `folder` in the layout that the sensors asl_* read
/// back to the same bits. Throws InputError like collect().
SimulateResult write_log(RunSetup& setup, const std::filesystem::path& folder);

/// "2001 IMU samples, 200 images and 1001 encoder samples".
std::string describe(const SimulateResult& result);

}  // namespace viwo::experiment

// Writing what the sensors of a run yield as a log folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "viwo/run/run.hpp"

namespace viwo {

/// How many measurements of each kind were written, by SampleType::name.
struct SimulateResult {
  std::map<std::string, std::int64_t> counts;
  std::map<std::string, std::int64_t> left_out;  ///< kinds that no table is for
};

/// Reads all sensors to their end and writes `folder` in the layout that the sensors asl_* read
/// back to the same bits. Throws InputError like collect().
SimulateResult write_log(RunSetup& setup, const std::filesystem::path& folder);

/// "2001 IMU samples, 200 images and 1001 encoder samples".
std::string describe(const SimulateResult& result);

}  // namespace viwo

// Writing what the sensors of a run yield as a log folder.
#pragma once

#include <cstdint>
#include <filesystem>

#include "viwo/experiment/run.hpp"

namespace viwo::experiment {

struct SimulateResult {
  std::int64_t encoder_samples = 0;
  std::int64_t reference_poses = 0;
};

/// Reads all sensors to their end and writes `folder` in the layout that the sensors asl_encoders
/// and asl_pose read back to the same bits. Throws InputError like collect().
SimulateResult write_log(RunSetup& setup, const std::filesystem::path& folder);

}  // namespace viwo::experiment

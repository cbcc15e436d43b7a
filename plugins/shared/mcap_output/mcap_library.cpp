#include "mcap_output.hpp"

extern "C" __attribute__((visibility("default"))) viwo::log::EstimateLog* viwo_mcap_library(
    const std::filesystem::path& file) {
  return new viwo::live::McapOutput(file);
}

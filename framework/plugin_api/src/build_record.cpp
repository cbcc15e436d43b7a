#include "viwo/api/build_record.hpp"

namespace viwo {

std::string_view api_build_record() { return {kBuildRecord.text.data(), kBuildRecord.size}; }

}  // namespace viwo

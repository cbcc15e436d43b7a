// Has a build record, but its author forgot VIWO_REGISTER.
#include "viwo/api/build_record.hpp"

extern "C" VIWO_API const char* viwo_unregistered_record() {
  return viwo::kBuildRecord.text.data();
}

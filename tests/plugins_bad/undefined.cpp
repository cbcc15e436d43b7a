// Calls a function that no library has.
#include "viwo/api/build_record.hpp"

extern "C" int viwo_function_of_no_library();

extern "C" VIWO_API const char* viwo_call_it() {
  return viwo_function_of_no_library() == 0 ? nullptr : viwo::kBuildRecord.text.data();
}

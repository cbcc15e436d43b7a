// Changes the floating-point mode of the thread that loads it, like a library that is linked with
// -ffast-math (the start-up code of GCC before 13).
#include <cfenv>
#if defined(__SSE__)
#include <xmmintrin.h>
#endif

#include "viwo/api/build_record.hpp"

namespace {

__attribute__((constructor)) void set_mode() {
#if defined(__SSE__)
  _mm_setcsr(_mm_getcsr() | 0x8040u);  // flush to zero, denormals are zero
#else
  std::fesetround(FE_UPWARD);
#endif
}

}  // namespace

extern "C" VIWO_API const char* viwo_sets_mode_record() { return viwo::kBuildRecord.text.data(); }

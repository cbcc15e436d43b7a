// A text that is put together by <<.
#pragma once

#include <sstream>

namespace viwo {

/// A std::ostringstream that throws where that leaves off in silence (std::bad_alloc), so that no
/// text is short of its end.
class TextStream final : public std::ostringstream {
 public:
  TextStream() { exceptions(std::ios_base::badbit); }
};

}  // namespace viwo

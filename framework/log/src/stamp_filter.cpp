#include "viwo/log/stamp_filter.hpp"

#include "viwo/api/status.hpp"

namespace viwo::log {

void StampFilter::finish(const TextReader& at) {
  if (at.last_left_out()) reject(kLastLineCutShort, at);
  const std::string file = at.file().string();
  if (order_.empty()) throw InputError(file + "  holds no data after its header");
  order_.require_enough(file, "data");
}

}  // namespace viwo::log

#include "viwo/feed/stage_time.hpp"

#include <cstddef>
#include <numeric>

namespace viwo {

StageTime stage_time(std::vector<double> ms) {
  StageTime stage;
  if (ms.empty()) return stage;
  stage.mean_ms = std::accumulate(ms.begin(), ms.end(), 0.) / static_cast<double>(ms.size());
  std::sort(ms.begin(), ms.end());
  const auto percentile = [&ms](std::size_t percent) {
    return ms[(ms.size() - 1) * percent / 100];
  };
  stage.p95_ms = percentile(95);
  stage.p99_ms = percentile(99);
  stage.max_ms = ms.back();
  return stage;
}

}  // namespace viwo

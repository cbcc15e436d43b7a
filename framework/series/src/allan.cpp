#include "viwo/series/allan.hpp"

#include <cmath>
#include <cstddef>

namespace viwo::series {

std::vector<AllanPoint> allan_deviation(const std::vector<double>& values, double step_s) {
  std::vector<double> sums = {0.};
  sums.reserve(values.size() + 1);
  for (const double value : values) sums.push_back(sums.back() + value);
  std::vector<AllanPoint> points;
  for (std::size_t m = 1; 4 * m <= values.size(); m *= 2) {
    double squares = 0.;
    const std::size_t n = values.size() - 2 * m + 1;
    for (std::size_t i = 0; i < n; ++i) {
      const double difference =
          (sums[i + 2 * m] - 2. * sums[i + m] + sums[i]) / static_cast<double>(m);
      squares += difference * difference;
    }
    points.push_back({static_cast<double>(m) * step_s,
                      std::sqrt(0.5 * squares / static_cast<double>(n)),
                      static_cast<double>(values.size()) / static_cast<double>(m)});
  }
  return points;
}

}  // namespace viwo::series

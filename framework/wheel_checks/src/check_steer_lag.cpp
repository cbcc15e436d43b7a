#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "viwo/math/significant.hpp"
#include "viwo/series/rate_grid.hpp"
#include "viwo/series/wheel_calibration.hpp"
#include "viwo/wheel_checks/wheel_checks.hpp"

namespace viwo::inspect {

using series::Recording;
using series::Wheels;

namespace {

constexpr double kLongest_s = 0.2, kStep_s = 0.01;
constexpr std::size_t kMostSamples = 20'000;  ///< that are looked at, of a long recording

/// Into `shifted`: every `stride`-th sample with the angles of `later` samples after it. By whole
/// samples, for an angle between two has less noise.
void take_angles_of(const Wheels& wheels, int later, std::size_t stride, Wheels& shifted) {
  shifted.samples.clear();
  const auto margin = static_cast<std::size_t>(std::abs(later));
  for (std::size_t i = margin; i + margin < wheels.samples.size(); i += stride) {
    const std::size_t of = later < 0 ? i - margin : i + margin;
    shifted.samples.push_back(wheels.samples[i]);
    shifted.samples.back().steer_rad = wheels.samples[of].steer_rad;
  }
}

/// Where the wheels contradict each other clearly less with the angles of earlier or later.
void check_steer_lag(const Wheels& wheels, const std::string& label, Findings& out) {
  constexpr double kPart = 0.7;  // of the squared residual, what is left of it at most
  if (wheels.model->description().n_steer == 0 || wheels.model->n_rows() <= 3) return;
  const double period_s = period_of(twists_of(wheels));
  if (!(period_s > 0.) || wheels.samples.size() < 1000) return;
  const auto calibration = calibrated(wheels);
  if (!calibration) return;
  const int step = std::max(1, static_cast<int>(std::lround(kStep_s / period_s)));
  const double step_s = step * period_s;
  const int most = static_cast<int>(kLongest_s / step_s);
  if (most < 2) return;
  const std::size_t stride = 1 + wheels.samples.size() / kMostSamples;
  std::vector<double> squares;
  Wheels shifted = wheels;
  for (int later = -most; later <= most; ++later) {
    take_angles_of(wheels, later * step, stride, shifted);
    squares.push_back(std::pow(parity_of(shifted, calibration->x_WI).rms, 2));
  }
  const auto least = std::ranges::min_element(squares);
  const auto at = static_cast<int>(least - squares.begin());
  const double as_it_is = squares[static_cast<std::size_t>(most)];
  if (!std::isfinite(as_it_is) || at == 0 || at == 2 * most || !(*least < kPart * as_it_is)) return;
  const double bend = least[-1] - 2. * least[0] + least[1];
  const double lag_s = step_s * (at - most + 0.5 * (least[-1] - least[1]) / bend);
  if (!(std::abs(lag_s) >= 1.5 * step_s)) return;
  out.push_back({label,
                 Severity::kFault,
                 "steer lag",
                 std::string("the angles of the steering are ") +
                     (lag_s > 0. ? "behind" : "ahead of") + " the drives by " +
                     significant(1e3 * std::abs(lag_s), 3) +
                     " ms: so the wheels contradict each other by " +
                     significant(1e3 * std::sqrt(*least), 2) + " mm/s and not by " +
                     significant(1e3 * std::sqrt(as_it_is), 2) +
                     " - one of the two is read late, or filtered; stamps of both must be of when "
                     "they were measured",
                 {{"lag", lag_s, "s"},
                  {"residual", std::sqrt(*least), "m/s"},
                  {"residual as it is", std::sqrt(as_it_is), "m/s"}}});
}

}  // namespace

void check_steer_lag(const Recording& recording, Findings& out) {
  for (const Wheels& wheels : recording.wheels) {
    const std::string label = recording.label<EncoderSample>(wheels.sensor);
    if (!wheels.unusable.empty() || is_fault(out, label, "order")) continue;
    check_steer_lag(wheels, label, out);
  }
}

}  // namespace viwo::inspect

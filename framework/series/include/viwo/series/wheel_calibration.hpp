// What wheels say by themselves: their intrinsics as their contradictions alone have them, and when
// they move.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "viwo/plausibility/parity_watch.hpp"
#include "viwo/series/recording.hpp"

namespace viwo::series {

/// The intrinsic that explains most of the contradictions by itself, and where it does.
struct Explained {
  std::size_t intrinsic = 0;
  double value = 0., part = 0.;
};

struct Calibration {
  Intrinsics x_WI;
  IntrinsicMatrix P;
  Explained alone;
};

/// Where the wheels contradict each other least, within what the prior allows: its Gauss-Newton
/// steps (W-10). What the wheels still contradict is noise, or lies.
std::optional<Calibration> calibrated(const Wheels& wheels);

/// By how much the rows of the wheels contradict each other with these intrinsics.
Parity parity_of(const Wheels& wheels, const Intrinsics& x_WI);

/// Whether any of the wheels turns: a base at rest contradicts nothing.
bool moves(const EncoderSample& sample);
/// Those that move, evenly over the recording, not many more than `most`.
std::vector<EncoderSample> moving_samples(const Wheels& wheels, std::size_t most);

}  // namespace viwo::series

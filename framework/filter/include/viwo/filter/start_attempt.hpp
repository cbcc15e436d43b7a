// What a way to start without a given state has found.
#pragma once

#include <optional>
#include <string_view>

#include "viwo/filter/filter.hpp"

namespace viwo {

/// A state to start from, or what is in the way of one so far.
struct StartAttempt {
  std::optional<ImuPrior> prior;
  std::string_view obstacle;  ///< a text that outlives everything, completes "none: ..."
};

inline StartAttempt no_start(std::string_view obstacle) { return {std::nullopt, obstacle}; }

}  // namespace viwo

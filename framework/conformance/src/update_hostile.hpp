// Measurements as broken logs have them.
#pragma once

#include "update_watch.hpp"

namespace viwo::conformance {

/// Another mistake in every epoch, the same sequence each time.
Spoil make_spoil();

}  // namespace viwo::conformance

// What an exception says, for tests of messages.
#pragma once

#include <string>

#include "viwo/api/status.hpp"

namespace viwo::testing {

/// The text of the exception that `f` throws; empty when it throws none. Others pass.
template <class Exception = InputError, class F>
std::string error_of(F&& f) {
  try {
    f();
  } catch (const Exception& error) {
    return error.what();
  }
  return {};
}

}  // namespace viwo::testing

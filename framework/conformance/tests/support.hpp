// Checks of a plugin of this build, and their answers as text.
#pragma once

#include <string>

#include <gtest/gtest.h>

#include "viwo/conformance/conformance.hpp"

namespace viwo::conformance {

inline std::filesystem::path broken(const std::string& kind, const std::string& defect) {
  return std::filesystem::path(VIWO_TEST_BINARY_DIR) / "tests/conformance" /
         ("libviwo_" + kind + "_broken_" + defect + ".so");
}

/// The checks that fail, "CHECK: what it says" each; of more than one failure the first.
inline std::string failures_of(const std::string& kind, const std::string& defect,
                               const Options& options = {}) {
  std::string text;
  for (const CheckResult& check : check_plugin(broken(kind, defect), options).checks) {
    if (check.passed()) continue;
    text += (text.empty() ? "" : "\n") + check.name + ": " + check.failures.front();
  }
  return text;
}

}  // namespace viwo::conformance

// The sections of a run configuration that are the host's own.
#include <gtest/gtest.h>

#include "viwo/config/params.hpp"
#include "viwo/setup/schema.hpp"

namespace viwo {
namespace {

TEST(HostSections, HaveDefaultsThatTheyWouldAccept) {
  EXPECT_EQ(host_sections().size(), 7u);
  for (const HostSection& section : host_sections()) {
    EXPECT_NO_THROW(config::check_specs(section.params)) << section.name;
  }
}

}  // namespace
}  // namespace viwo

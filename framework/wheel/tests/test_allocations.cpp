// The steady state of preintegration does not touch the heap.
#include <gtest/gtest.h>

#include "allocations.hpp"
#include "viwo/wheel/preintegration.hpp"
#include "wheel_fixture.hpp"

namespace viwo {
namespace {

TEST(Preintegration, DoesNotAllocateAfterConstruction) {
  if (!testing::counts_allocations()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  const auto model = testing::load_model(testing::swerve("four_wis_wid"));
  const auto samples = testing::sample_motion(
      *model, [](double t) { return Twist(0.4, 0.1, std::sin(t)); }, 5., 100.);
  for (const bool weighted : {false, true}) {
    Preintegrator preintegrator(
        model, {.twist = {.noise_weighted = weighted}, .parity_gate_probability = 1e-3});
    PreintegratedPose pose;
    preintegrator.integrate(samples, 0, 1'000'000'000, pose);
    const long before = testing::allocations();
    for (std::int64_t i = 1; i < 20; ++i) {
      preintegrator.integrate(samples, i * 200'000'000 + 3'000'000, (i + 1) * 200'000'000, pose);
    }
    EXPECT_EQ(testing::allocations() - before, 0);
    EXPECT_GT(pose.samples, 0);
  }
}

}  // namespace
}  // namespace viwo

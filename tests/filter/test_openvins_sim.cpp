// Vision and inertia alone on the measurements that OpenVINS exported with its own accuracy.
#include <cmath>

#include <gtest/gtest.h>

#include "filter_runs.hpp"

namespace viwo {
namespace {

/// To the three digits that OpenVINS's figures are given with.
double rounded(double value) { return std::round(1e3 * value) / 1e3; }

void expect_at_most(const std::string& rig, double deg, double m) {
  const auto data = std::filesystem::path(VIWO_TEST_SHARED_DIR) / "data/openvins_sim";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "the export is not here";
  auto setup = testing::run_setup("runs/openvins_sim.yaml",
                                  {"placeholders.data=" + std::filesystem::canonical(data).string(),
                                   "placeholders.rig=" + rig});
  const auto measurements = collect(setup);
  const auto result = run(setup, measurements);
  ASSERT_EQ(result.status, RunStatus::kOk) << result.cause;
  ASSERT_TRUE(result.accuracy);
  EXPECT_GT(result.accuracy->n_poses, 1000);
  EXPECT_LE(rounded(result.accuracy->ate_deg), deg);
  EXPECT_LE(rounded(result.accuracy->ate_m), m);
}

TEST(OpenVinsExport, MonoIsAtLeastAsAccurate) { expect_at_most("mono", 0.594, 0.144); }

TEST(OpenVinsExport, StereoIsAtLeastAsAccurate) { expect_at_most("stereo", 0.130, 0.033); }

}  // namespace
}  // namespace viwo

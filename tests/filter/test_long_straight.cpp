// Ten minutes straight on over uneven ground, of a robot that is otherwise: what slight turns and
// tilts tell of the mount and of the clock is what the filter says that they do.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "filter_runs.hpp"
#include "viwo/eval/consistency.hpp"

namespace viwo {
namespace {

constexpr int kSeeds = 10;

/// Parameters of mount and clock whose error is not that of their sigma.
std::string faults(const std::vector<std::string>& more) {
  std::vector<std::string> all{"sensors.simulator0.true_intrinsics_scale=1",
                               "sensors.simulator0.true_sigma_p_IinO_m=[0.1, 0.1, 0.1]",
                               "sensors.simulator0.true_sigma_R_ItoO_rad=[0.01, 0.01, 0.01]",
                               "sensors.simulator0.true_sigma_t_OtoI_s=0.01",
                               "sensors.simulator0.duration_s=600",
                               "sensors.simulator0.motion=straight",
                               "sensors.simulator0.ground=uneven"};
  all.insert(all.end(), more.begin(), more.end());
  const auto runs = testing::variant_runs("paper_accuracy", "bad_init_calib_on", kSeeds, all);
  const auto bounds = eval::mean_nees_bounds(1, kSeeds, 0.99);
  std::string out;
  for (std::size_t i = 0; i < runs.front().calibration.size(); ++i) {
    const std::string& name = runs.front().calibration[i].name;
    if (name.rfind("p_IinO", 0) != 0 && name != "t_OtoI") continue;
    double nees = 0.;
    for (const RunResult& run : runs) {
      const CalibrationTrack& track = run.calibration[i];
      nees += std::pow(track.final_error / track.sigma.back(), 2) / kSeeds;
    }
    if (nees < bounds.low || nees > bounds.high) {
      out += name + " has a NEES of " + std::to_string(nees) + "\n";
    }
  }
  return out;
}

TEST(LongStraight, LeavesMountAndClockConsistent) {
  EXPECT_EQ(faults({}), "");
  EXPECT_NE(faults({"updates.wheel_odometry.motion_sigmas=0"}), "");
}

}  // namespace
}  // namespace viwo

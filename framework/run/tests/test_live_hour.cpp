// A live run of an hour, as fast as it goes: what it needs does not grow.
#include <fstream>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>
#include <unistd.h>

#include "live_device.hpp"
#include "viwo/files/files.hpp"
#include "viwo/results/run_stream.hpp"

namespace viwo {
namespace {

double resident_mb() {
  std::ifstream in("/proc/self/statm");
  double total = 0., resident = 0.;
  in >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1024. * 1024.);
}

/// Slope of a straight line through points, per unit of x.
double slope_of(const std::vector<double>& x, const std::vector<double>& y) {
  Eigen::MatrixX2d A(static_cast<Eigen::Index>(x.size()), 2);
  A.col(0).setOnes();
  A.col(1) = Eigen::VectorXd::Map(x.data(), A.rows());
  return A.colPivHouseholderQr().solve(Eigen::VectorXd::Map(y.data(), A.rows()).eval())[1];
}

/// Does not keep what it is told.
class Forgetful final : public testing::Device {
 public:
  using Device::Device;
  void estimate(const EstimateSample& /*estimate*/) override {}
};

TEST(LiveRun, OfAnHourAtFullRatesNeedsConstantMemory) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / "viwo_live_hour";
  files::make_folder(folder);
  RunSetup setup = testing::standing_then_driving(3600.);
  std::vector<Measurement> measurements;
  {
    const RunData recorded = collect(setup);
    measurements = testing::in_time_order(recorded.recorded);
  }
  setup.routes = testing::routes_of_device(setup);
  RunData data;
  data.live.push_back(
      testing::stream("device", std::make_shared<Forgetful>(std::move(measurements), false)));
  RunStream files(folder);
  std::vector<double> t_h, resident;
  RunHooks hooks;
  hooks.on_epoch = [&](const RunResult& result) {
    files.epoch(result);
    // From when the series for the page are full.
    if (result.epochs % 100 != 0 || result.epochs < 9000) return;
    t_h.push_back(result.epoch_t_s.back() / 3600.);
    resident.push_back(resident_mb());
  };
  const double before_mb = resident_mb();
  const RunResult result = run_filter(setup, data, hooks);
  ASSERT_EQ(result.status, RunStatus::kOk) << result.cause;
  EXPECT_GT(result.epochs, 30'000);
  EXPECT_LE(result.estimate.size(), 2U * 4096U + 1U);
  EXPECT_EQ(result.estimate.size(), result.calibration.front().sigma.size());
  EXPECT_EQ(files.finish(), "");
  ASSERT_GT(t_h.size(), 100U);
  const double grows = slope_of(t_h, resident);
  std::cout << result.epochs << " epochs, " << result.duration_s / result.wall_s
            << " x real time; resident " << before_mb << " MB before, " << resident.front()
            << " MB at " << t_h.front() << " h, " << resident.back() << " MB at " << t_h.back()
            << " h; line through it: " << grows << " MB/h\n";
  // Ten numbers that are kept of each epoch would be three.
  EXPECT_LT(grows, 1.);
}

}  // namespace
}  // namespace viwo

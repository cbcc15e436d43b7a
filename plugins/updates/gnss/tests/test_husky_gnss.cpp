// The delivered configuration on a real recording: fixes that the filter does not get, against
// where it has the antenna in E.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "gnss_runs.hpp"
#include "local_frame.hpp"
#include "registry.hpp"
#include "viwo/run/run.hpp"
#include "viwo/setup/configuration.hpp"

namespace viwo {
namespace {

/// Errors of the fixes nearest to epochs, from a minute after the alignment on.
class FixJudge final : public EstimatorObserver {
 public:
  FixJudge(std::vector<GnssSample> fixes, const testing::Frames& frames)
      : fixes_(std::move(fixes)), frames_(frames) {}

  void on_epoch(const Filter& filter, const EpochData& /*data*/) override {
    if (!frames_.is_known) return;
    if (aligned_ns_ == 0) aligned_ns_ = filter.t_ns();
    if (seconds_between(aligned_ns_, filter.t_ns()) < 60.) return;
    const auto fix = std::find_if(fixes_.begin(), fixes_.end(), [&](const GnssSample& f) {
      return std::abs(seconds_between(filter.t_ns(), f.t_ns)) <= 0.1;
    });
    if (fix == fixes_.end()) return;
    gnss::LocalFrame frame(frames_.origin[0], frames_.origin[1], frames_.origin[2]);
    const auto antenna = testing::antenna_in_E(filter, seconds_between(filter.t_ns(), fix->t_ns));
    const Eigen::Vector2d error = (frame.at(*fix, {}).p_AinE - antenna.p).head<2>();
    squares.push_back(error.squaredNorm());
    variances.push_back(antenna.P.topLeftCorner<2, 2>().trace());
    fixes_.erase(fix);
  }

  std::vector<double> squares, variances;  ///< horizontal, m^2

 private:
  std::vector<GnssSample> fixes_;
  const testing::Frames& frames_;
  std::int64_t aligned_ns_ = 0;
};

struct HuskyRun {
  RunResult result;
  double rms_m = 0., sigma_m = 0.;  ///< of fixes that were left out: their error, what is claimed
};

double root_mean(const std::vector<double>& squares) {
  double sum = 0.;
  for (const double square : squares) sum += square;
  return std::sqrt(sum / static_cast<double>(squares.size()));
}

RunSetup read_husky(PluginRegistry& registry, const std::filesystem::path& data,
                    std::vector<std::string> assignments) {
  assignments.push_back("placeholders.data=" + std::filesystem::canonical(data).string());
  return read_run(
      resolve_placeholders(load_run_configuration(
          std::string(VIWO_TEST_SOURCE_DIR) + "/configs/runs/husky_gnss.yaml", assignments)),
      registry, 1);
}

HuskyRun run_husky(const std::filesystem::path& data, std::vector<std::string> assignments) {
  testing::Frames frames;
  PluginRegistry registry(
      {VIWO_TEST_PLUGIN_DIR},
      [&](const PluginInfo&, LogLevel, std::string_view text) { frames.read(std::string(text)); });
  auto all = read_husky(registry, data, assignments);
  const auto recorded = collect(all).recorded;
  const auto fixes = recorded.of<GnssSample>();
  std::vector<GnssSample> left_out;
  for (std::size_t i = 1; i < fixes.size(); i += 2) left_out.push_back(fixes[i]);
  assignments.push_back("sensors.bag0.gnss_stride=2");
  auto setup = read_husky(registry, data, assignments);
  const auto measurements = collect(setup);
  FixJudge judge(left_out, frames);
  RunHooks hooks;
  hooks.on_start = [&](const Estimator&) { return &judge; };
  HuskyRun run;
  run.result = viwo::run(setup, measurements, hooks);
  run.rms_m = root_mean(judge.squares);
  run.sigma_m = root_mean(judge.variances);
  EXPECT_GT(judge.squares.size(), 300u);
  // What docs/gnss.md has: --gtest_output=json
  ::testing::Test::RecordProperty("rms_m", std::to_string(run.rms_m));
  ::testing::Test::RecordProperty("claimed_m", std::to_string(run.sigma_m));
  return run;
}

const UpdateCounts& counts_of(const RunResult& result) {
  return std::find_if(result.updates.begin(), result.updates.end(),
                      [](const auto& update) { return update.name == "gnss"; })
      ->total;
}

TEST(HuskyRecording, HasTheFixesThatAreLeftOutWhereItClaimsThem) {
  const auto data = std::filesystem::path(VIWO_TEST_SHARED_DIR) / "data/real";
  if (!std::filesystem::exists(data / "husky_bag")) GTEST_SKIP() << "the recording is not here";
  const HuskyRun run = run_husky(data, {});
  ASSERT_EQ(run.result.status, RunStatus::kOk) << run.result.cause;
  const UpdateCounts& counts = counts_of(run.result);
  EXPECT_GT(counts.applied, 900);
  EXPECT_LT(counts.rejected, counts.applied / 100);
  // The drift of the receiver, 2 m per axis, and its noise are in these errors, besides the
  // filter's.
  EXPECT_LT(run.rms_m, std::hypot(run.sigma_m, std::sqrt(2.) * 2.));
  EXPECT_LT(run.sigma_m, 3.);
}

/// The twist alone, as it was recorded.
TEST(HuskyRecording, DrivesAsFarAsItsOdometryDid) {
  const auto data = std::filesystem::path(VIWO_TEST_SHARED_DIR) / "data/real";
  if (!std::filesystem::exists(data / "husky_bag")) GTEST_SKIP() << "the recording is not here";
  auto setup = read_husky(testing::registry(), data, {"estimator.type=dead_reckoning"});
  const RunResult result = viwo::run(setup, collect(setup), {});
  ASSERT_EQ(result.status, RunStatus::kOk) << result.cause;
  EXPECT_NEAR(result.total.path_length_m, 359., 0.5)
      << "which the recording's description has in whole metres";
}

TEST(HuskyRecording, ShowsThatItsMessagesDoNotSayWhatTheirFixesAre) {
  const auto data = std::filesystem::path(VIWO_TEST_SHARED_DIR) / "data/real";
  if (!std::filesystem::exists(data / "husky_bag")) GTEST_SKIP() << "the recording is not here";
  const HuskyRun run =
      run_husky(data, {"updates.gnss.sigma_scale=1", "updates.gnss.sigma_drift_m=0",
                       "updates.gnss.sigma_height_drift_m=0"});
  const UpdateCounts& counts = counts_of(run.result);
  EXPECT_GT(counts.rejected, counts.applied / 2);
  EXPECT_FALSE(run.result.warnings.empty()) << "many fixes are rejected, and nobody is told";
}

}  // namespace
}  // namespace viwo

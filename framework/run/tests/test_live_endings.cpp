// Live runs that something is wrong with: stamps of another time, sensors that do not end, more
// than can be worked on, a filter that diverges; and what is on disk then.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "live_device.hpp"
#include "viwo/feed/bounded_series.hpp"
#include "viwo/files/files.hpp"
#include "viwo/log/tum.hpp"
#include "viwo/results/run_output.hpp"
#include "viwo/results/run_record.hpp"
#include "viwo/results/run_stream.hpp"
#include "viwo/run/thin.hpp"

namespace viwo {
namespace {

using testing::Device;
using testing::in_time_order;
using testing::routes_of_device;
using testing::standing_then_driving;
using testing::stream;
using Clock = std::chrono::steady_clock;

constexpr std::int64_t kSecond = 1'000'000'000;

/// What a robot gives, and a run that takes it.
struct Robot {
  explicit Robot(double duration = 4., std::string with = "start: moving")
      : duration_s(duration),
        estimator(std::move(with)),
        setup(standing_then_driving(duration_s, estimator)),
        recorded(collect(setup)),
        measurements(in_time_order(recorded.recorded)) {}
  /// Its updates have not learned anything yet.
  RunSetup live_setup() const {
    RunSetup fresh = standing_then_driving(duration_s, estimator);
    fresh.routes = routes_of_device(fresh);
    return fresh;
  }
  RunResult live(const std::shared_ptr<Sensor>& device, const RunHooks& hooks = {}) const {
    RunData data;
    data.live.push_back(stream("device", device));
    return run_filter(live_setup(), data, hooks);
  }
  RunResult live(std::vector<Measurement> all, const RunHooks& hooks = {}) const {
    return live(std::make_shared<Device>(std::move(all), false), hooks);
  }

  double duration_s;
  std::string estimator;
  RunSetup setup;
  RunData recorded;
  std::vector<Measurement> measurements;
};

template <Sample T>
T moved(T sample, std::int64_t by_ns) {
  sample.t_ns += by_ns;
  if constexpr (requires { sample.begin_ns; }) {
    sample.begin_ns += by_ns;
    sample.end_ns += by_ns;
  }
  return sample;
}

Measurement moved(const Measurement& measurement, std::int64_t by_ns) {
  if (const auto* imu = measurement.get_if<ImuSample>()) return moved(*imu, by_ns);
  if (const auto* wheels = measurement.get_if<EncoderSample>()) return moved(*wheels, by_ns);
  return moved(*measurement.get_if<FeatureSample>(), by_ns);
}

TEST(LiveRun, IsNotDisturbedByOneImuStampInTheFuture) {
  const Robot robot;
  const RunResult expected = robot.live(robot.measurements);
  ASSERT_EQ(expected.status, RunStatus::kOk) << expected.cause;
  for (const std::int64_t ahead_s : {2, 9, 3600}) {
    auto all = robot.measurements;
    const auto imu = std::find_if(all.begin() + 600, all.end(), [](const Measurement& m) {
      return m.get_if<ImuSample>() != nullptr;
    });
    all.insert(imu, moved(*imu, ahead_s * kSecond));
    const RunResult live = robot.live(all);
    EXPECT_EQ(live.status, RunStatus::kOk) << live.cause;
    EXPECT_EQ(live.epochs, expected.epochs) << ahead_s;
    EXPECT_EQ(live.estimate.back().t_ns, expected.estimate.back().t_ns);
    EXPECT_EQ(live.estimate.back().p_BinW, expected.estimate.back().p_BinW);
  }
}

TEST(LiveRun, StartsAnewWhenTheClocksWereSetBack) {
  const Robot robot(12.);
  auto all = robot.measurements;
  const std::int64_t begin_ns = stamp_ns(all.front());
  for (Measurement& m : all) {
    if (stamp_ns(m) > begin_ns + 6 * kSecond) m = moved(m, -100 * kSecond);
  }
  std::vector<std::string> said;
  RunHooks hooks;
  hooks.on_warning = [&](double, const std::string& text) { said.push_back(text); };
  const auto device = std::make_shared<Device>(all, false);
  const RunResult live = robot.live(device, hooks);
  EXPECT_EQ(live.status, RunStatus::kDiverged);
  ASSERT_EQ(live.pieces.size(), 2U);
  EXPECT_EQ(device->estimates.front().piece, 0);
  EXPECT_EQ(device->estimates.back().piece, 1);
  EXPECT_EQ(live.pieces[0].failure.substr(0, 39), "the clock of the IMU was set back by 99");
  EXPECT_EQ(live.pieces[1].failure, "");
  EXPECT_GT(live.pieces[1].epochs, 40);
  EXPECT_EQ(live.pieces[0].epochs + live.pieces[1].epochs, live.epochs);
  EXPECT_EQ(live.cause,
            live.pieces[0].failure + " (" +
                std::to_string(seconds_between(live.pieces[0].begin_ns, live.pieces[0].end_ns)) +
                " s); started anew, in 2 pieces");
  ASSERT_FALSE(said.empty());
  EXPECT_EQ(said.front(), live.pieces[0].failure + "; starting anew");
  // The time of the run goes on, and counts are those of both pieces.
  EXPECT_TRUE(std::is_sorted(live.epoch_t_s.begin(), live.epoch_t_s.end()));
  EXPECT_GT(live.updates[0].total.applied, 0);
  int applied = 0;
  for (const int n : live.updates[0].applied) applied += n;
  EXPECT_EQ(applied, live.updates[0].total.applied);
}

TEST(LiveRun, DoesNotStartAnewWhenItIsNotToDoSo) {
  const Robot robot(8., "start: moving, restart: never");
  auto all = robot.measurements;
  const std::int64_t begin_ns = stamp_ns(all.front());
  for (Measurement& m : all) {
    if (stamp_ns(m) > begin_ns + 4 * kSecond) m = moved(m, -100 * kSecond);
  }
  const RunResult live = robot.live(all);
  EXPECT_EQ(live.status, RunStatus::kDiverged);
  EXPECT_EQ(live.pieces.size(), 1U);
}

/// A gyro that reads five times too much for eight seconds.
RunData with_broken_gyro(const RunData& good, double from_s, double to_s) {
  RunData data = good;
  std::vector<ImuSample> imu(good.imu().begin(), good.imu().end());
  const std::int64_t begin_ns = imu.front().t_ns;
  for (ImuSample& sample : imu) {
    const double t_s = seconds_between(begin_ns, sample.t_ns);
    if (t_s < from_s || t_s > to_s) continue;
    for (double& rate : sample.gyro_rad_per_s) rate = 5. * rate + 0.5;
  }
  data.recorded.set<ImuSample>("sim", imu);
  return data;
}

/// The newest element up to a time.
std::size_t up_to(const std::vector<double>& t_s, double end_s) {
  return static_cast<std::size_t>(std::upper_bound(t_s.begin(), t_s.end(), end_s) - t_s.begin()) -
         1;
}

TEST(RecordedRun, StartsAnewOnRequestWithTheCalibrationOfBefore) {
  const Robot robot(85., "start: moving, restart: always, calibration_error_scale: 1");
  const RunResult result = run_filter(robot.setup, with_broken_gyro(robot.recorded, 60., 65.));
  EXPECT_EQ(result.status, RunStatus::kDiverged);
  ASSERT_EQ(result.pieces.size(), 2U) << result.cause;
  const auto second = static_cast<std::size_t>(result.pieces[0].epochs);
  EXPECT_EQ(result.estimate[second].t_ns, result.pieces[1].begin_ns);
  // Contact is lost at 60 s, and said to be lost five seconds before that at most: the place is
  // that of 45 s to 50 s, to the accuracy of a start.
  double nearest_m = 1e9;
  for (std::size_t k = up_to(result.epoch_t_s, 43.); k < up_to(result.epoch_t_s, 51.); ++k) {
    nearest_m =
        std::min(nearest_m, (result.estimate[second].p_BinW - result.estimate[k].p_BinW).norm());
  }
  EXPECT_LT(nearest_m, 0.05);
  // The calibration is that of 25 s, and not what was declared; an update has moved it since.
  const std::size_t kept = up_to(result.epoch_t_s, 25.);
  for (const CalibrationTrack& track : result.calibration) {
    const double before = track.estimate[kept], now = track.estimate[second];
    if (track.name != "t_OtoI" && track.name != "p_IinO_x") continue;
    EXPECT_LT(std::abs(now - before), std::abs(now - track.estimate.front())) << track.name;
    EXPECT_GT(track.sigma[second], 2. * track.sigma[kept]) << track.name << " is uncertain again";
  }
  // And it is right again: how far it came in its last ten seconds.
  std::size_t last = result.estimate.size() - 1;
  while (result.estimate[last].t_ns > result.reference.back().t_ns) --last;
  const std::size_t begin = up_to(result.epoch_t_s, result.epoch_t_s[last] - 10.);
  ASSERT_GT(begin, second);
  const auto from = interpolate(result.reference, result.estimate[begin].t_ns, 0.2);
  const auto to = interpolate(result.reference, result.estimate[last].t_ns, 0.2);
  ASSERT_TRUE(from && to);
  const double way_m = (to->p_BinW - from->p_BinW).norm();
  EXPECT_GT(way_m, 2.);
  EXPECT_NEAR((result.estimate[last].p_BinW - result.estimate[begin].p_BinW).norm(), way_m,
              0.02 * way_m);
}

TEST(RecordedRun, EndsWhereItDivergesIfNothingElseIsAskedFor) {
  const Robot robot(65.);
  const RunResult result = run_filter(robot.setup, with_broken_gyro(robot.recorded, 40., 48.));
  EXPECT_EQ(result.status, RunStatus::kDiverged);
  EXPECT_EQ(result.pieces.size(), 1U);
}

TEST(LiveRun, IsNotFarBehindWhatHappensAndEndsSoonThoughItIs) {
  /// Says how much it has given.
  class CountingDevice final : public Device {
   public:
    using Device::Device;
    Status next(Measurement& out) override {
      ++given;
      return Device::next(out);
    }
    std::atomic<std::size_t> given = 0;
  };
  const Robot robot(12.);
  const auto device = std::make_shared<CountingDevice>(robot.measurements, true);
  ASSERT_GT(robot.measurements.size(), 3000U);
  RunHooks hooks;
  const auto begin = Clock::now();
  std::size_t most_behind = 0;
  hooks.on_epoch = [&](const RunResult& result) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    const auto done = std::partition_point(
        robot.measurements.begin(), robot.measurements.end(),
        [&](const Measurement& m) { return stamp_ns(m) <= result.estimate.back().t_ns; });
    most_behind =
        std::max(most_behind, device->given.load() -
                                  static_cast<std::size_t>(done - robot.measurements.begin()));
  };
  hooks.interrupted = [&] { return Clock::now() - begin > std::chrono::milliseconds(1000); };
  const RunResult live = robot.live(device, hooks);
  EXPECT_LT(most_behind, 1300U) << "a thousand wait, and what an epoch waits for";
  EXPECT_EQ(live.status, RunStatus::kOk) << live.cause;
  EXPECT_GT(live.epochs, 5);
  EXPECT_LT(Clock::now() - begin, std::chrono::milliseconds(3500)) << "a second for what waits";
}

TEST(LiveRun, EndsThoughItsSensorDoesNotAndKeepsTheResults) {
  /// Never comes back.
  class Hanging final : public Device {
   public:
    explicit Hanging(std::vector<Measurement> all) : Device(std::move(all), true) {}
    void stop() override {}
  };
  const Robot robot;
  RunHooks hooks;
  const auto begin = Clock::now();
  hooks.interrupted = [&] { return Clock::now() - begin > std::chrono::milliseconds(500); };
  const RunResult live = robot.live(std::make_shared<Hanging>(robot.measurements), hooks);
  EXPECT_EQ(live.status, RunStatus::kOk) << live.cause;
  EXPECT_GT(live.epochs, 10);
  ASSERT_FALSE(live.warnings.empty());
  EXPECT_EQ(live.warnings.front(), "sensor 'device' did not end when it was asked to");
  EXPECT_LT(Clock::now() - begin, std::chrono::seconds(7));
}

TEST(RunStream, HasEveryEpochInItsFilesAsSoonAsItIsDone) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(::testing::TempDir()) / "viwo_run_stream";
  files::make_folder(folder);
  const Robot robot(12.);
  auto all = robot.measurements;
  const std::int64_t begin_ns = stamp_ns(all.front());
  for (Measurement& m : all) {
    if (stamp_ns(m) > begin_ns + 6 * kSecond) m = moved(m, -100 * kSecond);
  }
  RunStream files(folder);
  RunHooks hooks;
  std::int64_t looked = 0;
  hooks.on_epoch = [&](const RunResult& result) {
    files.epoch(result);
    if (result.pieces.size() > 1 || result.epochs % 10 != 0) return;
    ++looked;
    const Trajectory written = log::read_tum(folder / "trajectory.tum");
    ASSERT_EQ(static_cast<std::int64_t>(written.size()), result.epochs);
    EXPECT_EQ(written.back().p_BinW, result.estimate.back().p_BinW);
  };
  RunResult live = robot.live(all, hooks);
  EXPECT_GT(looked, 2);
  EXPECT_EQ(files.finish(), "");
  live.on_disk = true;
  ASSERT_EQ(live.pieces.size(), 2U);
  EXPECT_EQ(log::read_tum(piece_file(folder, 0)).size(),
            static_cast<std::size_t>(live.pieces[0].epochs));
  const Trajectory second = log::read_tum(piece_file(folder, 1));
  EXPECT_EQ(second.size(), static_cast<std::size_t>(live.pieces[1].epochs));
  EXPECT_EQ(second.back().p_BinW, live.estimate.back().p_BinW);
  // What was streamed is not written over.
  fs::remove(folder / "calibration.csv");
  write_run(folder, robot.live_setup(), live);
  EXPECT_FALSE(fs::exists(folder / "calibration.csv"));
  EXPECT_EQ(summary_of(robot.live_setup(), live).at("pieces").size(), 2U);
  // The next run here has one piece.
  RunStream next(folder);
  EXPECT_FALSE(fs::exists(piece_file(folder, 0)));
  EXPECT_FALSE(fs::exists(piece_file(folder, 1)));
}

TEST(RunStream, SaysWhatCouldNotBeWrittenAndDoesNotEndTheRun) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(::testing::TempDir()) / "viwo_run_stream_full";
  fs::remove_all(folder);
  files::make_folder(folder);
  fs::create_symlink("/dev/full", folder / "timing.csv");
  const Robot robot;
  RunStream files(folder);
  RunHooks hooks;
  hooks.on_epoch = [&](const RunResult& result) { files.epoch(result); };
  const RunResult live = robot.live(robot.measurements, hooks);
  EXPECT_EQ(live.status, RunStatus::kOk) << live.cause;
  const std::string why =
      "cannot write " + (folder / "timing.csv").string() + ": No space left on device";
  EXPECT_EQ(files.failure(), why) << "is known while it runs";
  EXPECT_EQ(files.finish(), why);
}

TEST(BoundedSeries, KeepsPointsThatAreEvenlySpread) {
  BoundedSeries<int> series(8);
  for (int i = 0; i < 7; ++i) series.add(i);
  EXPECT_EQ(series.points(), (std::vector{0, 1, 2, 3, 4, 5, 6}));
  for (int i = 7; i < 1000; ++i) {
    series.add(i);
    ASSERT_LT(series.points().size(), 8U);
  }
  EXPECT_EQ(series.points(), (std::vector{0, 256, 512, 768}));
}

TEST(TimeStatistics, KnowsMeanAndLargestOfAllAndThePercentileOfMany) {
  TimeStatistics times;
  // 101 is odd: every point that the series keeps, each 2^k-th, sees all the values.
  for (int i = 0; i < 101'000; ++i) times.add(i % 101);
  times.add(1000.);
  const StageTime stage = times.stage();
  EXPECT_NEAR(stage.mean_ms, (50. * 101'000 + 1000.) / 101'001., 1e-9);
  EXPECT_EQ(stage.max_ms, 1000.);
  EXPECT_NEAR(stage.p95_ms, 95., 2.);
  EXPECT_NEAR(stage.p99_ms, 99., 1.5);
}

TEST(RunRecord, CanTakeOutTheNewestPointOfARunWithoutLosingCounts) {
  const Robot robot;
  const RunResult whole = robot.live(robot.measurements);
  RunResult run = whole;
  drop_last_point(run);
  EXPECT_EQ(run.estimate.size(), whole.estimate.size() - 1);
  EXPECT_EQ(run.calibration[3].sigma.size(), run.epoch_t_s.size());
  const UpdateTrack &before = whole.updates[0], &after = run.updates[0];
  EXPECT_EQ(after.total.applied, before.total.applied - before.applied.back());
  EXPECT_EQ(after.applied.size(), run.epoch_t_s.size());
}

}  // namespace
}  // namespace viwo

// Runs of the filter: their progress, and what is written of what their sensors give.
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include "held_gauge.hpp"
#include "simulated.hpp"
#include "sources.hpp"
#include "stream.hpp"
#include "viwo/experiment/progress.hpp"
#include "viwo/experiment/simulate.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

using namespace experiment;
using testing::registry;

/// A simulated swerve robot for ten seconds; images only make the epochs.
RunSetup inertia_and_wheels() {
  const config::Node run = config::parse(
      testing::swerve_with_camera(10) + "updates: {wheel_odometry: {}}\n", "run.yaml");
  return read_run(run, registry(), 1);
}

TEST(FilterRun, TellsItsProgressAsPartOfTheTimeOfTheLog) {
  RunSetup setup = inertia_and_wheels();
  const RunData data = collect(setup);
  std::vector<double> fractions;
  RunHooks hooks;
  hooks.progress = [&](double fraction) { fractions.push_back(fraction); };
  const RunResult result = experiment::run(setup, data, hooks);
  ASSERT_EQ(result.status, RunStatus::kOk) << result.cause;
  ASSERT_EQ(fractions.size(), static_cast<std::size_t>(result.epochs));
  const double log_s = seconds_between(data.imu.front().t_ns, data.imu.back().t_ns);
  for (std::size_t i = 0; i < fractions.size(); ++i) {
    const double t_s = seconds_between(data.imu.front().t_ns, result.estimate[i].t_ns);
    EXPECT_DOUBLE_EQ(fractions[i], t_s / log_s);
  }
  EXPECT_GT(fractions.back(), 0.95);
  EXPECT_LE(fractions.back(), 1.);
}

TEST(FilterRun, RefusesSensorsThatDoNotGiveWhatUpdatesNeed) {
  RunSetup setup = inertia_and_wheels();
  setup.filter->wheels.front().sensor = "imu0";
  EXPECT_EQ(testing::error_of([&] { collect(setup); }),
            "run.yaml:4:11  sensor 'imu0' gave no encoder samples, which update wheel_odometry "
            "needs");
  setup = inertia_and_wheels();
  setup.filter->updates.front().wheels = -1;
  setup.filter->updates.front().poses = 0;
  setup.filter->pose_sensors = {"simulator0"};
  EXPECT_EQ(testing::error_of([&] { collect(setup); }),
            "run.yaml:4:11  sensor 'simulator0' gave no poses, which update wheel_odometry needs");
}

TEST(FilterRun, AWheelSetHasTheSamplesOfItsOwnSensor) {
  RunData data;
  data.wheels_name = "wheels0";
  data.samples.resize(2);
  data.other_wheels["wheels1"].resize(3);
  EXPECT_EQ(encoder_samples(data, "").size(), 2U);
  EXPECT_EQ(encoder_samples(data, "wheels0").size(), 2U);
  EXPECT_EQ(encoder_samples(data, "wheels1").size(), 3U);
  EXPECT_EQ(encoder_samples(data, "imu0").size(), 0U);
}

TEST(FilterRun, RefusesTwoSensorsWhereAWheelSetNamesNone) {
  RunSetup setup = inertia_and_wheels();
  setup.filter->wheels.push_back(setup.filter->wheels.front());
  setup.filter->wheels.front().sensor = "simulator0";
  const auto encoders = std::make_shared<const std::vector<Measurement>>(1, EncoderSample());
  setup.sensors.push_back({"other", {}, ""});
  setup.sensors.back().sensor.object = std::make_shared<Replay>(encoders);
  EXPECT_EQ(testing::error_of([&] { collect(setup); }),
            "run.yaml:2:3  both 'simulator0' and 'other' give encoder samples: a run takes them "
            "from one sensor");
}

TEST(FilterRun, TakesTracksFromOneSensor) {
  RunSetup setup = inertia_and_wheels();
  RunData data = collect(setup);
  ASSERT_FALSE(data.images.empty());
  const auto tracks = std::make_shared<const std::vector<Measurement>>(1, data.images.front());
  const auto add_stream = [&](const std::string& name) {
    data.streams.push_back({name, {}, std::make_shared<Replay>(tracks), "images", nullptr});
  };
  const auto both = [](const std::string& names) {
    return "run.yaml:2:3  both " + names + " give tracks: a run takes them from one sensor";
  };
  add_stream("tracks0");
  EXPECT_EQ(testing::error_of([&] { run_filter(setup, data); }),
            both("'simulator0' and 'tracks0'"));
  data.images.clear();
  data.tracks_name.clear();
  data.streams.clear();
  add_stream("tracks0");
  add_stream("tracks1");
  EXPECT_EQ(testing::error_of([&] { run_filter(setup, data); }), both("'tracks0' and 'tracks1'"));
}

TEST(HeldGauge, BringsATruthOfAnotherFrameIntoTheOneThatTheEstimateHolds) {
  const RunSetup setup = inertia_and_wheels();
  const WheelModel& model = *setup.model;
  WheelsView here;
  here.x_WI = model.nominal();
  here.R_ItoO = exp_so3({0.02, -0.01, 0.3});
  here.p_IinO = {0.1, -0.05, 0.2};
  // The same base told in a frame that is turned by 0.2 rad and shifted.
  const Eigen::Vector3d g(0.2, 0.03, -0.02);
  WheelsView there = here;
  ASSERT_EQ(model.model().move_frame(g, there.x_WI), Status::kOk);
  there.R_ItoO = exp_so3({0., 0., -0.2}) * here.R_ItoO;
  there.p_IinO = exp_so3({0., 0., -0.2}) * (here.p_IinO - Eigen::Vector3d(0.03, -0.02, 0.));
  EXPECT_GT((there.x_WI - here.x_WI).norm(), 0.1);
  ASSERT_TRUE(move_to_held_gauge(model, here.x_WI, there));
  EXPECT_LT((there.x_WI - here.x_WI).norm(), 1e-9);
  EXPECT_LT((there.R_ItoO - here.R_ItoO).norm(), 1e-9);
  EXPECT_LT((there.p_IinO - here.p_IinO).norm(), 1e-9);
}

TEST(SimulateResult, IsDescribedByWhatThereIs) {
  SimulateResult result;
  result.counts[Measurement(ImuSample()).index()] = 2001;
  EXPECT_EQ(describe(result), "2001 IMU samples");
  result.counts[Measurement(FeatureSample()).index()] = 1;
  EXPECT_EQ(describe(result), "2001 IMU samples and 1 tracked image");
  result.counts[Measurement(EncoderSample()).index()] = 11;
  result.counts[Measurement(PoseSample()).index()] = 12;
  EXPECT_EQ(describe(result),
            "2001 IMU samples, 1 tracked image, 11 encoder samples and 12 reference poses");
  result.counts[Measurement(StateSample()).index()] = 13;  // the truth: poses are measured
  result.counts[Measurement(CalibrationSample()).index()] = 14;
  EXPECT_EQ(
      describe(result),
      "2001 IMU samples, 1 tracked image, 11 encoder samples, 12 measured poses, 13 reference "
      "states and 14 true parameters");
}

TEST(TimeProgress, IsSilentForASecondAndThenSaysEveryTenPercent) {
  ::testing::internal::CaptureStderr();
  {
    TimeProgress progress("run");
    progress.at(0.5);
    std::this_thread::sleep_for(std::chrono::milliseconds(1050));
    progress.at(0.05);  // less than ten percent are not worth a line
    progress.at(0.678);
    progress.at(0.9);  // within a second of the last line
    std::this_thread::sleep_for(std::chrono::milliseconds(1050));
    progress.at(0.69);
    progress.at(1.);
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "run: 67 %\nrun: 100 %\n");
}

}  // namespace
}  // namespace viwo

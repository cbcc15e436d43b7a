// Runs of the filter: their progress, and what is written of what their sensors give.
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "message_of.hpp"
#include "sensors_in_memory.hpp"
#include "simulated.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/math/time_text.hpp"
#include "viwo/run/simulate.hpp"
#include "viwo/run/warnings.hpp"

namespace viwo {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::InMemory;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::registry;
using testing::set_sensors;

/// A simulated swerve robot for ten seconds; nobody takes the images.
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
  const RunResult result = viwo::run(setup, data, hooks);
  ASSERT_EQ(result.status, RunStatus::kOk) << result.cause;
  ASSERT_EQ(fractions.size(), static_cast<std::size_t>(result.epochs));
  const auto imu = data.imu();
  const double log_s = seconds_between(imu.front().t_ns, imu.back().t_ns);
  for (std::size_t i = 0; i < fractions.size(); ++i) {
    const double t_s = seconds_between(imu.front().t_ns, result.estimate[i].t_ns);
    EXPECT_DOUBLE_EQ(fractions[i], t_s / log_s);
  }
  EXPECT_GT(fractions.back(), 0.95);
  EXPECT_LE(fractions.back(), 1.);
}

TEST(FilterRun, TellsTheErrorOfTheCalibrationFromItsFirstEpochOn) {
  RunSetup setup = inertia_and_wheels();
  const RunData data = collect(setup);
  RunHooks hooks;
  std::int64_t epochs = 0;
  hooks.on_epoch = [&](const RunResult& result) {
    ++epochs;
    for (const CalibrationTrack& track : result.calibration) {
      EXPECT_TRUE(std::isfinite(track.truth)) << track.name << " at epoch " << epochs;
      EXPECT_TRUE(std::isfinite(track.final_error)) << track.name << " at epoch " << epochs;
    }
  };
  const RunResult result = viwo::run(setup, data, hooks);
  EXPECT_EQ(result.calibration.size(), 23U);
  EXPECT_EQ(epochs, result.epochs);
  EXPECT_GT(epochs, 30);
}

TEST(FilterRun, EndsWithItsResultsWhenItIsInterrupted) {
  RunSetup setup = inertia_and_wheels();
  const RunData data = collect(setup);
  bool interrupted = false;
  RunHooks hooks;
  hooks.interrupted = [&] { return interrupted; };
  hooks.on_epoch = [&](const RunResult& result) {
    if (result.epochs == 20) interrupted = true;
  };
  const RunResult result = viwo::run(setup, data, hooks);
  EXPECT_EQ(result.status, RunStatus::kOk) << result.cause;
  EXPECT_EQ(result.epochs, 20);
  EXPECT_EQ(result.estimate.size(), 20U);
  EXPECT_TRUE(result.accuracy);
  ASSERT_EQ(result.warnings.size(), 1U);
  EXPECT_EQ(result.warnings[0],
            "interrupted at " +
                time_text(result.estimate.back().t_ns - result.estimate.front().t_ns) +
                ": the rest of the recording was not used");
}

TEST(FilterRun, RefusesASensorThatGivesNothingOfWhatAnUpdateNeeds) {
  RunSetup setup = inertia_and_wheels();
  const RunData data = collect(setup);
  const auto imu = std::make_shared<InMemory>(sample_types<ImuSample, StateSample>(),
                                              std::vector<Measurement>{ImuSample(), StateSample()});
  const auto silent =
      std::make_shared<InMemory>(sample_types<EncoderSample>(), std::vector<Measurement>());
  set_sensors(setup, {{"imu0", imu}, {"wheels0", silent}});
  EXPECT_EQ(testing::error_of([&] { collect(setup); }),
            "run.yaml:2:3  sensor 'wheels0' gave no encoders, which wheel_odometry needs");
}

TEST(FilterRun, RefusesASensorThatGivesWhatItDoesNotYield) {
  RunSetup setup = inertia_and_wheels();
  const auto imu = std::make_shared<InMemory>(sample_types<ImuSample, EncoderSample>(),
                                              std::vector<Measurement>{ImuSample(), PoseSample()});
  set_sensors(setup, {{"imu0", imu}});
  EXPECT_EQ(testing::error_of([&] { collect(setup); }),
            "sensor 'imu0' gives poses, which it does not say it yields");
}

TEST(FilterRun, AStartFromMotionHasTheWheelsWithoutAnyUpdate) {
  const config::Node run = config::parse(
      testing::swerve_with_camera(10) + "estimator: {type: msckf, start: moving}\n", "run.yaml");
  RunSetup setup = read_run(run, registry(), 1);
  const RunResult result = viwo::run(setup, collect(setup));
  EXPECT_EQ(result.status, RunStatus::kOk) << result.cause;
  EXPECT_GT(result.epochs, 30);
}

TEST(FilterRun, SaysThatItsStartCameLateAndWhatWasInTheWay) {
  const config::Node run =
      config::parse(testing::swerve_with_camera(10) +
                        "updates: {wheel_odometry: {}}\nestimator: {start: standstill}\n",
                    "run.yaml");
  RunSetup setup = read_run(run, registry(), 1);
  const RunData driven = collect(setup);
  // GIVEN a drive that ends in a rest from 6 s on, or begins with one
  const auto with_rest = [&](double from_s, double to_s) {
    std::vector<Measurement> samples;
    const std::int64_t begin_ns = driven.imu().front().t_ns;
    const auto rests = [&](std::int64_t t_ns) {
      const double t_s = seconds_between(begin_ns, t_ns);
      return t_s >= from_s && t_s < to_s;
    };
    for (ImuSample sample : driven.imu()) {
      if (rests(sample.t_ns)) {
        const double noise = 1e-3 * std::sin(static_cast<double>(samples.size()));
        sample.gyro_rad_per_s = {noise, -noise, noise};
        sample.accel_m_per_s2 = {noise, -noise, 9.81 + noise};
      }
      samples.emplace_back(sample);
    }
    for (EncoderSample sample : driven.wheels()) {
      if (rests(sample.end_ns)) sample.drive_rad_per_s.fill(0.);
      samples.emplace_back(sample);
    }
    std::ranges::stable_sort(samples, std::less(), &Measurement::t_ns);
    RunSetup again = read_run(run, registry(), 1);
    set_sensors(
        again,
        {{"robot", std::make_shared<InMemory>(sample_types<ImuSample, EncoderSample>(), samples)}});
    const RunResult result = viwo::run(again, collect(again));
    EXPECT_EQ(result.status, RunStatus::kOk) << result.cause;
    return result.warnings;
  };
  EXPECT_THAT(with_rest(6., 10.),
              Contains(AllOf(HasSubstr("a state to start from was found only after 7"),
                             HasSubstr(" of 10 s: a wheel turns faster than 0.05 rad/s ("))));
  EXPECT_THAT(with_rest(0., 2.), Not(Contains(HasSubstr("a state to start from"))));
}

/// B is off the IMU by the lever arm, which a circle turns into another radius.
TEST(FilterRun, IsComparedWithPosesOfAnotherBodyAtTheImu) {
  constexpr double kYaw_rad = 0.5;  // of I in B
  const std::string body =
      "pose_rate_hz: 20, sigma_pose_position_m: 0, "
      "sigma_pose_orientation_rad: 0, pose_p_BinI_m: [0.4, -0.3, 0.1], "
      "pose_rpy_ItoB_rad: [0, 0, 0.5], ";
  std::string text = testing::swerve_with_camera(10);
  text.insert(text.find("duration_s: 10"), body);
  text += "estimator: {type: msckf, start: moving}\nupdates: {wheel_odometry: {}}\n";
  RunSetup setup = read_run(config::parse(text, "run.yaml"), registry(), 1);
  const RunResult by_states = viwo::run(setup, collect(setup));
  ASSERT_TRUE(by_states.accuracy);
  setup = read_run(config::parse(text, "run.yaml"), registry(), 1);
  std::vector<Measurement> samples, poses;
  for (Measurement m; setup.sensors.front().sensor.object->next(m) == Status::kOk;) {
    if (m.get_if<PoseSample>() != nullptr) poses.push_back(m);
    if (m.get_if<ImuSample>() != nullptr || m.get_if<EncoderSample>() != nullptr) {
      samples.push_back(m);
    }
  }
  const auto ate_m = [&] {
    set_sensors(
        setup,
        {{"robot0", std::make_shared<InMemory>(sample_types<ImuSample, EncoderSample>(), samples)},
         {"poses0", std::make_shared<InMemory>(sample_types<PoseSample>(), poses)}});
    const RunResult result = viwo::run(setup, collect(setup));
    EXPECT_TRUE(result.accuracy) << result.cause;
    return result.accuracy ? result.accuracy->ate_m : 0.;
  };
  const double right_m = by_states.accuracy->ate_m;
  EXPECT_GT(ate_m(), 5. * right_m);
  ASSERT_TRUE(setup.O_in_I);
  const Eigen::Vector2d p_OinI = setup.O_in_I->head<2>();
  const Eigen::Vector2d p_OinB =
      Eigen::Rotation2Dd(kYaw_rad) * (p_OinI - Eigen::Vector2d(0.4, -0.3));
  setup.extrinsics = PlanarExtrinsics(p_OinB.x(), p_OinB.y(), (*setup.O_in_I)[2] + kYaw_rad);
  EXPECT_NEAR(ate_m(), right_m, 0.1 * right_m);
  setup.extrinsics->head<2>() *= -1.;
  EXPECT_GT(ate_m(), 5. * right_m);
}

/// The same robot without its wheels.
std::string swerve_without_wheels(int features) {
  std::string all = testing::swerve_with_camera(features);
  // A circle tells one camera little of its scale.
  all.replace(all.find("motion: circle"), 14, "motion: icr_sweep");
  return all.substr(0, all.find("kinematics:"));
}

TEST(FilterRun, AStartFromMotionHasImagesWhereThereAreNoWheels) {
  const config::Node run = config::parse(
      swerve_without_wheels(60) + "cameras: {kalibr: " VIWO_TEST_SOURCE_DIR
                                  "/configs/cameras/pinhole.yaml, calibrate: false}\n"
                                  "estimator: {start: moving}\nupdates: {visual_features: {}}\n",
      "run.yaml");
  RunSetup setup = read_run(run, registry(), 1);
  const RunData data = collect(setup);
  const RunResult result = viwo::run(setup, data);
  ASSERT_EQ(result.status, RunStatus::kOk) << result.cause;
  EXPECT_LT(seconds_between(data.imu().front().t_ns, result.estimate.front().t_ns), 2.5);
}

TEST(FilterRun, AStartFromMotionNeedsWheelsOrTracks) {
  const config::Node run = config::parse(
      swerve_without_wheels(10) + "estimator: {type: msckf, start: moving}\n", "run.yaml");
  RunSetup setup = read_run(run, registry(), 1);
  const RunData data = collect(setup);
  EXPECT_EQ(testing::error_of([&] { viwo::run(setup, data); }),
            "estimator.start: moving needs wheels, or cameras and an update that takes their "
            "tracks - choose standstill or reference");
}

TEST(SimulateResult, IsDescribedByWhatThereIs) {
  SimulateResult result;
  result.counts["imu"] = 2001;
  EXPECT_EQ(describe(result), "2001 IMU samples");
  result.counts["tracks"] = 1;
  EXPECT_EQ(describe(result), "2001 IMU samples and 1 tracked image");
  result.counts["encoders"] = 11;
  result.counts["poses"] = 12;
  EXPECT_EQ(describe(result),
            "2001 IMU samples, 1 tracked image, 11 encoder samples and 12 reference poses");
  result.counts["reference states"] = 13;  // the truth: poses are measured
  result.counts["true calibration"] = 14;
  EXPECT_EQ(
      describe(result),
      "2001 IMU samples, 1 tracked image, 11 encoder samples, 12 measured poses, 13 reference "
      "states and 14 true parameters");
  result.counts = {{"imu", 1}};
  result.left_out["gnss fixes"] = 15;  // there is no table for them
  EXPECT_EQ(describe(result),
            "1 IMU sample; not written, as there is no table for them: 15 gnss fixes");
}

// What cannot be compared is no reason to lose what was estimated.
TEST(Accuracy, ThatCannotBeToldIsAWarning) {
  const RunSetup setup = read_run(testing::simulated("circle"), testing::registry());
  RunResult result;
  result.estimate = {{0, {0., 0., 0.}}, {1'000'000'000, {1., 0., 0.}}};
  const Trajectory later = {{2'000'000'000, {0., 0., 0.}}, {3'000'000'000, {1., 0., 0.}}};
  compare(later, setup, result);
  EXPECT_FALSE(result.accuracy);
  EXPECT_THAT(result.warnings,
              ElementsAre(HasSubstr("no accuracy: no pose of the estimate lies in the time of the "
                                    "reference")));
  result.warnings.clear();
  compare(result.estimate, setup, result);
  EXPECT_TRUE(result.accuracy);
  EXPECT_THAT(result.warnings, ElementsAre());
}

}  // namespace
}  // namespace viwo

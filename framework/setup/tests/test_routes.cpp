// Who gets what the sensors of a run yield, and what is said when that does not fit.
#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "message_of.hpp"
#include "simulated.hpp"
#include "viwo/setup/routes.hpp"

namespace viwo {

/// A kind of samples that viwo knows nothing of.
struct RangeSample {
  std::int64_t t_ns = 0;
  double range_m = 0.;
};

}  // namespace viwo

VIWO_SAMPLE(viwo::RangeSample, "range", 1, &viwo::RangeSample::t_ns, &viwo::RangeSample::range_m);

namespace viwo {
namespace {

using ::testing::ElementsAre;
using testing::error_of;
using testing::registry;

template <Sample T>
SharedStream stream(const std::string& takers, const std::string& sensor = "",
                    bool optional = false) {
  StreamSpec spec;
  spec.type = &sample_type<T>();
  spec.sensor = sensor;
  spec.optional = optional;
  return {spec, takers, false};
}

const SensorYield kImu{"imu0", sample_types<ImuSample>()};
const SensorYield kTracks{"tracks0", sample_types<FeatureSample>()};
const SensorYield kWheels{"wheels0", sample_types<EncoderSample>()};
const SensorYield kMocap{"mocap", sample_types<PoseSample>()};
const SensorYield kTruth{"truth", sample_types<StateSample, PoseSample, CalibrationSample>()};

struct Resolved {
  Routes routes;
  std::string errors;
};

/// With `streams` it is the filter's run, else dead reckoning.
Resolved resolve(const std::vector<SensorYield>& sensors, const std::vector<SharedStream>& streams,
                 Wanted wanted = {}) {
  wanted.streams = streams;
  wanted.filter = !streams.empty();
  config::Errors errors;
  Resolved resolved;
  resolved.routes = Routes::resolve(sensors, wanted, {"run.yaml", 3, 5}, errors);
  resolved.errors = errors.text();
  return resolved;
}

Wanted with_wheels(const std::string& sensor = "") {
  Wanted wanted;
  wanted.wheels = true;
  wanted.wheels_sensor = sensor;
  return wanted;
}

Wanted measuring_with(const std::string& sensor) {
  Wanted wanted;
  wanted.measuring = {sensor};
  return wanted;
}

/// Who gets samples of a kind, "imu", "heading", "stream 1", ...
template <Sample T>
std::vector<std::string> takers_of(const Routes& routes, const std::string& sensor) {
  std::vector<std::string> takers;
  routes.dispatch(sensor, sample_type<T>(), [&](const Route& route) {
    constexpr const char* kNames[] = {
        "imu",    "heading",          "stream",  "wheels", "reference poses",
        "states", "true calibration", "pictures"};
    std::string taker = kNames[static_cast<int>(route.consumer)];
    if (route.consumer == Consumer::kStream) taker += " " + std::to_string(route.stream);
    takers.push_back(taker);
  });
  return takers;
}

/// How many streams have a sensor.
std::ptrdiff_t streams_of(const Routes& routes) {
  const auto all = routes.all();
  return std::count_if(all.begin(), all.end(),
                       [](const Route& route) { return route.consumer == Consumer::kStream; });
}

TEST(Routes, GiveEachKindToEverybodyWhoTakesIt) {
  const SensorYield images{"images0", sample_types<ImageSample>()};
  const auto [routes, errors] =
      resolve({kImu, images, kTracks, kWheels, kTruth},
              {stream<FeatureSample>("visual_features"), stream<EncoderSample>("wheel_odometry")},
              with_wheels());
  EXPECT_EQ(errors, "");
  EXPECT_THAT(takers_of<ImuSample>(routes, "imu0"), ElementsAre("imu"));
  EXPECT_THAT(takers_of<FeatureSample>(routes, "tracks0"), ElementsAre("stream 0"));
  EXPECT_THAT(takers_of<EncoderSample>(routes, "wheels0"), ElementsAre("stream 1", "wheels"));
  EXPECT_THAT(takers_of<StateSample>(routes, "truth"), ElementsAre("states"));
  EXPECT_THAT(takers_of<CalibrationSample>(routes, "truth"), ElementsAre("true calibration"));
  EXPECT_THAT(takers_of<ImageSample>(routes, "images0"), ElementsAre("pictures"));
  EXPECT_EQ(routes.sensor_of(Consumer::kImu), "imu0");
  EXPECT_EQ(routes.sensor_of(Consumer::kWheels), "wheels0");
  EXPECT_EQ(routes.sensor_of(Consumer::kReferencePoses), "");
  EXPECT_EQ(streams_of(routes), 2);
}

TEST(Routes, GiveASampleToEachStreamThatTakesItsKindFromItsSensor) {
  const auto [routes, errors] =
      resolve({kImu, kTracks}, {stream<FeatureSample>("a"), stream<FeatureSample>("b", "tracks0")});
  EXPECT_EQ(errors, "");
  EXPECT_THAT(takers_of<FeatureSample>(routes, "tracks0"), ElementsAre("stream 0", "stream 1"));
}

TEST(Routes, KnowKindsThatOnlyPluginsKnow) {
  const SensorYield beacons{"beacons", sample_types<RangeSample>()};
  const auto [routes, errors] = resolve({kImu, beacons}, {stream<RangeSample>("ranges")});
  EXPECT_EQ(errors, "");
  EXPECT_THAT(takers_of<RangeSample>(routes, "beacons"), ElementsAre("stream 0"));
  EXPECT_EQ(resolve({kImu}, {stream<RangeSample>("ranges")}).errors,
            "run.yaml:3:5  no sensor of this run gives range, which ranges needs");
}

TEST(Routes, LeaveAloneWhatNobodyTakes) {
  const auto [routes, errors] = resolve({kImu, kTracks}, {stream<ImuSample>("counts_imu")});
  EXPECT_EQ(errors, "");
  EXPECT_THAT(takers_of<FeatureSample>(routes, "tracks0"), ElementsAre());
  EXPECT_THAT(takers_of<ImuSample>(routes, "imu0"), ElementsAre("imu", "stream 0"));
}

TEST(Routes, RefuseWhatASensorDoesNotYield) {
  const Routes routes = resolve({kImu, kTracks}, {stream<FeatureSample>("eyes")}).routes;
  EXPECT_EQ(error_of([&] { takers_of<PoseSample>(routes, "tracks0"); }),
            "sensor 'tracks0' gives poses, which it does not say it yields");
  EXPECT_EQ(error_of([&] { takers_of<ImuSample>(routes, "imu1"); }),
            "sensor 'imu1' gives imu, which it does not say it yields");
}

TEST(Routes, NeedASensorForTheImuAndForEachStreamThatIsNotOptional) {
  EXPECT_EQ(resolve({kTracks}, {stream<FeatureSample>("eyes")}).errors,
            "run.yaml:3:5  no sensor of this run gives imu, which the filter needs");
  EXPECT_EQ(resolve({kImu}, {stream<FeatureSample>("eyes")}).errors,
            "run.yaml:3:5  no sensor of this run gives tracks, which eyes needs");
  EXPECT_EQ(resolve({kImu, kTracks}, {stream<EncoderSample>("wheels", "tracks0")}).errors,
            "run.yaml:3:5  sensor 'tracks0' gives no encoders, which wheels needs");
  EXPECT_EQ(resolve({kImu, kTracks}, {stream<FeatureSample>("eyes", "track0")}).errors,
            "run.yaml:3:5  eyes: no sensor 'track0' - did you mean 'tracks0'?");
}

TEST(Routes, LeaveAnOptionalStreamWithoutASensor) {
  const auto [routes, errors] = resolve(
      {kImu, kTracks},
      {stream<EncoderSample>("rest", "", true), stream<GnssSample>("fixes", "tracks0", true)});
  EXPECT_EQ(errors, "");
  EXPECT_EQ(streams_of(routes), 0);
  // But not one that is misspelt, or one of several.
  EXPECT_EQ(resolve({kImu}, {stream<GnssSample>("fixes", "imu", true)}).errors,
            "run.yaml:3:5  fixes: no sensor 'imu' - did you mean 'imu0'?");
  const SensorYield other{"wheels1", sample_types<EncoderSample>()};
  EXPECT_EQ(resolve({kImu, kWheels, other}, {stream<EncoderSample>("rest", "", true)}).errors,
            "run.yaml:3:5  both 'wheels0' and 'wheels1' give encoders: a run takes them from one "
            "sensor - name it: sensor: NAME");
}

TEST(Routes, TakeEachKindFromOneSensorUnlessItIsNamed) {
  const SensorYield imu1{"imu1", sample_types<ImuSample>()};
  const SensorYield tracks1{"tracks1", sample_types<FeatureSample>()};
  // Nothing chooses between two IMUs.
  EXPECT_EQ(resolve({kImu, imu1, kTracks}, {stream<FeatureSample>("eyes")}).errors,
            "run.yaml:3:5  both 'imu0' and 'imu1' give imu: a run takes them from one sensor");
  EXPECT_EQ(resolve({kImu, kTracks, tracks1}, {stream<FeatureSample>("eyes")}).errors,
            "run.yaml:3:5  both 'tracks0' and 'tracks1' give tracks: a run takes them from one "
            "sensor - name it: sensor: NAME");
  const auto [routes, errors] =
      resolve({kImu, kTracks, tracks1}, {stream<FeatureSample>("eyes", "tracks1")});
  EXPECT_EQ(errors, "");
  EXPECT_THAT(takers_of<FeatureSample>(routes, "tracks0"), ElementsAre());
  EXPECT_THAT(takers_of<FeatureSample>(routes, "tracks1"), ElementsAre("stream 0"));
  const SensorYield images0{"images0", sample_types<ImageSample>()};
  const SensorYield images1{"images1", sample_types<ImageSample>()};
  EXPECT_EQ(resolve({kImu, images0, images1}, {stream<ImuSample>("a")}).errors,
            "run.yaml:3:5  both 'images0' and 'images1' give images: a run takes them from one "
            "sensor");
}

TEST(Routes, GiveEachWheelSetTheSamplesOfItsOwnSensor) {
  const SensorYield wheels1{"wheels1", sample_types<EncoderSample>()};
  const auto sets = [&](const std::string& first) {
    return resolve({kImu, kWheels, wheels1},
                   {stream<EncoderSample>("wheel_odometry", first),
                    stream<EncoderSample>("second.wheel_odometry", "wheels1")},
                   with_wheels(first));
  };
  const auto [routes, errors] = sets("wheels0");
  EXPECT_EQ(errors, "");
  EXPECT_THAT(takers_of<EncoderSample>(routes, "wheels0"), ElementsAre("stream 0", "wheels"));
  EXPECT_THAT(takers_of<EncoderSample>(routes, "wheels1"), ElementsAre("stream 1"));
  EXPECT_EQ(sets("").errors,
            "run.yaml:3:5  both 'wheels0' and 'wheels1' give encoders: a run takes them from one "
            "sensor - name it: sensor: NAME");
}

TEST(Routes, OfDeadReckoningNeedWheelsAlone) {
  const SensorYield wheels1{"wheels1", sample_types<EncoderSample>()};
  const auto [routes, errors] = resolve({kImu, kWheels, kMocap}, {}, with_wheels());
  EXPECT_EQ(errors, "");
  EXPECT_THAT(takers_of<EncoderSample>(routes, "wheels0"), ElementsAre("wheels"));
  EXPECT_THAT(takers_of<PoseSample>(routes, "mocap"), ElementsAre("reference poses"));
  // For who compares the wheels with a gyro; a run without one does as well.
  EXPECT_THAT(takers_of<ImuSample>(routes, "imu0"), ElementsAre("imu"));
  EXPECT_EQ(resolve({kWheels, kMocap}, {}, with_wheels()).errors, "");
  EXPECT_EQ(resolve({kImu}, {}, with_wheels()).errors,
            "run.yaml:3:5  no sensor of this run gives encoders, which the kinematic model needs");
  EXPECT_EQ(resolve({kWheels, wheels1}, {}, with_wheels()).errors,
            "run.yaml:3:5  both 'wheels0' and 'wheels1' give encoders: a run takes them from one "
            "sensor - name it: wheels.sensor: NAME");
  EXPECT_EQ(
      resolve({kWheels, wheels1}, {}, with_wheels("wheels1")).routes.sensor_of(Consumer::kWheels),
      "wheels1");
}

TEST(Routes, OfAFilterWithoutUpdatesOfWheelsDoNotNeedThem) {
  const SensorYield wheels1{"wheels1", sample_types<EncoderSample>()};
  EXPECT_EQ(resolve({kImu}, {stream<ImuSample>("a")}, with_wheels()).errors, "");
  EXPECT_EQ(resolve({kImu, kWheels, wheels1}, {stream<ImuSample>("a")}, with_wheels()).errors, "");
}

TEST(Routes, TakePosesThatNobodyMeasuresWithAsReference) {
  const SensorYield vicon{"vicon", sample_types<PoseSample>()};
  const auto fix = stream<PoseSample>("fix", "mocap");
  const auto [routes, errors] = resolve({kImu, kMocap, vicon}, {fix}, measuring_with("mocap"));
  EXPECT_EQ(errors, "");
  EXPECT_THAT(takers_of<PoseSample>(routes, "mocap"), ElementsAre("stream 0"));
  EXPECT_THAT(takers_of<PoseSample>(routes, "vicon"), ElementsAre("reference poses"));
  // Also while the update is turned off: the reference stays the same.
  const auto off =
      resolve({kImu, kMocap, vicon}, {stream<ImuSample>("a")}, measuring_with("mocap"));
  EXPECT_EQ(off.errors, "");
  EXPECT_THAT(takers_of<PoseSample>(off.routes, "mocap"), ElementsAre());
  EXPECT_THAT(takers_of<PoseSample>(off.routes, "vicon"), ElementsAre("reference poses"));
  EXPECT_EQ(
      resolve({kImu, kMocap, vicon}, {stream<ImuSample>("a")}).errors,
      "run.yaml:3:5  both 'mocap' and 'vicon' give poses: a run takes them from one sensor as "
      "reference");
}

TEST(Routes, TakeTheReferenceFromOneSensor) {
  // Poses beside states are measurements.
  const auto [routes, errors] = resolve({kImu, kTruth}, {stream<ImuSample>("a")});
  EXPECT_EQ(errors, "");
  EXPECT_THAT(takers_of<PoseSample>(routes, "truth"), ElementsAre());
  EXPECT_EQ(resolve({kImu, kTruth, kMocap}, {stream<ImuSample>("a")}).errors,
            "run.yaml:3:5  both 'truth' and 'mocap' give a reference: a run takes it from one "
            "sensor");
  EXPECT_EQ(
      resolve({kImu, kTruth, kMocap}, {stream<PoseSample>("fix", "mocap")}, measuring_with("mocap"))
          .errors,
      "");
  const SensorYield other{"other", sample_types<StateSample>()};
  EXPECT_EQ(resolve({kImu, kTruth, other}, {stream<ImuSample>("a")}).errors,
            "run.yaml:3:5  both 'truth' and 'other' give reference states: a run takes them from "
            "one sensor");
}

TEST(Routes, WantTheSensorOfMeasuredPosesNamed) {
  // Else the reference of the run would become a measurement without a word.
  EXPECT_EQ(resolve({kImu, kMocap}, {stream<PoseSample>("fix")}).errors,
            "run.yaml:3:5  fix needs the sensor that gives its poses (sensor: NAME)");
}

TEST(Routes, TellAllThatDoesNotFitAtOnce) {
  EXPECT_EQ(
      resolve({kMocap}, {stream<FeatureSample>("eyes"), stream<EncoderSample>("wheels")}).errors,
      "run.yaml:3:5  no sensor of this run gives imu, which the filter needs\n"
      "run.yaml:3:5  no sensor of this run gives tracks, which eyes needs\n"
      "run.yaml:3:5  no sensor of this run gives encoders, which wheels needs");
}

// The same by way of a configuration.

config::Node swerve(const std::string& sensors, const std::string& updates) {
  return config::parse(
      "sensors:\n  sim: {type: simulator, motion: circle, duration_s: 1, "
      "pose_rate_hz: 10, cameras: " VIWO_TEST_SOURCE_DIR
      "/configs/cameras/pinhole.yaml, robot: &robot {type: four_wis_wid, " +
          testing::kSwerve + "}}\n" + sensors +
          "kinematics: *robot\nupdates:\n  wheel_odometry: {}\n" + updates,
      "run.yaml");
}

const std::string kPlanar =
    "  planar: {type: planar_simulator, motion: circle, duration_s: 1, robot: *robot}\n";

TEST(RunConfiguration, CountsThePosesOfAnUpdateAsMeasuredAlsoWhileItIsTurnedOff) {
  const std::string fix = "  fix: {type: pose_reference, sensor: planar, sigma_position_m: 0.01";
  config::Node run = swerve(kPlanar, fix + "}\n");
  run.set("wheels", config::parse("sensor: sim", "wheels"));
  const RunSetup setup = read_run(run, registry(), 1);
  EXPECT_THAT(takers_of<PoseSample>(setup.routes, "planar"), ElementsAre("stream 1"));
  config::Node off = swerve(kPlanar, fix + ", enabled: false}\n");
  off.set("wheels", config::parse("sensor: sim", "wheels"));
  EXPECT_THAT(takers_of<PoseSample>(read_run(off, registry(), 1).routes, "planar"), ElementsAre());
  // Without it the poses are a second reference.
  config::Node none = swerve(kPlanar, "");
  none.set("wheels", config::parse("sensor: sim", "wheels"));
  EXPECT_EQ(error_of([&] { read_run(none, registry(), 1); }),
            "run.yaml:2:3  both 'sim' and 'planar' give a reference: a run takes it from one "
            "sensor");
}

TEST(RunConfiguration, DoesNotTakeTheReferenceFromASensorThatAnUpdateNamesForItsWheels) {
  const config::Node run =
      config::parse("sensors:\n" + kPlanar.substr(0, kPlanar.find("*robot")) +
                        "&robot {type: four_wis_wid, " + testing::kSwerve +
                        "}}\nkinematics: *robot\nestimator: {type: dead_reckoning}\n"
                        "updates: {wheel_odometry: {sensor: planar}}\n",
                    "run.yaml");
  const RunSetup setup = read_run(run, registry(), 1);
  EXPECT_THAT(takers_of<PoseSample>(setup.routes, "planar"), ElementsAre("reference poses"));
}

TEST(RunConfiguration, RefusesTheNameOfASensorThatNothingIsTakenFrom) {
  EXPECT_EQ(error_of([] {
              read_run(swerve("", "  flat: {type: planar_motion, sensor: sim}\n"), registry(), 1);
            }),
            "run.yaml:6:3  updates.flat.sensor: it takes nothing from a sensor that is named here");
  EXPECT_EQ(error_of([] {
              read_run(swerve("",
                              "  fix: {type: pose_reference, sensor: simm, "
                              "sigma_position_m: 0.01}\n"),
                       registry(), 1);
            }),
            "run.yaml:6:39  updates.fix.sensor: no sensor 'simm' - did you mean 'sim'?");
}

}  // namespace
}  // namespace viwo

// Runs on sensors that give measurements as they happen.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstddef>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "live_device.hpp"
#include "message_of.hpp"
#include "pictures_of_points.hpp"
#include "sensors_in_memory.hpp"
#include "simulated.hpp"
#include "viwo/results/run_output.hpp"
#include "viwo/run/run.hpp"
#include "wheel_fixture.hpp"

namespace viwo {
namespace {

using testing::BreakingDevice;
using testing::Device;
using testing::in_time_order;
using testing::Points;
using testing::registry;
using testing::routes_for;
using testing::routes_of_device;
using testing::routes_of_pictures;
using testing::standing_then_driving;
using testing::stream;
using testing::Tracker;
using testing::with_pictures;

double distance(const RunResult& a, const RunResult& b) {
  double largest = 0.;
  for (std::size_t i = 0; i < std::min(a.estimate.size(), b.estimate.size()); ++i) {
    largest = std::max(largest, (a.estimate[i].p_BinW - b.estimate[i].p_BinW).norm());
  }
  return largest;
}

TEST(LiveFeed, GivesTheTrajectoryOfTheSameMeasurementsRecorded) {
  RunSetup setup = standing_then_driving();
  const RunData recorded = collect(setup);
  const RunResult expected = run_filter(setup, recorded);
  ASSERT_EQ(expected.status, RunStatus::kOk) << expected.cause;
  const auto device = std::make_shared<Device>(in_time_order(recorded.recorded), false);
  setup = standing_then_driving();  // updates that have not learned anything yet
  setup.routes = routes_of_device(setup);
  RunData data;
  data.live.push_back(stream("device", device));
  const RunResult live = run_filter(setup, data);
  ASSERT_EQ(live.status, RunStatus::kOk) << live.cause;
  ASSERT_EQ(live.estimate.size(), expected.estimate.size());
  EXPECT_LT(distance(live, expected), 1e-9);
  ASSERT_EQ(device->estimates.size(), live.estimate.size());
  const EstimateSample& last = device->estimates.back();
  EXPECT_EQ(last.t_ns, live.estimate.back().t_ns);
  EXPECT_EQ(last.p_IinG_m[0], live.estimate.back().p_BinW.x());
  EXPECT_GT(last.covariance[0], 0.);
  ASSERT_EQ(last.calibration_names.size(), live.calibration.size());
  EXPECT_EQ(last.calibration_names.front(), live.calibration.front().name);
  EXPECT_EQ(last.calibration.back(), live.calibration.back().estimate.back());
  EXPECT_EQ(last.calibration_sigma.back(), live.calibration.back().sigma.back());
  // It gives tracks, and no images.
  EXPECT_TRUE(std::isnan(last.latency_s));
  for (const auto& [stage, time] : live.stages) EXPECT_NE(stage, "latency from image to pose");
}

TEST(LiveFeed, FeedsWhatWorksOnPicturesAndTellsTheLatency) {
  RunSetup setup = standing_then_driving();
  const RunData recorded = collect(setup);
  // Pictures come faster here than they are worked on: few enough that none is dropped.
  std::vector<Measurement> measurements;
  constexpr int kBefore = 20;  // at the start, and no pose is of them
  int pictures = 0;
  for (const Measurement& measurement : with_pictures(recorded)) {
    const bool is_picture = measurement.get_if<ImageSample>() != nullptr;
    if (is_picture && (++pictures <= kBefore || pictures > kBefore + 8)) continue;
    measurements.push_back(measurement);
  }
  setup.routes = routes_of_pictures(setup);
  RunData data;
  const auto device = std::make_shared<Device>(std::move(measurements), false);
  data.live.push_back(stream("device", device));
  data.streams.push_back(stream("tracks", std::make_shared<Tracker>(), "device"));
  const RunResult live = run_filter(setup, data);
  ASSERT_EQ(live.status, RunStatus::kOk) << live.cause;
  std::vector<std::string> stages;
  for (const auto& [stage, time] : live.stages) stages.push_back(stage);
  EXPECT_NE(std::find(stages.begin(), stages.end(), "sensor tracks"), stages.end());
  EXPECT_NE(std::find(stages.begin(), stages.end(), "latency from image to pose"), stages.end());
}

TEST(LiveFeed, DropsTheWholeOldestPairAlsoWhenItsStampsDifferALittle) {
  std::promise<void> all_given;
  class Camera final : public Device {
   public:
    Camera(std::vector<Measurement> images, std::promise<void>& end)
        : Device(std::move(images), false), end_(end) {}
    Status next(Measurement& out) override {
      const Status status = Device::next(out);
      if (status == Status::kEnd) end_.set_value();
      return status;
    }

   private:
    std::promise<void>& end_;
  };
  /// Begins when all has been given.
  class Late final : public Sensor {
   public:
    Late(std::future<void> begin, std::vector<int>& cameras)
        : begin_(std::move(begin)), cameras_(cameras) {}
    SampleTypes yields() const override { return sample_types<FeatureSample>(); }
    bool takes_input() const override { return true; }
    void connect(Sensor& input) override { input_ = &input; }
    Status next(Measurement& /*out*/) override {
      begin_.wait();
      Measurement in;
      while (input_->next(in) == Status::kOk) {
        cameras_.push_back(in.get_if<ImageSample>()->camera);
      }
      return Status::kEnd;
    }

   private:
    Sensor* input_ = nullptr;
    std::future<void> begin_;
    std::vector<int>& cameras_;
  };
  std::vector<Measurement> images;
  for (std::int64_t k = 0; k < 11; ++k) {
    const std::int64_t t_ns = k / 2 * 100'000'000 + k % 2 * 1'000'000;
    images.emplace_back(ImageSample{t_ns, static_cast<int>(k % 2), nullptr});
  }
  RunSetup setup = standing_then_driving();
  setup.routes = routes_of_pictures(setup);
  RunData data;
  std::vector<int> cameras;
  data.live.push_back(stream("device", std::make_shared<Camera>(std::move(images), all_given)));
  data.streams.push_back(
      stream("tracks", std::make_shared<Late>(all_given.get_future(), cameras), "device"));
  run_filter(setup, data);
  EXPECT_EQ(cameras, (std::vector{0, 1, 0, 1, 0, 1, 0}));
}

TEST(LiveFeed, EndsWithAnErrorForWhatASensorDoesNotYield) {
  RunSetup setup = standing_then_driving();
  setup.routes = routes_of_device(setup);
  RunData data;
  data.live.push_back(
      stream("device",
             std::make_shared<Device>(std::vector<Measurement>{ImuSample(), PoseSample()}, false)));
  EXPECT_EQ(testing::error_of([&] { run_filter(setup, data); }),
            "sensor 'device' gives poses, which it does not say it yields");
}

TEST(LiveFeed, LooksAtTheChannelsOfEachWheelSet) {
  RunSetup setup = standing_then_driving();
  const RunData recorded = collect(setup);
  WheelSet second = setup.filter->wheels.front();
  second.model = testing::load_model(testing::differential());
  second.prior.name = "second";
  second.prior.sensor = "wheels";
  setup.filter->wheels.push_back(second);
  setup.routes = routes_for(setup, {{"imu", sample_types<ImuSample, FeatureSample>()},
                                    {"wheels", sample_types<EncoderSample>()}});
  RunData data;
  data.live.push_back(
      stream("wheels",
             std::make_shared<Device>(std::vector<Measurement>{recorded.wheels().front()}, false)));
  EXPECT_EQ(testing::error_of([&] { run_filter(setup, data); }),
            "run.yaml:1:10  sensors.wheels has 4 drive and 4 steering channels, but the kinematic "
            "model has 2 driven and 0 steered wheels");
}

/// Counts the images that it is given.
class Looking final : public Update {
 public:
  explicit Looking(std::size_t& images) : images_(images) {}
  void declare(Declarations& host) override {
    stream_ = host.stream({.type = &sample_type<ImageSample>()});
  }
  void update(const FilterView& /*filter*/, const EpochData& data, FactorSink& /*sink*/) override {
    images_ += data.samples<ImageSample>(stream_).size();
  }

 private:
  std::size_t& images_;
  StreamId stream_;
};

TEST(LiveFeed, GivesImagesToAnUpdateThatTakesThemAsARecordedRunDoes) {
  std::size_t images = 0;
  const auto looking = [&](const SensorYield& tracks) {
    RunSetup setup = standing_then_driving();
    setup.filter->updates.push_back({"looking", {}, nullptr, "", {}});
    setup.filter->updates.back().update.object = std::make_shared<Looking>(images);
    // Behind the streams of the updates, none of which the start adds to.
    setup.filter->streams.push_back({{.type = &sample_type<ImageSample>()}, "looking", false});
    const SensorYield device{"device", sample_types<ImuSample, EncoderSample, ImageSample>()};
    setup.routes = routes_for(setup, {device, tracks});
    return setup;
  };
  RunSetup simulated = standing_then_driving();
  const RunData recorded = collect(simulated);
  const auto measurements = with_pictures(recorded);
  const SensorYield tracks{"tracks", sample_types<FeatureSample>()};

  RunData data;
  for (const Measurement& measurement : measurements) {
    data.recorded.add("device", measurement.view());
  }
  data.recorded.set<FeatureSample>("tracks", {});
  RunSetup setup = looking(tracks);
  run_filter(setup, data);
  const std::size_t expected = std::exchange(images, 0);
  EXPECT_GT(expected, 20U);

  data = {};
  data.live.push_back(stream("device", std::make_shared<Device>(measurements, false)));
  setup = looking(tracks);
  run_filter(setup, data);
  EXPECT_EQ(images, expected);
}

TEST(LiveFeed, EndsWhenItIsInterruptedAndKeepsTheResults) {
  RunSetup setup = standing_then_driving();
  const RunData recorded = collect(setup);
  const std::string offline = describe(run_filter(setup, recorded));
  const auto device = std::make_shared<Device>(in_time_order(recorded.recorded), true);
  setup.routes = routes_of_device(setup);
  RunData data;
  data.live.push_back(stream("device", device));
  RunHooks hooks;
  const auto begin = std::chrono::steady_clock::now();
  hooks.interrupted = [&] {
    return std::chrono::steady_clock::now() - begin > std::chrono::milliseconds(300);
  };
  const RunResult live = run_filter(setup, data, hooks);
  EXPECT_EQ(live.status, RunStatus::kOk) << live.cause;
  EXPECT_GT(live.estimate.size(), 10U);
  // Slower than real time it would be behind; that says nothing of what was waited for.
  EXPECT_EQ(describe(live).find("x real time"), std::string::npos) << describe(live);
  EXPECT_NE(offline.find("x real time"), std::string::npos);
}

TEST(LiveFeed, SaysThatNothingHasCome) {
  RunSetup setup = standing_then_driving();
  setup.routes = routes_of_device(setup);
  RunData data;
  data.live.push_back(
      stream("device", std::make_shared<Device>(std::vector<Measurement>(), false)));
  const RunResult live = run_filter(setup, data);
  EXPECT_EQ(live.status, RunStatus::kFailed);
  EXPECT_EQ(live.cause, "nothing has come: no IMU sample arrived");
}

TEST(LiveFeed, EndsWithTheErrorOfItsSensor) {
  RunSetup setup = standing_then_driving();
  RunData data;
  data.live.push_back(
      stream("device", std::make_shared<BreakingDevice>(std::vector<Measurement>())));
  EXPECT_EQ(testing::error_of([&] { run_filter(setup, data); }), "the cable is out");
}

TEST(LiveFeed, EndsWithTheErrorOfItsSensorThoughThatCannotBeStopped) {
  class Broken final : public BreakingDevice {
   public:
    using BreakingDevice::BreakingDevice;
    void stop() override { throw InputError("and nobody listens"); }
  };
  RunSetup setup = standing_then_driving();
  RunData data;
  data.live.push_back(stream("device", std::make_shared<Broken>(std::vector<Measurement>())));
  EXPECT_EQ(testing::error_of([&] { run_filter(setup, data); }), "the cable is out");
}

TEST(LiveFeed, KeepsTheResultsOfASensorThatCannotBeStopped) {
  class Stubborn final : public Device {
   public:
    using Device::Device;
    void stop() override { throw InputError("nobody listens"); }
  };
  RunSetup setup = standing_then_driving();
  const RunData recorded = collect(setup);
  RunData data;
  setup.routes = routes_of_device(setup);
  data.live.push_back(
      stream("device", std::make_shared<Stubborn>(in_time_order(recorded.recorded), false)));
  const RunResult live = run_filter(setup, data);
  EXPECT_EQ(live.status, RunStatus::kOk) << live.cause;
  EXPECT_GT(live.estimate.size(), 10U);
  EXPECT_EQ(std::count(live.warnings.begin(), live.warnings.end(),
                       "a sensor could not be stopped: nobody listens"),
            1);
}

TEST(LiveFeed, KeepsTheResultsUpToTheErrorOfOneOfItsSensors) {
  RunSetup setup = standing_then_driving();
  const RunData recorded = collect(setup);
  RunData data;
  setup.routes = routes_of_device(setup, {{"silent", {}}});
  data.live.push_back(
      stream("device", std::make_shared<BreakingDevice>(in_time_order(recorded.recorded))));
  data.live.push_back(stream("silent", std::make_shared<Device>(std::vector<Measurement>(), true)));
  const RunResult live = run_filter(setup, data);
  EXPECT_EQ(live.status, RunStatus::kFailed);
  EXPECT_EQ(live.cause, "the cable is out");
  EXPECT_GT(live.estimate.size(), 10U);
}

}  // namespace
}  // namespace viwo

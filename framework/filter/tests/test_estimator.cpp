// When the estimator makes epochs, what it hands to the updates, and what it does with bad input.
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "filter_fixture.hpp"
#include "viwo/filter/estimator.hpp"

namespace viwo {
namespace {

using testing::camera_prior;
using testing::level_prior;
using testing::observation;
using testing::Random;
using testing::wheels_prior;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kStart = 1000 * kMs;

/// What one call of an update was given.
struct Seen {
  std::int64_t begin_ns, end_ns;
  std::vector<ImuSample> imu;
  std::vector<FeatureSample> features;
  std::vector<EncoderSample> encoders;
  std::vector<std::int64_t> clones;
  bool oldest_leaves;
};

/// Writes down what it is given, then does what the test wants.
class FakeUpdate final : public Update {
 public:
  using Emit = std::function<void(const FilterView&, FactorSink&)>;
  explicit FakeUpdate(Emit emit = {}) : emit_(std::move(emit)) {}
  UpdateKind kind() const override { return UpdateKind::kBody; }
  void start(const UpdateSetup& given) override { setup = given; }
  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override {
    Seen& now = seen.emplace_back();
    now.begin_ns = data.begin_ns;
    now.end_ns = data.end_ns;
    now.imu.assign(data.imu.begin(), data.imu.end());
    now.features.assign(data.features.begin(), data.features.end());
    now.encoders.assign(data.encoders.begin(), data.encoders.end());
    for (const CloneView& clone : filter.clones) now.clones.push_back(clone.t_ns);
    now.oldest_leaves = filter.oldest_leaves;
    if (emit_) emit_(filter, sink);
  }
  void rejections(std::vector<RejectionCount>& out) const override {
    out.push_back({"a reason of its own", 3, "there"});
  }

  UpdateSetup setup;
  std::vector<Seen> seen;

 private:
  Emit emit_;
};

/// Readings that are straight lines in time, so that interpolation is exact.
ImuSample imu_at(std::int64_t t_ns) {
  const double t = seconds_between(kStart, t_ns);
  return {t_ns, {0.1 * t, -0.2 * t, 0.3 + 0.05 * t}, {0.4 * t, 0.1, 9.81 - 0.2 * t}};
}

FeatureSample image_at(std::int64_t t_ns, int camera = 0) {
  return {t_ns, camera, {{7, 100. + camera, 50.}, {9, 200., 60.}}};
}

/// A cell of 10 ms that ends at `end_ns` in the wheel clock.
EncoderSample encoder_at(std::int64_t end_ns) {
  EncoderSample sample;
  sample.t_ns = end_ns - 5 * kMs;
  sample.begin_ns = end_ns - 10 * kMs;
  sample.end_ns = end_ns;
  sample.n_drive = 2;
  return sample;
}

/// An estimator with one fake update that sees the encoders, if there are any.
struct Rig {
  std::shared_ptr<FakeUpdate> update;
  Estimator estimator;

  explicit Rig(bool with_wheels = false, const FakeUpdate::Emit& emit = {},
               EstimatorOptions options = {}, double t_OtoI_s = 0.004)
      : update(std::make_shared<FakeUpdate>(emit)),
        estimator(options, {camera_prior()}, wheels(with_wheels, t_OtoI_s),
                  {{"fake", update, with_wheels ? 0 : -1}}) {
    estimator.start(level_prior(kStart));
  }

  static std::vector<WheelsPrior> wheels(bool with_wheels, double t_OtoI_s) {
    if (!with_wheels) return {};
    WheelsPrior prior = wheels_prior();
    prior.wheels.t_OtoI_s = t_OtoI_s;
    return {prior};
  }

  /// IMU samples every 10 ms of (from, to], ms after the start.
  void imu(std::int64_t from_ms, std::int64_t to_ms) {
    for (std::int64_t t = from_ms + 10; t <= to_ms; t += 10) {
      estimator.add(imu_at(kStart + t * kMs));
    }
  }
  void image(std::int64_t t_ms, int camera = 0) {
    estimator.add(image_at(kStart + t_ms * kMs, camera));
  }
  int steps() {
    int n = 0;
    while (estimator.step()) ++n;
    return n;
  }
  std::map<std::string, std::int64_t> rejected() const {
    std::map<std::string, std::int64_t> counts;
    for (const RejectionCount& r : estimator.rejections()) counts[r.reason] += r.count;
    counts.erase("fake: a reason of its own");
    return counts;
  }
};

using Counts = std::map<std::string, std::int64_t>;

void expect_same(const ImuSample& a, const ImuSample& b, double tolerance) {
  EXPECT_EQ(a.t_ns, b.t_ns);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(a.gyro_rad_per_s[i], b.gyro_rad_per_s[i], tolerance);
    EXPECT_NEAR(a.accel_m_per_s2[i], b.accel_m_per_s2[i], tolerance);
  }
}

TEST(Estimator, MakesEpochsAtImagesBetweenImuSamples) {
  Rig rig;
  rig.imu(-10, 400);
  for (const std::int64_t t : {113, 120, 124, 227, 339}) rig.image(t);
  EXPECT_EQ(rig.steps(), 5);
  std::int64_t last_ns = kStart;
  for (const Seen& seen : rig.update->seen) {
    EXPECT_EQ(seen.begin_ns, last_ns);
    ASSERT_GE(seen.imu.size(), 2u);
    EXPECT_EQ(seen.imu.front().t_ns, seen.begin_ns);
    EXPECT_EQ(seen.imu.back().t_ns, seen.end_ns);
    EXPECT_EQ(seen.clones.back(), seen.end_ns);
    for (std::size_t i = 0; i < seen.imu.size(); ++i) {
      if (i > 0) {
        EXPECT_LT(seen.imu[i - 1].t_ns, seen.imu[i].t_ns);
      }
      expect_same(seen.imu[i], imu_at(seen.imu[i].t_ns), 1e-12);
      // All samples in between are there, as they are.
      const bool inside = i > 0 && i + 1 < seen.imu.size();
      if (inside) {
        EXPECT_EQ(seen.imu[i].t_ns % (10 * kMs), 0);
      }
    }
    const std::int64_t first = seen.begin_ns / (10 * kMs), last = (seen.end_ns - 1) / (10 * kMs);
    EXPECT_EQ(static_cast<std::int64_t>(seen.imu.size()) - 2, last - first);
    ASSERT_EQ(seen.features.size(), 1u);
    EXPECT_EQ(seen.features[0].t_ns, seen.end_ns);
    EXPECT_EQ(seen.features[0].points[1].id, 9);
    last_ns = seen.end_ns;
  }
  EXPECT_EQ(last_ns, kStart + 339 * kMs);
  EXPECT_EQ(rig.estimator.epochs(), 5);
  EXPECT_EQ(rig.rejected(), Counts{});
}

TEST(Estimator, MovesTheStateAsOnePropagationOverTheWholeTimeWould) {
  Rig rig;
  rig.imu(-10, 300);
  for (const std::int64_t t : {57, 113, 200}) rig.image(t);
  EXPECT_EQ(rig.steps(), 3);
  ImuView expected = level_prior(kStart).state;
  std::vector<ImuSample> samples;
  for (std::int64_t t = 0; t <= 200; t += 10) samples.push_back(imu_at(kStart + t * kMs));
  propagate(samples, {}, 9.81, expected);
  EXPECT_LT((rig.estimator.filter().imu().R_GtoI - expected.R_GtoI).norm(), 1e-9);
  EXPECT_LT((rig.estimator.filter().imu().v_IinG - expected.v_IinG).norm(), 1e-7);
  EXPECT_LT((rig.estimator.filter().imu().p_IinG - expected.p_IinG).norm(), 1e-8);
}

TEST(Estimator, TakesImagesOfOneStampTogether) {
  Rig rig;
  rig.imu(-10, 100);
  rig.image(100, 0);
  EXPECT_EQ(rig.steps(), 0) << "the other camera's image may be on its way";
  rig.image(100, 1);
  EXPECT_EQ(rig.steps(), 0);
  rig.imu(100, 110);
  EXPECT_EQ(rig.steps(), 1);
  const Seen& seen = rig.update->seen.at(0);
  ASSERT_EQ(seen.features.size(), 2u);
  EXPECT_EQ(seen.features[0].camera, 0);
  EXPECT_EQ(seen.features[1].camera, 1);
  EXPECT_EQ(seen.features[1].points[0].u_px, 101.);
  rig.image(100, 2);
  EXPECT_EQ(rig.rejected(), (Counts{{"image at or before the present epoch", 1}}));
}

TEST(Estimator, StorageOfFormerImagesDoesNotLeakIntoLaterOnes) {
  Rig rig;
  rig.imu(-10, 400);
  FeatureSample many = image_at(kStart + 100 * kMs);
  many.points.resize(50);
  rig.estimator.add(many);
  FeatureSample none = image_at(kStart + 200 * kMs);
  none.points.clear();
  rig.estimator.add(none);
  rig.image(300);
  EXPECT_EQ(rig.steps(), 3);
  EXPECT_EQ(rig.update->seen[0].features[0].points.size(), 50u);
  EXPECT_EQ(rig.update->seen[1].features[0].points.size(), 0u);
  EXPECT_EQ(rig.update->seen[2].features[0].points.size(), 2u);
}

TEST(Estimator, WaitsForEncodersThatReachTheEpochInTheirOwnClock) {
  Rig rig(true);
  rig.imu(-10, 150);
  rig.image(100);
  EXPECT_EQ(rig.steps(), 0);
  // t_OtoI = 4 ms: the epoch is at 96 ms of the wheel clock.
  rig.estimator.add(encoder_at(kStart + 85 * kMs), 0);
  rig.estimator.add(encoder_at(kStart + 95 * kMs), 0);
  EXPECT_EQ(rig.steps(), 0);
  rig.estimator.add(encoder_at(kStart + 105 * kMs), 0);
  EXPECT_EQ(rig.steps(), 1);
  EXPECT_EQ(rig.update->seen[0].encoders.size(), 3u);
}

TEST(Estimator, WaitsForEncodersNotLongerThanItMay) {
  EstimatorOptions options;
  options.max_wait_s = 0.15;
  Rig rig(true, {}, options);
  rig.image(100);
  rig.imu(-10, 240);
  EXPECT_EQ(rig.steps(), 0);
  rig.imu(240, 260);
  EXPECT_EQ(rig.steps(), 1);
  EXPECT_TRUE(rig.update->seen[0].encoders.empty());
}

TEST(Estimator, DoesNotTakeTheWheelClockForItsOwn) {
  // The wheel clock is ten seconds ahead: nothing can be said from its stamps alone.
  Rig rig(true, {}, {}, -10.);
  rig.imu(-10, 100);
  rig.image(100, 0);
  const std::int64_t ahead = kStart + 10'000 * kMs;
  for (std::int64_t t = 10; t <= 100; t += 10) rig.estimator.add(encoder_at(ahead + t * kMs), 0);
  EXPECT_EQ(rig.steps(), 0) << "nothing yet is later than the image";
  rig.image(100, 1);
  rig.imu(100, 110);
  EXPECT_EQ(rig.steps(), 1);
  EXPECT_EQ(rig.update->seen[0].features.size(), 2u);
  EXPECT_EQ(rig.rejected(), Counts{});
}

TEST(Estimator, KeepsEveryEncoderSampleSinceTheOldestClone) {
  EstimatorOptions options;
  options.filter.clones = 4;
  Rig rig(true, {}, options);
  std::size_t most = 0;
  for (std::int64_t t = 10; t <= 8000; t += 10) {
    if (t == 10) rig.imu(-10, 0);
    rig.estimator.add(imu_at(kStart + t * kMs));
    rig.estimator.add(encoder_at(kStart + t * kMs), 0);
    if (t % 100 == 0) rig.image(t);
    rig.steps();
  }
  ASSERT_EQ(rig.update->seen.size(), 79u);
  for (const Seen& seen : rig.update->seen) {
    ASSERT_FALSE(seen.encoders.empty());
    const std::int64_t offset_ns = 4 * kMs;
    if (seen.clones.front() - offset_ns > kStart) {
      EXPECT_LE(seen.encoders.front().begin_ns, seen.clones.front() - offset_ns);
    }
    EXPECT_GE(seen.encoders.back().end_ns, seen.end_ns - offset_ns);
    for (std::size_t i = 1; i < seen.encoders.size(); ++i) {
      EXPECT_EQ(seen.encoders[i].begin_ns, seen.encoders[i - 1].end_ns);
    }
    most = std::max(most, seen.encoders.size());
  }
  EXPECT_LT(most, 200u) << "what is not needed any more goes";
}

TEST(Estimator, MakesEpochsInDarkness) {
  EstimatorOptions options;
  options.max_epoch_s = 0.2;
  Rig rig(false, {}, options);
  rig.imu(-10, 1000);
  rig.image(450);
  EXPECT_EQ(rig.steps(), 5);
  std::vector<std::int64_t> ends;
  std::vector<std::size_t> images;
  for (const Seen& seen : rig.update->seen) {
    ends.push_back((seen.end_ns - kStart) / kMs);
    images.push_back(seen.features.size());
  }
  EXPECT_EQ(ends, (std::vector<std::int64_t>{200, 400, 450, 650, 850}));
  EXPECT_EQ(images, (std::vector<std::size_t>{0, 0, 1, 0, 0}));
}

TEST(Estimator, CountsWhatItCannotUse) {
  Rig rig(true);
  rig.imu(-10, 100);
  const std::int64_t t = kStart + 100 * kMs;
  ImuSample sample = imu_at(t + 5 * kMs);
  sample.gyro_rad_per_s[2] = kNaN;
  rig.estimator.add(sample);
  sample = imu_at(t + 5 * kMs);
  sample.accel_m_per_s2[0] = std::numeric_limits<double>::infinity();
  rig.estimator.add(sample);
  rig.estimator.add(imu_at(t));
  rig.estimator.add(imu_at(t - 1));
  rig.estimator.add(imu_at(t + 51 * kMs));
  rig.image(0);
  rig.image(90);
  rig.image(80);
  EncoderSample encoder = encoder_at(t);
  encoder.drive_rad_per_s[1] = kNaN;
  rig.estimator.add(encoder, 0);
  encoder = encoder_at(t);
  encoder.steer_rad[0] = kNaN;
  rig.estimator.add(encoder, 0);
  encoder = encoder_at(t);
  std::swap(encoder.begin_ns, encoder.end_ns);
  rig.estimator.add(encoder, 0);
  rig.estimator.add(encoder_at(t), 0);
  rig.estimator.add(encoder_at(t + 9 * kMs), 0);
  EXPECT_EQ(rig.rejected(), (Counts{{"IMU value that is not finite", 2},
                                    {"IMU stamp not after the last", 2},
                                    {"gap of the IMU bridged", 1},
                                    {"image at or before the present epoch", 1},
                                    {"image before the last one", 1},
                                    {"encoder value that is not finite", 2},
                                    {"encoder sample that ends before it begins", 1},
                                    {"encoder sample that begins before the end of the last", 1}}));
  const RejectionCount first = rig.estimator.rejections().front();
  EXPECT_EQ(first.first, "stamp 1105000000 ns");
  EXPECT_EQ(rig.steps(), 1);
  for (const ImuSample& used : rig.update->seen[0].imu) {
    expect_same(used, imu_at(used.t_ns), 1e-12);
  }
  EXPECT_EQ(rig.update->seen[0].encoders.size(), 1u);
  EXPECT_EQ(rig.estimator.failure(), "");
}

TEST(Estimator, GapOfTheImuAsLongAsAllowedIsNotCounted) {
  Rig rig;
  rig.imu(-10, 100);
  rig.estimator.add(imu_at(kStart + 150 * kMs));
  EXPECT_EQ(rig.rejected(), Counts{});
}

TEST(Estimator, BridgesAGapOfTheImuThatIsLongerThanAnEpoch) {
  Rig rig;
  rig.imu(-10, 100);
  rig.imu(900, 1000);
  for (const std::int64_t t : {100, 200, 700, 950}) rig.image(t);
  EXPECT_EQ(rig.steps(), 5);  // one of them in darkness, 250 ms after the image of 200 ms
  std::int64_t last_ns = kStart;
  for (const Seen& seen : rig.update->seen) {
    EXPECT_EQ(seen.begin_ns, last_ns);
    EXPECT_EQ(seen.imu.front().t_ns, seen.begin_ns);
    EXPECT_EQ(seen.imu.back().t_ns, seen.end_ns);
    for (const ImuSample& sample : seen.imu) expect_same(sample, imu_at(sample.t_ns), 1e-12);
    last_ns = seen.end_ns;
  }
  EXPECT_EQ(rig.rejected(), (Counts{{"gap of the IMU bridged", 1}}));
}

TEST(Estimator, HoldsTheFirstReadingOfAnImuThatBeginsAfterTheStart) {
  Rig rig;
  rig.imu(40, 200);  // the first one at 50 ms
  rig.image(45);
  rig.image(113);
  EXPECT_EQ(rig.steps(), 2);
  const ImuSample first = imu_at(kStart + 50 * kMs);
  const auto expect_held = [&](const ImuSample& sample, std::int64_t t_ms) {
    ImuSample expected = first;
    expected.t_ns = kStart + t_ms * kMs;
    expect_same(sample, expected, 1e-12);
  };
  const auto& dark = rig.update->seen[0].imu;
  ASSERT_EQ(dark.size(), 2u);
  expect_held(dark[0], 0);
  expect_held(dark[1], 45);
  const auto& then = rig.update->seen[1].imu;
  ASSERT_EQ(then.size(), 9u);
  expect_held(then[0], 45);
  expect_held(then[1], 50);
  expect_same(then.back(), imu_at(kStart + 113 * kMs), 1e-12);
}

TEST(Estimator, DoesNothingWithoutMeasurementsOrWithoutAnImu) {
  Rig rig;
  EXPECT_FALSE(rig.estimator.step());
  rig.image(100);
  EXPECT_FALSE(rig.estimator.step());
  rig.estimator.finish();
  EXPECT_FALSE(rig.estimator.step());
  EXPECT_EQ(rig.estimator.epochs(), 0);
  EXPECT_EQ(rig.estimator.failure(), "");
  EXPECT_TRUE(rig.update->seen.empty());
}

TEST(Estimator, FinishingDoesWhatWaitedForOthers) {
  Rig rig(true);
  rig.imu(-10, 110);
  rig.image(60);
  rig.image(110, 0);
  EXPECT_EQ(rig.steps(), 0);
  rig.estimator.finish();
  EXPECT_EQ(rig.steps(), 2);
  EXPECT_EQ(rig.update->seen.back().end_ns, kStart + 110 * kMs);
}

TEST(Estimator, NamesTheUpdateThatThrew) {
  const auto failure_of = [](const FakeUpdate::Emit& emit) -> std::string {
    Rig rig(false, emit);
    rig.imu(-10, 200);
    rig.image(100);
    try {
      rig.steps();
    } catch (const UpdateFailure& failure) {
      return failure.what();
    }
    return "(nothing thrown)";
  };
  EXPECT_EQ(failure_of([](auto&, auto&) { throw std::runtime_error("no wheels here"); }),
            "update 'fake' failed: no wheels here");
  EXPECT_EQ(failure_of([](auto&, auto&) { throw 42; }),
            "update 'fake' failed: threw something that is not a std::exception");
  EXPECT_EQ(failure_of([](auto&, FactorSink& sink) {
              for (;;) sink.add_residual();
            }).substr(0, 22),
            "update 'fake' failed: ");
}

TEST(Estimator, CountsFactorsAndWhatUpdatesCountThemselves) {
  Rig rig(false, [](const FilterView&, FactorSink& sink) {
    sink.count(5, 2);
    sink.add_residual() = observation(kPositionColumn, Eigen::Vector3d::Zero(), 1.);
    sink.add_residual() = observation(kPositionColumn, Eigen::Vector3d::Zero(), 1.);
    ResidualFactor& outlier = sink.add_residual();
    outlier = observation(kPositionColumn, Eigen::Vector3d::Constant(1e3), 0.1);
    outlier.gate_probability = 0.01;
    sink.add_residual() = observation(kPositionColumn, Eigen::Vector3d::Constant(kNaN), 1.);
  });
  rig.imu(-10, 300);
  for (const std::int64_t t : {100, 200}) rig.image(t);
  EXPECT_EQ(rig.steps(), 2);
  EXPECT_EQ(rig.estimator.counts()[0].applied, 2 * (5 + 2));
  EXPECT_EQ(rig.estimator.counts()[0].rejected, 2 * (2 + 2));
  EXPECT_LT(rig.estimator.filter().imu().p_IinG.norm(), 1.);
  EXPECT_EQ(rig.estimator.updates()[0].name, "fake");
  EXPECT_EQ(rig.estimator.rejections().back().reason, "fake: a reason of its own");
  EXPECT_EQ(rig.estimator.rejections().back().count, 3);
}

TEST(Estimator, CountsInformationThatIsNotFinite) {
  Rig rig(false, [](const FilterView&, FactorSink& sink) {
    InformationFactor& factor = sink.add_information();
    factor.columns.add(0, 3);
    factor.Lambda.topLeftCorner(3, 3).setConstant(kNaN);
    factor.eta.head(3).setZero();
  });
  rig.imu(-10, 200);
  rig.image(100);
  EXPECT_EQ(rig.steps(), 1);
  EXPECT_EQ(rig.rejected(), (Counts{{"fake: information that is not finite or empty", 1}}));
  EXPECT_EQ(rig.estimator.failure(), "");
}

TEST(Estimator, NamesTheStagesInTheOrderTheyRun) {
  const auto first = std::make_shared<FakeUpdate>(), second = std::make_shared<FakeUpdate>();
  Estimator estimator({}, {}, {}, {{"one", first, -1}, {"two", second, -1}});
  EXPECT_EQ(estimator.stage_names(),
            (std::vector<std::string>{"propagate", "one", "two", "marginalise"}));
  ASSERT_EQ(estimator.stage_ms().size(), 4u);
  estimator.start(level_prior(kStart));
  for (std::int64_t t = 0; t <= 300; t += 10) estimator.add(imu_at(kStart + t * kMs));
  ASSERT_TRUE(estimator.step());
  for (const double ms : estimator.stage_ms()) EXPECT_GT(ms, 0.);
  EXPECT_EQ(first->seen.size(), 1u);
  EXPECT_EQ(second->seen.size(), 1u);
}

TEST(Estimator, TellsUpdatesWhatTheStateLooksLike) {
  EstimatorOptions options;
  options.filter.clones = 5;
  const Rig rig(true, {}, options);
  EXPECT_EQ(rig.update->setup.max_clones, 6);
  EXPECT_EQ(rig.update->setup.max_state_size, rig.estimator.filter().size());
  EXPECT_EQ(rig.update->setup.cameras.data(), rig.estimator.filter().cameras().data());
  EXPECT_EQ(rig.update->setup.wheels, &rig.estimator.filter().wheels()[0]);
  EXPECT_EQ(Rig(false).update->setup.wheels, nullptr);
}

TEST(Estimator, DropsTheOldestCloneWhenTheWindowIsFull) {
  EstimatorOptions options;
  options.filter.clones = 3;
  Rig rig(false, {}, options);
  rig.imu(-10, 700);
  for (std::int64_t t = 100; t <= 600; t += 100) rig.image(t);
  EXPECT_EQ(rig.steps(), 6);
  for (std::size_t k = 0; k < 6; ++k) {
    const Seen& seen = rig.update->seen[k];
    EXPECT_EQ(seen.clones.size(), std::min<std::size_t>(k + 1, 4));
    EXPECT_EQ(seen.oldest_leaves, k >= 3);
    EXPECT_EQ(seen.clones.front(), kStart + (k < 4 ? 100 : 100 * (static_cast<int>(k) - 2)) * kMs);
  }
  EXPECT_EQ(rig.estimator.filter().clones().size(), 3u);
}

TEST(Estimator, FactorsOfOneCallAreOneJointUpdate) {
  Random random(11);
  const auto linear = [](const Eigen::MatrixXd& H, const Eigen::VectorXd& r) {
    ResidualFactor factor;
    factor.columns.add(kPositionColumn, 6);  // position and velocity add: exactly linear
    factor.set_rows(static_cast<int>(r.size()));
    factor.H = H;
    factor.residual = r;
    factor.R.setIdentity();
    factor.R *= 1e-4;
    return factor;
  };
  const Eigen::MatrixXd H1 = random.matrix(2, 6), H2 = random.matrix(3, 6), A = random.matrix(4, 6);
  const Eigen::VectorXd r1 = random.matrix(2, 1), r2 = random.matrix(3, 1),
                        ra = random.matrix(4, 1);
  Eigen::VectorXd before, expected;
  const auto pv = [](const FilterView& view) {
    Eigen::VectorXd x(6);
    x << view.imu.p_IinG, view.imu.v_IinG;
    return x;
  };
  Rig rig(false, [&](const FilterView& view, FactorSink& sink) {
    sink.add_residual() = linear(H1, r1);
    sink.add_residual() = linear(H2, r2);
    InformationFactor& information = sink.add_information();
    information.columns.add(kPositionColumn, 6);
    information.Lambda.setConstant(kNaN);  // only the lower triangle is read
    information.Lambda.topLeftCorner(6, 6).triangularView<Eigen::Lower>() = A.transpose() * A * 1e4;
    information.eta.head(6) = A.transpose() * ra * 1e4;
    Eigen::MatrixXd H(9, 6);
    H << H1, H2, A;
    Eigen::VectorXd r(9);
    r << r1, r2, ra;
    const Eigen::MatrixXd P = view.P().block(kPositionColumn, kPositionColumn, 6, 6);
    const Eigen::MatrixXd S = H * P * H.transpose() + 1e-4 * Eigen::MatrixXd::Identity(9, 9);
    before = pv(view);
    expected = before + P * H.transpose() * S.inverse() * r;
  });
  rig.imu(-10, 200);
  rig.image(100);
  ASSERT_EQ(rig.steps(), 1);
  EXPECT_GT((expected - before).norm(), 0.1);
  EXPECT_LT((pv(rig.estimator.filter().view(-1)) - expected).norm(), 1e-9);
}

TEST(Estimator, AsksTheInitializerUntilItFindsAStart) {
  const auto update = std::make_shared<FakeUpdate>();
  Estimator estimator({}, {camera_prior()}, {}, {{"fake", update, -1}});
  int asked = 0;
  estimator.start([&](auto imu, auto) -> std::optional<ImuPrior> {
    ++asked;
    if (imu.size() < 21) return std::nullopt;
    return level_prior(imu.back().t_ns);
  });
  for (std::int64_t t = 0; t <= 400; t += 10) {
    estimator.add(imu_at(kStart + t * kMs));
    if (t % 50 == 0) estimator.add(image_at(kStart + t * kMs));
    estimator.step();
  }
  EXPECT_EQ(asked, 21);
  ASSERT_EQ(update->seen.size(), 3u);  // 250, 300, 350: nothing is later than the last image
  EXPECT_EQ(update->seen[0].begin_ns, kStart + 200 * kMs);
  EXPECT_EQ(update->seen[0].end_ns, kStart + 250 * kMs);
  ASSERT_EQ(estimator.rejections().size(), 2u);
  // 0, 50, 100, 150 before the start; that of 200 came when the filter had just begun.
  EXPECT_EQ(estimator.rejections()[0].reason, "image before the start");
  EXPECT_EQ(estimator.rejections()[0].count, 5);
}

TEST(Estimator, StopsWhenTheFilterHasDiverged) {
  Rig rig(false, [](const FilterView&, FactorSink& sink) {
    ResidualFactor factor = observation(kPositionColumn, Eigen::VectorXd::Constant(1, 1e308), 1e-9);
    factor.H(0, 0) = 0.1;
    sink.add_residual() = factor;
  });
  rig.imu(-10, 500);
  for (const std::int64_t t : {100, 200, 300}) rig.image(t);
  EXPECT_EQ(rig.steps(), 1);
  EXPECT_EQ(rig.estimator.failure(), "the estimate or its covariance is not finite any more");
  EXPECT_EQ(rig.estimator.epochs(), 1);
}

/// State and covariance after a run with pseudo-random measurements and factors.
std::pair<Eigen::VectorXd, Eigen::MatrixXd> random_run() {
  Random random(12);
  EstimatorOptions options;
  options.filter.clones = 4;
  Rig rig(
      true,
      [&](const FilterView& view, FactorSink& sink) {
        ResidualFactor& factor = sink.add_residual();
        factor.columns.add(0, kImuSize);
        factor.columns.add(view.clones.front().column, kPoseSize);
        factor.columns.add(view.wheels->extrinsics_column, 10);
        factor.set_rows(4);
        factor.H = random.matrix(4, factor.columns.size());
        factor.residual = 0.01 * random.matrix(4, 1);
        factor.R.setIdentity();
      },
      options);
  for (std::int64_t t = 0; t <= 2000; t += 10) {
    ImuSample sample = testing::imu_sample(kStart + t * kMs, random);
    rig.estimator.add(sample);
    rig.estimator.add(encoder_at(kStart + t * kMs), 0);
    if (t % 70 == 35) rig.image(t);
    rig.steps();
  }
  const Filter& filter = rig.estimator.filter();
  Eigen::VectorXd state(15);
  state << filter.imu().p_IinG, filter.imu().v_IinG, filter.imu().R_GtoI.row(0).transpose(),
      filter.imu().gyro_bias, filter.wheels()[0].p_IinO;
  return {state, filter.covariance()};
}

TEST(Estimator, GivesTheSameBitsTwiceInARow) {
  const auto first = random_run(), second = random_run();
  EXPECT_EQ(first.first, second.first);
  EXPECT_EQ(first.second, second.second);
  EXPECT_TRUE(first.first.allFinite());
}

}  // namespace
}  // namespace viwo

// Measurements that come late, never, in the wrong order or broken.
#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "estimator_fixture.hpp"
#include "viwo/filter/estimator.hpp"

namespace viwo {
namespace {

using testing::camera_prior;
using testing::Counts;
using testing::encoder_at;
using testing::expect_same;
using testing::FakeUpdate;
using testing::image_at;
using testing::imu_at;
using testing::kMs;
using testing::kNaN;
using testing::kStart;
using testing::level_prior;
using testing::Rig;
using testing::Seen;

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

TEST(Estimator, AsksTheInitializerUntilItFindsAStart) {
  const auto update = std::make_shared<FakeUpdate>();
  Estimator estimator({}, {camera_prior()}, {}, {{"fake", update, -1}});
  int asked = 0;
  estimator.start([&](auto imu, auto) -> StartAttempt {
    ++asked;
    if (imu.size() < 21) return no_start(imu.size() < 6 ? "far too short" : "too short");
    return {level_prior(imu.back().t_ns), {}};
  });
  for (std::int64_t t = 0; t <= 400; t += 10) {
    estimator.add(imu_at(kStart + t * kMs));
    if (t % 50 == 0) estimator.add(image_at(kStart + t * kMs));
    estimator.step();
  }
  EXPECT_EQ(asked, 5);  // every 50 ms
  ASSERT_EQ(estimator.start_obstacles().size(), 2u);
  EXPECT_EQ(estimator.start_obstacles()[0].text, "far too short");
  EXPECT_EQ(estimator.start_obstacles()[0].count, 1);
  EXPECT_EQ(estimator.start_obstacles()[1].text, "too short");
  EXPECT_EQ(estimator.start_obstacles()[1].count, 3);
  ASSERT_EQ(update->seen.size(), 3u);  // 250, 300, 350: nothing is later than the last image
  EXPECT_EQ(update->seen[0].begin_ns, kStart + 200 * kMs);
  EXPECT_EQ(update->seen[0].end_ns, kStart + 250 * kMs);
  ASSERT_EQ(estimator.rejections().size(), 2u);
  // 0, 50, 100, 150 before the start; that of 200 came when the filter had just begun.
  EXPECT_EQ(estimator.rejections()[0].reason, "image before the start");
  EXPECT_EQ(estimator.rejections()[0].count, 5);
}

TEST(Estimator, ForgetsWhatNoStartLooksAtWhileItWaitsForOne) {
  const auto update = std::make_shared<FakeUpdate>();
  Estimator estimator({}, {camera_prior()}, {}, {{"fake", update, -1}});
  std::size_t most = 0;
  double least_s = 1e9;
  estimator.start([&](auto imu, auto) -> StartAttempt {
    most = std::max(most, imu.size());
    const double s = seconds_between(imu.front().t_ns, imu.back().t_ns);
    if (imu.back().t_ns > kStart + 200'000 * kMs) least_s = std::min(least_s, s);
    return no_start("never");
  });
  for (std::int64_t t = 0; t <= 600'000; t += 100) {
    estimator.add(imu_at(kStart + t * kMs));
    if (t % 1000 == 0) estimator.add(image_at(kStart + t * kMs));
    EXPECT_FALSE(estimator.step());
  }
  EXPECT_LE(most, 1202U);
  EXPECT_GE(least_s, 59.9);
  ASSERT_EQ(estimator.rejections().size(), 3U);
  EXPECT_EQ(estimator.rejections()[0].reason, "gap of the IMU bridged");
  EXPECT_EQ(estimator.rejections()[1].reason, "image before the start");
  EXPECT_GT(estimator.rejections()[1].count, 400);
}

TEST(Estimator, TakesBothImagesOfAnInstantWhateverTheClockOfTheWheels) {
  // Cameras that are triggered with the IMU; in the order of the stamps the wheels are in between.
  for (const double t_OtoI_s : {-0.02, 0., 0.02}) {
    const auto update = std::make_shared<FakeUpdate>();
    WheelsPrior wheels = testing::wheels_prior();
    wheels.wheels.t_OtoI_s = t_OtoI_s;
    Estimator estimator({}, {camera_prior(), camera_prior()}, {wheels}, {{"fake", update, 0}});
    estimator.start(level_prior(kStart));
    for (std::int64_t t = 0; t <= 500; t += 10) {
      const auto step = [&] {
        while (estimator.step()) {
        }
      };
      estimator.add(imu_at(kStart + t * kMs));
      step();
      estimator.add(encoder_at(kStart + t * kMs), 0);
      step();
      for (const int camera : {0, 1}) {
        if (t % 100 == 0 && t > 0) estimator.add(image_at(kStart + t * kMs, camera));
        step();
      }
    }
    ASSERT_EQ(update->seen.size(), 4U) << t_OtoI_s;
    for (const Seen& seen : update->seen) EXPECT_EQ(seen.features.size(), 2U) << t_OtoI_s;
  }
}

TEST(Estimator, IsNotSpoiltByAStampInTheFuture) {
  Rig rig(true);
  rig.imu(-10, 0);
  rig.image(3'600'000);
  rig.estimator.add(encoder_at(kStart + 3'600'000 * kMs), 0);
  for (std::int64_t t = 10; t <= 300; t += 10) {
    rig.imu(t - 10, t);
    rig.estimator.add(encoder_at(kStart + t * kMs), 0);
    if (t % 100 == 0) rig.image(t);
    rig.steps();
  }
  ASSERT_EQ(rig.update->seen.size(), 2U);
  EXPECT_EQ(rig.update->seen[1].features.size(), 1U);
  EXPECT_GT(rig.update->seen[1].encoders.size(), 15U);
  EXPECT_EQ(rig.rejected(), (Counts{{"image more than 10 s ahead of the IMU", 1},
                                    {"encoder sample more than 10 s ahead of the IMU", 1}}));
}

TEST(Estimator, OfLiveMeasurementsWaitsForTheImageOfTheOtherCamera) {
  const auto images_of_epoch = [](bool second_comes, std::int64_t imu_until_ms) {
    EstimatorOptions options;
    options.max_image_wait_s = 0.05;
    const auto update = std::make_shared<FakeUpdate>();
    Estimator estimator(options, {camera_prior(), camera_prior()}, {}, {{"fake", update, -1}});
    estimator.start(level_prior(kStart));
    // Tracking takes time: the IMU is ahead when the images come.
    for (std::int64_t t = 0; t <= imu_until_ms; t += 10) estimator.add(imu_at(kStart + t * kMs));
    estimator.add(image_at(kStart + 100 * kMs, 0));
    estimator.step();
    if (second_comes) estimator.add(image_at(kStart + 100 * kMs, 1));
    estimator.step();
    return update->seen.empty() ? 0U : update->seen.front().features.size();
  };
  EXPECT_EQ(images_of_epoch(true, 120), 2U);   // at once when both are there
  EXPECT_EQ(images_of_epoch(false, 120), 0U);  // waits
  EXPECT_EQ(images_of_epoch(false, 160), 1U);  // but not for ever
}

}  // namespace
}  // namespace viwo

// Spikes of an IMU within its range: readings that are gone with the next one.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "estimator_fixture.hpp"
#include "viwo/estimator/imu_buffer.hpp"

namespace viwo {
namespace {

using testing::Counts;
using testing::kMs;
using testing::kStart;

constexpr const char* kSpike = "imu: spike, gone with the next reading";

/// Readings of 200 Hz with noise, to which something is added.
struct Shaken {
  ImuBuffer buffer{ImuLimits{}};
  Rejections rejections;
  testing::Random random{3};
  double scatter = 0.03;  ///< m/s^2; of the gyro a hundredth, rad/s
  std::int64_t n = 0;

  ImuSample next(double accel = 0., double gyro = 0.) {
    ImuSample sample;
    sample.t_ns = kStart + n++ * 5 * kMs;
    for (std::size_t i = 0; i < 3; ++i) {
      sample.gyro_rad_per_s[i] = 0.01 * scatter * random.normal();
      sample.accel_m_per_s2[i] = scatter * random.normal();
    }
    sample.accel_m_per_s2[0] += accel;
    sample.gyro_rad_per_s[1] += gyro;
    return sample;
  }
  void give(double accel = 0., double gyro = 0.) { buffer.add(next(accel, gyro), rejections); }
  void rest(int count = 200) {
    for (int i = 0; i < count; ++i) give();
  }
  std::int64_t left_out() const {
    std::int64_t count = 0;
    for (const RejectionCount& r : rejections.counts()) {
      EXPECT_EQ(r.reason, kSpike);
      count += r.count;
    }
    return count;
  }
};

TEST(ImuSpikes, AreLeftOutWhenTheNextReadingDoesNotConfirmThem) {
  for (const double accel : {150., -150., 8.}) {
    Shaken imu;
    imu.rest();
    imu.give(accel);
    EXPECT_EQ(imu.buffer.newest_ns(), kStart + 199 * 5 * kMs) << "it waits for the next";
    imu.give();
    EXPECT_EQ(imu.buffer.newest_ns(), kStart + 201 * 5 * kMs);
    EXPECT_EQ(imu.left_out(), 1) << accel;
    EXPECT_EQ(imu.rejections.counts()[0].first, stamp_text(kStart + 200 * 5 * kMs));
    EXPECT_EQ(imu.buffer.samples().size(), 201U);
  }
  Shaken gyro;
  gyro.rest();
  gyro.give(0., -2.);
  gyro.rest();
  EXPECT_EQ(gyro.left_out(), 1);
}

TEST(ImuSpikes, OneAfterTheOtherAreEachLeftOut) {
  Shaken imu;
  imu.rest();
  for (int i = 0; i < 20; ++i) {
    imu.give(i % 2 == 0 ? 50. : -50., 5.);
    imu.give();
  }
  EXPECT_EQ(imu.left_out(), 20);
}

TEST(ImuSpikes, WaitForNothingAtTheEnd) {
  Shaken imu;
  imu.rest();
  imu.give(150.);
  imu.buffer.finish(imu.rejections);
  EXPECT_EQ(imu.left_out(), 1);
  imu.buffer.finish(imu.rejections);
  EXPECT_EQ(imu.left_out(), 1);
}

TEST(ImuSpikes, AreNotShocksOfTwoReadings) {
  for (const double second : {150., 75., -60.}) {
    Shaken imu;
    imu.rest();
    imu.give(150.);
    imu.give(second);
    imu.rest();
    EXPECT_EQ(imu.left_out(), 0) << second;
    EXPECT_EQ(imu.buffer.samples().size(), 402U);
  }
}

TEST(ImuSpikes, AreNotStepsNorWhatSwings) {
  Shaken step;
  step.rest();
  for (int i = 0; i < 100; ++i) step.give(30.);
  step.rest();
  EXPECT_EQ(step.left_out(), 0);
  // The fastest that can be told: one reading up, the next one down.
  Shaken swing;
  swing.rest();
  for (int i = 0; i < 200; ++i) swing.give(i % 2 == 0 ? 40. : -40., i % 2 == 0 ? -3. : 3.);
  swing.rest();
  EXPECT_EQ(swing.left_out(), 0);
}

TEST(ImuSpikes, AreNotNoiseHoweverMuchItIs) {
  for (const double scatter : {0.03, 3., 30.}) {
    Shaken imu;
    imu.scatter = scatter;
    imu.rest(20'000);
    EXPECT_EQ(imu.left_out(), 0) << scatter;
  }
}

/// The first reading may look like one. (Of 150 such begins 4 did.)
TEST(ImuSpikes, AreNotNoiseThatSetsIn) {
  for (const double scatter : {3., 30.}) {
    Shaken imu;
    imu.rest();
    imu.scatter = scatter;
    imu.rest(2000);
    imu.scatter = 0.03;
    imu.rest(2000);
    EXPECT_LE(imu.left_out(), 1) << scatter;
  }
}

TEST(ImuSpikes, AreKnownOnceItIsKnownWhatIsUsual) {
  Shaken imu;
  imu.rest(50);
  imu.give(150.);
  imu.rest();
  EXPECT_EQ(imu.left_out(), 0);
  imu.rest(1000);
  imu.give(150.);
  imu.rest();
  EXPECT_EQ(imu.left_out(), 1);
}

TEST(ImuSpikes, AreNotTheFirstReadingAfterAGap) {
  Shaken imu;
  imu.rest();
  imu.n += 100;
  imu.give(150.);
  imu.give(150.);
  imu.give(150.);
  EXPECT_EQ(imu.buffer.samples().size(), 203U);
}

}  // namespace
}  // namespace viwo

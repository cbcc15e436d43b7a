// Readings of the IMU: their order, what is cut out of them, what is forgotten.
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "estimator_fixture.hpp"
#include "viwo/estimator/imu_buffer.hpp"

namespace viwo {
namespace {

using testing::Counts;
using testing::expect_same;
using testing::imu_at;
using testing::kMs;
using testing::kNaN;
using testing::kStart;

/// Readings at these times, ms after the start; longest gap 50 ms.
struct ImuBench {
  ImuBuffer buffer{ImuLimits{}};
  Rejections rejections;

  explicit ImuBench(const std::vector<std::int64_t>& t_ms) {
    for (const std::int64_t t : t_ms) buffer.add(imu_at(kStart + t * kMs), rejections);
  }
  Counts rejected() const { return testing::counts_of(rejections); }
  /// Times of a cut, ms; its readings are those of the straight lines.
  std::vector<std::int64_t> cut(std::int64_t begin_ms, std::int64_t end_ms) {
    std::vector<std::int64_t> t_ms;
    for (const ImuSample& sample : buffer.cut(kStart + begin_ms * kMs, kStart + end_ms * kMs)) {
      t_ms.push_back((sample.t_ns - kStart) / kMs);
      expect_same(sample, imu_at(sample.t_ns), 1e-12);
    }
    return t_ms;
  }
};

using Times = std::vector<std::int64_t>;

TEST(ImuBuffer, RefusesReadingsThatAreNotFiniteOrNotLater) {
  ImuBench bench({0, 10, 10, 5, 20});
  ImuSample broken = imu_at(kStart + 30 * kMs);
  broken.accel_m_per_s2[1] = kNaN;
  bench.buffer.add(broken, bench.rejections);
  EXPECT_EQ(bench.rejected(),
            (Counts{{"imu: stamp not after the last", 2}, {"imu: value that is not finite", 1}}));
  EXPECT_EQ(bench.buffer.newest_ns(), kStart + 20 * kMs);
  EXPECT_EQ(bench.buffer.samples().size(), 3u);
}

TEST(ImuBuffer, LeavesOutAnImuThatIsStuck) {
  ImuBench bench({});
  testing::Random random(1);
  const auto noisy_at = [&random](std::int64_t t_ms) {
    ImuSample sample = imu_at(kStart + t_ms * kMs);
    sample.gyro_rad_per_s[2] += 0.01 * random.normal();
    return sample;
  };
  std::int64_t t = 0;
  for (; t < 600; t += 5) bench.buffer.add(noisy_at(t), bench.rejections);
  ImuSample stuck = noisy_at(t);
  for (; t < 1000; t += 5) {
    stuck.t_ns = kStart + t * kMs;
    bench.buffer.add(stuck, bench.rejections);
  }
  // Eleven readings are believed of the 80, then what is left out is a gap.
  EXPECT_EQ(bench.buffer.newest_ns(), kStart + 650 * kMs);
  bench.buffer.add(noisy_at(t), bench.rejections);
  EXPECT_EQ(bench.rejected(), (Counts{{"imu: stuck, the same reading again and again", 69},
                                      {"imu: gap bridged", 1}}));
  // One without noise may say the same for ever, also after a motion.
  ImuBench noiseless({});
  for (t = 0; t < 600; t += 5) noiseless.buffer.add(imu_at(kStart + t * kMs), noiseless.rejections);
  for (; t < 1000; t += 5) {
    stuck.t_ns = kStart + t * kMs;
    noiseless.buffer.add(stuck, noiseless.rejections);
  }
  EXPECT_EQ(noiseless.rejected(), Counts{});
}

TEST(ImuBuffer, CountsGapsThatAreLongerThanAllowed) {
  EXPECT_EQ(ImuBench({0, 50, 100}).rejected(), Counts{});
  EXPECT_EQ(ImuBench({0, 51, 102}).rejected(), (Counts{{"imu: gap bridged", 2}}));
}

TEST(ImuBuffer, CutsAtReadingsAndBetweenThem) {
  ImuBench bench({0, 10, 20, 30, 40});
  EXPECT_EQ(bench.cut(10, 30), (Times{10, 20, 30}));
  EXPECT_EQ(bench.cut(13, 37), (Times{13, 20, 30, 37}));
  EXPECT_EQ(bench.cut(13, 17), (Times{13, 17})) << "both between the same two";
  EXPECT_EQ(bench.cut(10, 17), (Times{10, 17}));
  EXPECT_EQ(bench.cut(13, 40), (Times{13, 20, 30, 40}));
}

TEST(ImuBuffer, HoldsItsFirstReadingBeforeIt) {
  ImuBench bench({50, 60});
  const auto cut = bench.buffer.cut(kStart, kStart + 55 * kMs);
  ASSERT_EQ(cut.size(), 3u);
  ImuSample held = imu_at(kStart + 50 * kMs);
  expect_same(cut[1], held, 1e-12);
  expect_same(cut[2], imu_at(kStart + 55 * kMs), 1e-12);
  held.t_ns = kStart;
  expect_same(cut[0], held, 0.);
  const auto all_before = bench.buffer.cut(kStart, kStart + 45 * kMs);
  ASSERT_EQ(all_before.size(), 2u);
  held.t_ns = kStart + 45 * kMs;
  expect_same(all_before[1], held, 1e-12);
}

TEST(ImuBuffer, KeepsTheLastReadingAtOrBeforeWhatItGoesOnFrom) {
  ImuBench bench({0, 10, 20, 30, 40});
  bench.buffer.forget_before(kStart + 25 * kMs);
  EXPECT_EQ(bench.buffer.samples().front().t_ns, kStart + 20 * kMs);
  EXPECT_EQ(bench.cut(25, 40), (Times{25, 30, 40}));
  bench.buffer.forget_before(kStart + 30 * kMs);
  EXPECT_EQ(bench.buffer.samples().front().t_ns, kStart + 30 * kMs);
  bench.buffer.forget_before(kStart + 1000 * kMs);
  EXPECT_EQ(bench.buffer.samples().size(), 1u);
  bench.buffer.forget_before(kStart);
  EXPECT_EQ(bench.buffer.samples().size(), 1u);
}

TEST(ImuBuffer, ForgetsBeforeAStartWhatNoneLooksAt) {
  ImuBench bench({});
  bench.buffer.forget_before_start();
  EXPECT_TRUE(bench.buffer.empty());
  for (std::int64_t t = 0; t < 120'000; t += 100) {
    bench.buffer.add(imu_at(kStart + t * kMs), bench.rejections);
    bench.buffer.forget_before_start();
  }
  EXPECT_EQ(bench.buffer.samples().size(), 1200u);
  bench.buffer.add(imu_at(kStart + 120'000 * kMs), bench.rejections);
  bench.buffer.forget_before_start();
  EXPECT_EQ(bench.buffer.samples().size(), 601u);
}

TEST(ImuBuffer, DoesNotBelieveAStampFarAheadUntilAnotherOneFollows) {
  ImuBench broken({0, 10, 30'000, 20, 30});
  EXPECT_EQ(broken.buffer.samples().size(), 4u);
  EXPECT_EQ(broken.buffer.newest_ns(), kStart + 30 * kMs);
  EXPECT_EQ(broken.rejected(), (Counts{{"imu: stamp far ahead of the last", 1}}));
  ImuBench late({0, 10, 30'000, 30'010, 30'020});
  EXPECT_EQ(late.buffer.newest_ns(), kStart + 30'020 * kMs);
  EXPECT_EQ(late.rejected(),
            (Counts{{"imu: stamp far ahead of the last", 1}, {"imu: gap bridged", 1}}));
}

TEST(ImuBuffer, DoesNotBelieveAStampThatIsSecondsAheadEither) {
  ImuBench broken({0, 10, 5000, 20, 30});
  EXPECT_EQ(broken.buffer.newest_ns(), kStart + 30 * kMs);
  EXPECT_EQ(broken.rejected(), (Counts{{"imu: stamp far ahead of the last", 1}}));
}

TEST(ImuBuffer, KnowsAClockThatWasSetBackFromReadingsThatAreLate) {
  std::vector<std::int64_t> t_ms{0, 10, 20};
  for (std::int64_t t = -5000; t < -4810; t += 10) t_ms.push_back(t);
  ImuBench bench(t_ms);
  EXPECT_EQ(bench.buffer.set_back_s(), 0.) << "nineteen readings";
  bench.buffer.add(imu_at(kStart - 4810 * kMs), bench.rejections);
  EXPECT_DOUBLE_EQ(bench.buffer.set_back_s(), 5.02);
  ImuBench late(t_ms);
  late.buffer.add(imu_at(kStart + 30 * kMs), late.rejections);
  late.buffer.add(imu_at(kStart - 4800 * kMs), late.rejections);
  EXPECT_EQ(late.buffer.set_back_s(), 0.) << "the clock goes on between them";
}

TEST(ImuBuffer, LeavesOutReadingsBeyondTheRange) {
  ImuBench bench({0});
  ImuSample sample = imu_at(kStart + 10 * kMs);
  sample.accel_m_per_s2[1] = -160.1;
  bench.buffer.add(sample, bench.rejections);
  sample.accel_m_per_s2[1] = -160.;
  sample.gyro_rad_per_s[2] = 1e20;
  bench.buffer.add(sample, bench.rejections);
  sample.gyro_rad_per_s[2] = 35.;
  bench.buffer.add(sample, bench.rejections);
  EXPECT_EQ(bench.buffer.samples().size(), 2u);
  EXPECT_EQ(bench.rejected(), (Counts{{"imu: out of range (range_gyro_rad_per_s, "
                                       "range_accel_m_per_s2): saturated, or of other units",
                                       2}}));
}

TEST(ImuBuffer, SaysWhichPartsOfACutLieInAGap) {
  ImuBench bench({0, 10, 110, 120});
  const auto gaps = [&](std::int64_t begin_ms, std::int64_t end_ms) {
    bench.cut(begin_ms, end_ms);
    const auto gaps_s = bench.buffer.gaps_s();
    return std::vector<double>(gaps_s.begin(), gaps_s.end());
  };
  EXPECT_EQ(gaps(0, 10), (std::vector{0., 0.}));
  EXPECT_EQ(gaps(0, 60), (std::vector{0., 0., 0.1}));
  EXPECT_EQ(gaps(60, 90), (std::vector{0., 0.1}));
  EXPECT_EQ(gaps(60, 120), (std::vector{0., 0.1, 0.}));
}

}  // namespace
}  // namespace viwo

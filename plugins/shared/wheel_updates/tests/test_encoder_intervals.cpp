// Cutting the encoder stream at the clones: what is used once, waited for, and lost.
#include <gtest/gtest.h>

#include "encoder_intervals.hpp"
#include "filter_fixture.hpp"
#include "viwo/wheel/preintegration.hpp"

namespace viwo {
namespace {

constexpr std::int64_t kMs = 1'000'000;

TEST(EncoderIntervals, UsesEachSampleOnceWhileTheClockOffsetChanges) {
  const auto model = testing::load_model(testing::swerve("four_wis_wid"));
  const auto samples = testing::sample_motion(
      *model, [](double) { return Twist(0.4, 0.1, 0.3); }, 10., 100.);
  Preintegrator preintegrator(model, {});
  EncoderIntervals intervals;
  testing::SmallFilter filter;
  filter.clones.resize(2);
  std::mt19937_64 rng(5);
  std::int64_t used = 0, first_ns = -1, last_ns = -1;
  for (int k = 1; k < 90; ++k) {
    filter.clones[0] = filter.clones[1];
    filter.clones[1].t_ns = 100 * k * kMs;
    filter.clones[1].slot = k % 2;
    const double t_OtoI_s = 0.004 * testing::gaussian(1, rng)[0];
    const auto interval = intervals.next(filter.view(), t_OtoI_s, samples);
    if (!interval.has_value()) continue;
    if (first_ns < 0) first_ns = interval->begin_ns;
    if (last_ns >= 0) {
      EXPECT_EQ(interval->begin_ns, last_ns);
    }
    last_ns = interval->end_ns;
    PreintegratedPose pose;
    ASSERT_TRUE(preintegrator.integrate(samples, interval->begin_ns, interval->end_ns, pose));
    used += pose.samples;
  }
  std::int64_t expected = 0;
  for (const EncoderSample& sample : samples) {
    expected += sample.t_ns >= first_ns && sample.t_ns < last_ns ? 1 : 0;
  }
  EXPECT_GT(expected, 850);
  EXPECT_EQ(used, expected);
}

CloneState clone_at(int k) {
  CloneState clone;
  clone.t_ns = 100 * k * kMs;
  clone.slot = k % 4;
  return clone;
}

TEST(EncoderIntervals, WaitsForLateSamplesAndCountsLostIntervals) {
  const auto model = testing::load_model(testing::swerve("four_wis_wid"));
  const auto samples = testing::sample_motion(
      *model, [](double) { return Twist(0.4, 0.1, 0.3); }, 2., 100.);
  EncoderIntervals intervals;
  testing::SmallFilter filter;
  const std::span all(samples);
  filter.clones = {clone_at(1)};
  EXPECT_FALSE(intervals.next(filter.view(), 0., all.first(10)).has_value());
  filter.clones = {clone_at(1), clone_at(2)};
  // Up to 0.19 s.
  EXPECT_FALSE(intervals.next(filter.view(), 0., all.first(19)).has_value());
  filter.clones = {clone_at(1), clone_at(2), clone_at(3)};
  const auto longer = intervals.next(filter.view(), 0., all.first(30));
  ASSERT_TRUE(longer.has_value());
  EXPECT_EQ(longer->first_clone, 0u);
  EXPECT_EQ(longer->last_clone, 2u);
  EXPECT_EQ(longer->begin_ns, 100 * kMs);
  EXPECT_EQ(longer->end_ns, 300 * kMs);
  std::vector<RejectionCount> counts;
  intervals.append_rejections(counts);
  EXPECT_TRUE(counts.empty());

  filter.clones = {clone_at(4), clone_at(5)};  // that at 0.3 s has left
  EXPECT_FALSE(intervals.next(filter.view(), 0., all.first(60)).has_value());
  filter.clones = {clone_at(5), clone_at(6)};
  // From 0.55 s; the interval begins at 0.5 s.
  EXPECT_FALSE(intervals.next(filter.view(), 0., all.subspan(55, 20)).has_value());
  intervals.append_rejections(counts);
  ASSERT_EQ(counts.size(), 2u);
  EXPECT_EQ(counts[0].reason,
            "epochs lost: the encoder samples came when the first clone had left "
            "(estimator.max_wait_s)");
  EXPECT_EQ(counts[0].first, "t = 0.500 s");
  EXPECT_EQ(counts[1].reason, "epochs lost: the encoder samples begin after them");
  EXPECT_EQ(counts[1].first, "t = 0.600 s");
  EXPECT_EQ(counts[1].count, 1);
  EXPECT_GT(counts[0].of, counts[0].count);
}

// A filter of three clones, and samples that come when the first of them has long left.
TEST(EncoderIntervals, CountTheEpochsThatGoWithout) {
  testing::SmallFilter filter;
  EncoderIntervals intervals;
  constexpr int kEpochs = 30;
  for (int k = 0; k < kEpochs; ++k) {
    filter.clones = {clone_at(k), clone_at(k + 1), clone_at(k + 2)};
    EXPECT_FALSE(intervals.next(filter.view(), 0., {}).has_value());
  }
  std::vector<RejectionCount> counts;
  intervals.append_rejections(counts);
  ASSERT_EQ(counts.size(), 1u);
  EXPECT_EQ(counts[0].of, kEpochs);
  EXPECT_NEAR(static_cast<double>(counts[0].count), kEpochs, 4.);  // but for those that wait
}

}  // namespace
}  // namespace viwo

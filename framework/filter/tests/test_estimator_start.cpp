// Measurements that wait for a start which does not come about, or comes late.
#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "estimator_fixture.hpp"
#include "viwo/filter/estimator.hpp"

namespace viwo {
namespace {

using testing::camera_prior;
using testing::Counts;
using testing::encoder_at;
using testing::FakeUpdate;
using testing::image_at;
using testing::imu_at;
using testing::kMs;
using testing::kStart;
using testing::level_prior;
using testing::Rig;

PoseSample pose_at(std::int64_t t_ns) {
  PoseSample pose;
  pose.t_ns = t_ns;
  return pose;
}

/// An estimator with wheels and poses that asks for a start, and what it showed when it asked.
struct Waiting {
  std::shared_ptr<FakeUpdate> update = std::make_shared<FakeUpdate>();
  std::vector<std::int64_t> asked_ms;  ///< the last IMU sample; -1: none
  std::int64_t imu_span_ms = 0;        ///< of the last attempt
  std::int64_t encoders_begin_ms = 0;
  std::size_t most_encoders = 0;
  std::int64_t start_at_ms = std::numeric_limits<std::int64_t>::max();
  Estimator estimator;

  explicit Waiting(double t_OtoI_s = 0.)
      : estimator({}, {camera_prior()}, Rig::wheels(true, t_OtoI_s), {{"fake", update, 0, 0}}) {
    estimator.start([this](auto imu, auto encoders) -> StartAttempt {
      asked_ms.push_back(imu.empty() ? -1 : (imu.back().t_ns - kStart) / kMs);
      if (!imu.empty()) imu_span_ms = (imu.back().t_ns - imu.front().t_ns) / kMs;
      most_encoders = std::max(most_encoders, encoders[0].size());
      if (!encoders[0].empty()) {
        encoders_begin_ms = (encoders[0].front().begin_ns - kStart) / kMs;
      }
      if (asked_ms.back() < start_at_ms) return no_start("not yet");
      return {level_prior(imu.back().t_ns), {}};
    });
  }
  Counts rejected() const {
    Counts counts;
    for (const RejectionCount& r : estimator.rejections()) counts[r.reason] += r.count;
    counts.erase("fake: a reason of its own");
    counts.erase("gap of the IMU bridged");
    return counts;
  }
};

TEST(EstimatorStart, IsTriedEvery50MsAndOnceMoreAtTheEnd) {
  Waiting waiting;
  for (std::int64_t t = 0; t <= 120; t += 10) {
    waiting.estimator.add(imu_at(kStart + t * kMs));
    waiting.estimator.add(encoder_at(kStart + t * kMs), 0);
    EXPECT_FALSE(waiting.estimator.step());
    EXPECT_FALSE(waiting.estimator.step());
  }
  EXPECT_EQ(waiting.asked_ms, (std::vector<std::int64_t>{0, 50, 100}));
  waiting.estimator.finish();
  EXPECT_FALSE(waiting.estimator.step());
  EXPECT_FALSE(waiting.estimator.step());
  EXPECT_EQ(waiting.asked_ms, (std::vector<std::int64_t>{0, 50, 100, 120}));
  ASSERT_EQ(waiting.estimator.start_obstacles().size(), 1u);
  EXPECT_EQ(waiting.estimator.start_obstacles()[0].count, 4);
}

TEST(EstimatorStart, IsTriedAtTheEndWithoutAnyImuSoThatItSaysWhatIsMissing) {
  Waiting waiting;
  waiting.estimator.add(image_at(kStart));
  EXPECT_FALSE(waiting.estimator.step());
  EXPECT_TRUE(waiting.asked_ms.empty());
  waiting.estimator.finish();
  EXPECT_FALSE(waiting.estimator.step());
  EXPECT_EQ(waiting.asked_ms, (std::vector<std::int64_t>{-1}));
}

TEST(EstimatorStart, IsNotSpoiltByAStampInTheFuture) {
  // GIVEN an image and a pose of an hour later; then the IMU for a second
  const std::int64_t ahead = kStart + 3600'000 * kMs;
  Waiting waiting;
  waiting.start_at_ms = 1000;
  waiting.estimator.add(image_at(ahead));
  waiting.estimator.add(pose_at(ahead), 0);
  for (std::int64_t t = 0; t <= 1300; t += 10) {
    waiting.estimator.add(imu_at(kStart + t * kMs));
    waiting.estimator.add(encoder_at(kStart + t * kMs), 0);
    waiting.estimator.step();
    // THEN the start sees all of it
    if (!waiting.estimator.filter().initialized()) {
      EXPECT_GE(waiting.imu_span_ms, t - 50);
    }
  }
  EXPECT_EQ(waiting.asked_ms.back(), 1000);
  EXPECT_TRUE(waiting.estimator.filter().initialized());
  EXPECT_FALSE(waiting.update->seen.empty());
}

TEST(EstimatorStart, IsGivenAMinuteOfEncodersInTheirOwnClock) {
  for (const double t_OtoI_s : {-1000., 1000.}) {
    Waiting waiting(t_OtoI_s);
    const auto in_wheel_clock = [&](std::int64_t t) {
      return kStart + t * kMs - static_cast<std::int64_t>(t_OtoI_s * 1e9);
    };
    for (std::int64_t t = 0; t <= 300'000; t += 100) {
      waiting.estimator.add(imu_at(kStart + t * kMs));
      waiting.estimator.add(encoder_at(in_wheel_clock(t)), 0);
      waiting.estimator.step();
      const std::int64_t oldest =
          waiting.encoders_begin_ms + static_cast<std::int64_t>(t_OtoI_s * 1e3);
      if (t >= 60'000) {
        ASSERT_LE(oldest, t - 59'000);
      }
    }
    EXPECT_LE(waiting.most_encoders, 1202u);
  }
}

TEST(EstimatorStart, ForgetsEncodersThatHaveStopped) {
  Waiting waiting;
  for (std::int64_t t = 0; t <= 300'000; t += 100) {
    waiting.estimator.add(imu_at(kStart + t * kMs));
    if (t <= 1000) waiting.estimator.add(encoder_at(kStart + t * kMs), 0);
    waiting.most_encoders = 0;
    waiting.estimator.step();
  }
  EXPECT_EQ(waiting.most_encoders, 0u);
}

TEST(EstimatorStart, DoesNotKeepWhatComesWithoutAnImu) {
  Waiting waiting;
  for (std::int64_t t = 0; t <= 600'000; t += 100) {
    waiting.estimator.add(image_at(kStart + t * kMs, 0));
    waiting.estimator.add(image_at(kStart + t * kMs, 1));
    waiting.estimator.add(pose_at(kStart + t * kMs), 0);
    waiting.estimator.add(encoder_at(kStart + t * kMs), 0);
    waiting.estimator.step();
  }
  waiting.estimator.finish();
  waiting.estimator.step();
  // At most two minutes are kept; each image counts, also of the same instant.
  EXPECT_LE(waiting.most_encoders, 1202u);
  const Counts rejected = waiting.rejected();
  EXPECT_GE(rejected.at("pose before the start"), 4800);
  EXPECT_EQ(rejected.at("image before the start"), 2 * rejected.at("pose before the start"));
}

TEST(EstimatorStart, CountsThePosesBeforeItAndGivesTheOthers) {
  Waiting waiting;
  waiting.start_at_ms = 100;
  for (std::int64_t t = 0; t <= 400; t += 10) {
    waiting.estimator.add(imu_at(kStart + t * kMs));
    waiting.estimator.add(encoder_at(kStart + t * kMs), 0);
    if (t == 150) waiting.estimator.add(pose_at(kStart + 95 * kMs), 0);  // it came late
    if (t < 60 || t > 150) waiting.estimator.add(pose_at(kStart + t * kMs), 0);
    if (t == 60) waiting.estimator.add(pose_at(kStart + 65 * kMs), 0);
    waiting.estimator.step();
  }
  EXPECT_EQ(waiting.rejected(), (Counts{{"pose before the start", 8}}));
  ASSERT_EQ(waiting.update->seen.size(), 1u);
  ASSERT_EQ(waiting.update->seen[0].poses.size(), 20u);
  EXPECT_EQ(waiting.update->seen[0].poses.front().t_ns, kStart + 160 * kMs);
}

}  // namespace
}  // namespace viwo

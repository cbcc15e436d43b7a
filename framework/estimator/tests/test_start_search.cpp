// How often a start is tried, and what is said of the attempts.
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "estimator_fixture.hpp"
#include "viwo/estimator/start_search.hpp"

namespace viwo {
namespace {

using testing::imu_at;
using testing::kMs;
using testing::level_prior;

std::vector<ImuSample> readings_to(std::int64_t t_ms) { return {imu_at(0), imu_at(t_ms * kMs)}; }

TEST(StartSearch, IsDueEvery50MsOfTheImuAndOnceAtTheEnd) {
  StartSearch search;
  search.set([](const StartData&) { return no_start("never"); });
  EXPECT_FALSE(search.is_due({}, false));
  EXPECT_TRUE(search.is_due(readings_to(1000), false));
  EXPECT_FALSE(search.is_due(readings_to(1049), false));
  EXPECT_TRUE(search.is_due(readings_to(1050), false));
  EXPECT_TRUE(search.is_due(readings_to(1051), true));
  EXPECT_FALSE(search.is_due(readings_to(2000), true));
}

TEST(StartSearch, IsDueAtTheEndThoughThereIsNoImu) {
  StartSearch search;
  EXPECT_FALSE(search.is_due({}, true)) << "nobody to ask";
  search.set([](const StartData&) { return no_start("never"); });
  EXPECT_TRUE(search.is_due({}, true));
}

TEST(StartSearch, CountsTheObstaclesInTheOrderOfTheirFirstTimes) {
  StartSearch search;
  int attempts = 0;
  search.set([&](const StartData&) -> StartAttempt {
    ++attempts;
    if (attempts == 4) return {level_prior(7), {}};
    return no_start(attempts == 2 ? "moves" : "too short");
  });
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(search.attempt({}));
  const auto found = search.attempt({});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->t_ns, 7);
  ASSERT_EQ(search.obstacles().size(), 2u);
  EXPECT_EQ(search.obstacles()[0].text, "too short");
  EXPECT_EQ(search.obstacles()[0].count, 2);
  EXPECT_EQ(search.obstacles()[1].text, "moves");
  EXPECT_EQ(search.obstacles()[1].count, 1);
}

}  // namespace
}  // namespace viwo

// When all that is measured contradicts the filter.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "filter_fixture.hpp"
#include "viwo/estimator/contact.hpp"

namespace viwo {
namespace {

/// A filter, two updates, and what they count in periods of half a second.
struct ContactBench {
  testing::Random random{7};
  Filter filter = testing::running_filter(random, 1);
  std::vector<UpdateCounts> counts{{}, {}};
  Contact contact;
  std::string failure;

  ContactBench() { contact.epoch(counts, filter); }
  void period(std::int64_t applied, std::int64_t rejected, UpdateCounts other = {}) {
    for (int i = 0; i < 5 && failure.empty(); ++i) {
      filter.drop_oldest_clone();
      testing::step(filter, random);
      counts[0].applied += i == 0 ? applied : 0;
      counts[0].rejected += i == 0 ? rejected : 0;
      counts[1].applied += i == 0 ? other.applied : 0;
      counts[1].rejected += i == 0 ? other.rejected : 0;
      failure = contact.epoch(counts, filter);
    }
  }
};

TEST(Contact, IsThereAsLongAsOneUpdateAgrees) {
  ContactBench bench;
  for (int i = 0; i < 20; ++i) bench.period(0, 50, {5, 5});
  for (int i = 0; i < 20; ++i) bench.period(11, 40);
  for (int i = 0; i < 40; ++i) bench.period(0, i % 3 == 0 ? 1 : 0);  // too few to say anything
  EXPECT_EQ(bench.contact.loosened(), 0);
  EXPECT_EQ(bench.failure, "");
}

TEST(Contact, WaitsForFiveMeasurementsWhereThereAreFew) {
  ContactBench bench;
  for (int i = 0; i < 2; ++i) bench.period(0, 2);
  EXPECT_EQ(bench.contact.loosened(), 0);
  bench.period(0, 2);
  EXPECT_EQ(bench.contact.loosened(), 1);
}

TEST(Contact, LoosensAFilterThatAllUpdatesContradictAndGivesItUpAfterAWhile) {
  ContactBench bench;
  bench.period(50, 0, {5, 0});
  bench.period(1, 50, {0, 5});
  EXPECT_EQ(bench.contact.loosened(), 1);
  // (F-28)
  EXPECT_GT(bench.filter.covariance()(kVelocityColumn, kVelocityColumn), 1.);
  bench.period(50, 0);
  for (int i = 0; i < 7; ++i) bench.period(0, 50);
  EXPECT_EQ(bench.contact.loosened(), 8);
  EXPECT_EQ(bench.failure, "");
  bench.period(0, 50);
  EXPECT_TRUE(bench.failure.starts_with("all updates have contradicted the estimate for "))
      << bench.failure;
}

}  // namespace
}  // namespace viwo

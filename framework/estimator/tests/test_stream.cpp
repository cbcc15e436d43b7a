// Order, lateness and clocks of the samples of one stream.
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "estimator_fixture.hpp"
#include "viwo/estimator/stream.hpp"

namespace viwo {
namespace {

using testing::cell_at;
using testing::CellSample;
using testing::Counts;
using testing::FixSample;
using testing::kMs;
using testing::kNaN;
using testing::tick_at;
using testing::TickSample;

/// A stream with the blocks of two clocks, which the test sets; the IMU has come to 0.
struct StreamBench {
  StateBlocks blocks{{clock("one"), clock("two")}, {}, 0};
  Rejections rejections;
  Stream stream;
  std::int64_t imu_ns = 0;

  static BlockSpec clock(const std::string& name) {
    BlockSpec block{.name = name};
    return block.add(name, "s", 0., 1.);
  }
  explicit StreamBench(const StreamSpec& spec, bool keeps = false)
      : stream({spec, "test", keeps}) {}

  void add(SampleView sample) { stream.add(sample, blocks, imu_ns, rejections); }
  void tick(std::int64_t t_ms, int channel = 0) { add(tick_at(t_ms * kMs, channel)); }
  void cell(std::int64_t end_ms) { add(cell_at(end_ms * kMs)); }
  void move_clocks(double one_s, double two_s = 0.) {
    blocks.correct(Eigen::Vector2d(one_s, two_s), true);
  }
  void epoch(std::int64_t t_ms, std::int64_t oldest_ms) {
    stream.forget(oldest_ms * kMs, blocks);
    stream.take(t_ms * kMs, blocks);
  }
  /// Stamps, ms.
  template <class T>
  static std::vector<std::int64_t> stamps(const SampleSpan& span) {
    std::vector<std::int64_t> out;
    for (std::size_t i = 0; i < span.size; ++i) {
      out.push_back(static_cast<const T*>(span.data)[i].t_ns / kMs);
    }
    return out;
  }
  template <class T>
  std::vector<std::int64_t> taken(Given given = Given::kOnce) const {
    return stamps<T>(stream.taken(given));
  }
  Counts rejected() const { return testing::counts_of(rejections); }
};

using Stamps = std::vector<std::int64_t>;

StreamSpec ticks_of(std::vector<StreamSpec::Clock> clocks, int per_instant = 1) {
  StreamSpec spec = testing::ticks_spec(per_instant);
  spec.clocks = std::move(clocks);
  return spec;
}

TEST(Stream, GivesEachSampleOnceUpToTheEndOfAnEpoch) {
  StreamBench bench(testing::fixes_spec());
  for (const std::int64_t t : {10, 20, 30, 40}) bench.add(FixSample{t * kMs, 0.});
  bench.epoch(30, 0);
  EXPECT_EQ(bench.taken<FixSample>(), (Stamps{10, 20, 30})) << "the end included";
  bench.add(FixSample{50 * kMs, 0.});
  bench.epoch(31, 0);
  EXPECT_EQ(bench.taken<FixSample>(), Stamps{});
  EXPECT_EQ(bench.stream.taken(Given::kOnce).type, &sample_type<FixSample>());
  bench.epoch(100, 0);
  EXPECT_EQ(bench.taken<FixSample>(), (Stamps{40, 50}));
  EXPECT_EQ(bench.rejected(), Counts{});
}

TEST(Stream, GivesALateSampleToTheNextEpochUnlessItEndsEpochs) {
  StreamBench bench(testing::fixes_spec());
  bench.epoch(100, 0);
  bench.add(FixSample{90 * kMs, 0.});
  bench.epoch(200, 0);
  EXPECT_EQ(bench.taken<FixSample>(), Stamps{90});
  StreamBench ending(testing::ticks_spec());
  ending.epoch(100, 0);
  ending.tick(90);
  ending.tick(100);
  ending.tick(101);
  EXPECT_EQ(ending.rejected(), (Counts{{"ticks: at or before the present epoch", 2}}));
  EXPECT_EQ(ending.stream.next_end_ns(ending.blocks), 101 * kMs);
}

TEST(Stream, KeepsWhatCameSinceTheOldestCloneAndHalfASecondMore) {
  StreamBench bench(testing::cells_spec({0}), true);
  for (std::int64_t t = 10; t <= 3000; t += 10) bench.cell(t);
  bench.epoch(2000, 0);
  EXPECT_EQ(bench.taken<CellSample>(Given::kSinceOldestClone).size(), 300u)
      << "also what is behind the end of the epoch";
  EXPECT_EQ(bench.taken<CellSample>().back(), 1995);
  bench.epoch(2100, 1500);
  EXPECT_EQ(bench.taken<CellSample>(Given::kSinceOldestClone).front(), 995)
      << "the first one that ends 0.5 s before the oldest clone";
  EXPECT_EQ(bench.taken<CellSample>().front(), 2005) << "once is once";
  bench.epoch(2200, 2100);
  EXPECT_EQ(bench.taken<CellSample>(Given::kSinceOldestClone).front(), 995)
      << "few are not worth moving the others";
  EXPECT_EQ(bench.taken<CellSample>().front(), 2105);
}

TEST(Stream, KeepsWhatIsSinceTheOldestCloneInTheClockOfTheImu) {
  StreamBench bench(testing::cells_spec({0}), true);
  bench.move_clocks(-1.);  // the stamps are a second ahead
  for (std::int64_t t = 10; t <= 5000; t += 10) bench.cell(t);
  bench.epoch(3000, 2500);
  EXPECT_EQ(bench.taken<CellSample>().back(), 3995);
  bench.epoch(3010, 2500);
  EXPECT_EQ(bench.taken<CellSample>(Given::kSinceOldestClone).front(), 2995);
}

TEST(Stream, RefusesCellsThatOverlapAndInstantsThatRepeat) {
  StreamBench cells(testing::cells_spec({0}), true);
  cells.cell(10);
  cells.cell(19);
  cells.cell(20);
  cells.cell(10);
  EXPECT_EQ(cells.rejected(), (Counts{{"cells: begins before the end of the last", 2}}));
  StreamBench fixes(testing::fixes_spec());
  for (const std::int64_t t : {10, 10, 9, 11}) fixes.add(FixSample{t * kMs, 0.});
  EXPECT_EQ(fixes.rejected(), (Counts{{"fixes: stamp not after the last", 2}}));
}

TEST(Stream, RemembersTheOrderOfWhatIsLongGone) {
  StreamBench bench(testing::fixes_spec());
  bench.add(FixSample{50 * kMs, 0.});
  bench.epoch(100, 100);
  bench.epoch(200, 200);
  bench.add(FixSample{50 * kMs, 0.});
  EXPECT_EQ(bench.rejected(), (Counts{{"fixes: stamp not after the last", 1}}));
}

TEST(Stream, RefusesLateCellsThatWouldEndEpochs) {
  StreamSpec spec = testing::cells_spec({0});
  spec.ends_epochs = true;
  StreamBench bench(spec, true);
  bench.epoch(100, 0);
  bench.cell(90);
  bench.cell(105);
  bench.cell(115);
  EXPECT_EQ(bench.rejected(), (Counts{{"cells: at or before the present epoch", 2}}));
}

TEST(Stream, CountsValuesAndStampsThatCannotBe) {
  StreamBench bench(testing::fixes_spec());
  bench.add(FixSample{0, kNaN});
  bench.add(FixSample{10'001 * kMs, 0.});
  bench.add(FixSample{10'000 * kMs, 0.});
  EXPECT_EQ(bench.rejected(), (Counts{{"fixes: value that is not finite", 1},
                                      {"fixes: stamp more than 10 s ahead of the IMU", 1}}));
  EXPECT_EQ(bench.rejections.counts()[1].first, "stamp 10001000000 ns");
  EXPECT_THROW(bench.add(tick_at(0)), std::invalid_argument);
}

TEST(Stream, CannotTellWhatIsAheadBeforeThereIsAnImu) {
  StreamBench bench(testing::fixes_spec());
  bench.stream.add(FixSample{3'600'000 * kMs, 0.}, bench.blocks, std::nullopt, bench.rejections);
  EXPECT_EQ(bench.rejected(), Counts{});
}

TEST(Stream, IsNotSpoiltByAStampInTheFutureThatCameBeforeTheImu) {
  StreamBench bench(testing::ticks_spec());
  bench.stream.add(tick_at(3'600'000 * kMs), bench.blocks, std::nullopt, bench.rejections);
  for (const std::int64_t t : {10, 20, 30})
    bench.stream.add(tick_at(t * kMs), bench.blocks, 0, bench.rejections);
  EXPECT_EQ(bench.rejected(), (Counts{{"ticks: stamp more than 10 s ahead of the IMU", 1}}));
  EXPECT_EQ(bench.stream.all().size, 3U);
  EXPECT_EQ(bench.stream.newest_ns(), 30 * kMs);
}

TEST(Stream, DropsWhatIsBeforeTheStart) {
  StreamBench bench(testing::fixes_spec());
  for (const std::int64_t t : {10, 20, 30}) bench.add(FixSample{t * kMs, 0.});
  bench.stream.start_at(20 * kMs, bench.blocks, bench.rejections);
  EXPECT_EQ(bench.rejected(), (Counts{{"fixes: before the start", 2}}));
  bench.epoch(100, 20);
  EXPECT_EQ(bench.taken<FixSample>(), Stamps{30});
  StreamBench late(testing::fixes_spec());
  late.stream.start_at(20 * kMs, late.blocks, late.rejections);
  late.add(FixSample{20 * kMs, 0.});
  late.add(FixSample{21 * kMs, 0.});
  EXPECT_EQ(late.rejected(), (Counts{{"fixes: before the start", 1}}));
  StreamBench keeps(testing::cells_spec({0}), true);
  keeps.cell(10);
  keeps.stream.start_at(20 * kMs, keeps.blocks, keeps.rejections);
  keeps.cell(20);
  EXPECT_EQ(keeps.stream.all().size, 2u) << "some time before the oldest clone is wanted";
  EXPECT_EQ(keeps.rejected(), Counts{});
}

TEST(Stream, ReadsEachChannelInItsClock) {
  // Channel 0: block one; channel 1: block two and 100 ms.
  StreamBench bench(ticks_of({{0., {0}}, {0.1, {1}}}));
  bench.move_clocks(0.005, -0.002);
  bench.tick(100, 0);
  EXPECT_EQ(bench.stream.next_end_ns(bench.blocks), 105 * kMs);
  bench.tick(20, 1);
  EXPECT_EQ(bench.stream.newest_ns(), 118 * kMs);
  bench.epoch(110, 0);
  EXPECT_EQ(bench.taken<TickSample>(), Stamps{100});
  EXPECT_EQ(bench.stream.next_end_ns(bench.blocks), 118 * kMs);
  // A clock that is found to be another moves what waits.
  bench.move_clocks(0., 0.003);
  EXPECT_EQ(bench.stream.next_end_ns(bench.blocks), 121 * kMs);
  // Channels without a clock of their own have that of the last.
  bench.tick(30, 7);
  EXPECT_EQ(bench.stream.newest_ns(), 131 * kMs);
  EXPECT_EQ(bench.rejected(), Counts{});
}

TEST(Stream, ComparesStampsOfOneChannelAsTheyAreAndOfTwoInTheClockOfTheImu) {
  StreamBench bench(ticks_of({{0., {}}, {0.04, {}}}));
  bench.tick(100, 0);
  bench.tick(70, 1);  // at 110
  bench.tick(60, 1);
  bench.tick(105, 0);
  bench.tick(110, 0);
  EXPECT_EQ(bench.rejected(),
            (Counts{{"ticks: stamp not after the last", 1}, {"ticks: stamp before the last", 1}}));
  bench.epoch(110, 0);
  EXPECT_EQ(bench.taken<TickSample>(), (Stamps{100, 70, 110}));
}

TEST(Stream, IsNotSpoiltByABrokenChannel) {
  StreamBench bench(ticks_of({{0., {}}, {0.04, {}}}));
  bench.tick(100, -5);
  bench.tick(101, 1'000'000'000);
  bench.tick(141, 0);
  EXPECT_EQ(bench.rejected(), Counts{});
  EXPECT_EQ(bench.stream.newest_ns(), 141 * kMs);
}

/// Two channels whose clocks differ by `other_s` more than is configured.
StreamBench pair_bench(double other_s) {
  StreamBench bench(ticks_of({{0., {0}}, {0.02, {1}}}, 2));
  bench.move_clocks(0., other_s);
  return bench;
}

TEST(Stream, TakesSamplesOfOneInstantTogetherThoughTheirClocksDifferABit) {
  for (const double other_s : {-0.0025, -1e-9, 0., 1e-9, 0.0025}) {
    StreamBench bench = pair_bench(other_s);
    bench.tick(100, 0);
    bench.tick(80, 1);  // about the same
    bench.tick(133, 0);
    bench.tick(113, 1);
    const std::int64_t t_ns = *bench.stream.next_end_ns(bench.blocks);
    EXPECT_EQ(bench.stream.waiting_at(t_ns, bench.blocks), 2) << other_s;
    EXPECT_EQ(t_ns, 100 * kMs) << "what came first";
    bench.stream.take(t_ns, bench.blocks);
    EXPECT_EQ(bench.taken<TickSample>(), (Stamps{100, 80})) << other_s;
    EXPECT_EQ(bench.stream.next_end_ns(bench.blocks), 133 * kMs);
    EXPECT_EQ(bench.rejected(), Counts{}) << other_s;
  }
}

TEST(Stream, DoesNotTakeTheNextInstantOfAFastChannelForThePresentOne) {
  StreamBench bench = pair_bench(0.);
  bench.tick(100, 0);
  bench.tick(102, 0);
  bench.stream.take(100 * kMs, bench.blocks);
  EXPECT_EQ(bench.taken<TickSample>(), Stamps{100});
}

TEST(Stream, RefusesTheRestOfAnInstantThatIsOver) {
  StreamBench bench = pair_bench(0.002);
  bench.tick(100, 0);
  bench.epoch(100, 0);
  bench.tick(80, 1);  // at 102
  EXPECT_EQ(bench.rejected(), (Counts{{"ticks: at or before the present epoch", 1}}));
  // An epoch that had another reason is not in the way.
  StreamBench other = pair_bench(0.002);
  other.epoch(100, 0);
  other.tick(80, 1);
  EXPECT_EQ(other.rejected(), Counts{});
}

TEST(Stream, ReachesAnInstantWithTheEndOfItsLastCell) {
  StreamBench bench(testing::cells_spec({0}));
  EXPECT_FALSE(bench.stream.reaches(std::numeric_limits<std::int64_t>::min() / 2, bench.blocks));
  bench.cell(100);
  bench.move_clocks(0.004);
  EXPECT_TRUE(bench.stream.reaches(104 * kMs, bench.blocks));
  EXPECT_FALSE(bench.stream.reaches(104 * kMs + 1, bench.blocks));
  bench.epoch(100, 100);
  bench.epoch(102, 102);
  EXPECT_EQ(bench.stream.all().size, 0u);
  EXPECT_TRUE(bench.stream.reaches(104 * kMs, bench.blocks)) << "also when it has been used";
}

TEST(Stream, ForgetsBeforeAStartWhatNoneLooksAt) {
  for (const bool keeps : {false, true}) {
    StreamBench bench(testing::fixes_spec(), keeps);
    for (std::int64_t t = 0; t <= 120'000; t += 1000) {
      bench.imu_ns = t * kMs;
      bench.add(FixSample{t * kMs, 0.});
      bench.stream.forget_before_start(bench.blocks, bench.imu_ns, bench.rejections);
    }
    EXPECT_EQ(bench.stream.all().size, 61u);
    const Counts counted = keeps ? Counts{} : Counts{{"fixes: before the start", 60}};
    EXPECT_EQ(bench.rejected(), counted) << "a start may look at what is kept";
    // Then it falls silent.
    bench.stream.forget_before_start(bench.blocks, 400'000 * kMs, bench.rejections);
    EXPECT_EQ(bench.stream.all().size, keeps ? 0u : 61u);
  }
}

TEST(Rejections, AddUpOverThePartsOfARunWithOutOfHowMany) {
  Rejections all;
  all.add({"drive 3 left out", 5, "t = 1.0 s", 100});
  all.add({"drive 3 left out", 40, "t = 11.0 s", 60});
  ASSERT_EQ(all.counts().size(), 1u);
  EXPECT_EQ(all.counts()[0].count, 45);
  EXPECT_EQ(all.counts()[0].of, 160);
  EXPECT_EQ(all.counts()[0].first, "t = 1.0 s");
}

/// Names and types in messages are of the sender.
TEST(Rejections, HaveABoundWhateverTextsOthersSend) {
  Rejections all;
  const std::string longer(10 * Rejections::kLongestReason, 'a');
  int told = 0;
  for (int i = 0; i < 10'000; ++i) told += all.add("no joint " + std::to_string(i), 0) ? 1 : 0;
  EXPECT_EQ(told, static_cast<int>(Rejections::kMostReasons));
  EXPECT_FALSE(all.add(longer, 0));
  ASSERT_EQ(all.counts().size(), Rejections::kMostReasons + 1);
  EXPECT_EQ(all.counts().back().count, 10'001 - static_cast<int>(Rejections::kMostReasons));
  Rejections few;
  EXPECT_TRUE(few.add(longer, 0));
  EXPECT_FALSE(few.add(longer, 0));
  EXPECT_EQ(few.counts()[0].reason.size(), Rejections::kLongestReason);
}

}  // namespace
}  // namespace viwo

// What updates declare, together: what they share, and how they contradict each other.
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "estimator_fixture.hpp"
#include "message_of.hpp"
#include "viwo/api/status.hpp"
#include "viwo/estimator/declarations.hpp"

namespace viwo {
namespace {

using testing::cells_spec;
using testing::CellSample;
using testing::error_of;
using testing::fixes_spec;
using testing::FixSample;
using testing::kStart;
using testing::numbers_block;
using testing::pose_block;
using testing::ticks_spec;
using testing::TickSample;
using testing::Vector6;

using Declare = std::function<void(Declarations&)>;

/// Declares what the test wants, and does nothing.
class Declaring final : public Update {
 public:
  explicit Declaring(Declare declare) : declare_(std::move(declare)) {}
  void declare(Declarations& host) override { declare_(host); }
  void update(const FilterView&, const EpochData&, FactorSink&) override {}

 private:
  Declare declare_;
};

UpdateEntry entry(const std::string& name, Declare declare, const std::string& sensor = "") {
  return {name, std::make_shared<Declaring>(std::move(declare)), nullptr, sensor};
}

/// What the table of updates "a", "b", ... says.
DeclarationTable table_of(const std::vector<Declare>& all) {
  DeclarationTable table;
  std::string name = "a";
  for (const Declare& declare : all) {
    table.declare(entry(name, declare));
    ++name[0];
  }
  table.finish();
  return table;
}
std::string table_refusal(const std::vector<Declare>& all) {
  return error_of([&] { table_of(all); });
}

BlockSpec slip() { return numbers_block("slip", "s_", {0.1, 0.2}, {0.01, 0.02}); }
Declare declares(const BlockSpec& spec) {
  return [spec](Declarations& host) { host.block(spec); };
}

TEST(Declarations, OfOneBlockByTwoUpdatesAreOneBlock) {
  BlockId first, second, other;
  const DeclarationTable table = table_of({[&](Declarations& host) {
                                             host.block(testing::arm_mount());
                                             first = host.block(slip());
                                           },
                                           [&](Declarations& host) {
                                             second = host.block(slip());
                                             other = host.block(testing::arm_numbers());
                                           }});
  EXPECT_EQ(first, second);
  EXPECT_NE(first, other);
  ASSERT_EQ(table.blocks().size(), 3u);
  EXPECT_EQ(table.blocks()[static_cast<std::size_t>(first.index)], slip());
}

TEST(Declarations, CanNameABlockThatAnotherUpdateDeclaresBeforeOrAfter) {
  BlockId early, late, declared;
  const DeclarationTable table =
      table_of({[&](Declarations& host) { early = host.block("slip"); },
                [&](Declarations& host) { declared = host.block(slip()); },
                [&](Declarations& host) { late = host.block("slip"); }});
  EXPECT_EQ(early, declared);
  EXPECT_EQ(late, declared);
  EXPECT_EQ(table.blocks(), std::vector<BlockSpec>{slip()});
}

TEST(Declarations, OfABlockThatNobodyDeclaresAreRefused) {
  const auto wants = [](Declarations& host) { host.block("slipp"); };
  EXPECT_EQ(table_refusal({wants}),
            "update 'a' needs the block 'slipp', which nobody declares - declared are: none");
  EXPECT_EQ(table_refusal({declares(slip()), declares(testing::arm_mount()), wants}),
            "update 'c' needs the block 'slipp', which nobody declares - declared are: slip, "
            "arm.mount");
}

TEST(Declarations, ThatDifferAreRefusedWithBothNames) {
  const auto refusal = [](auto change) {
    BlockSpec other = slip();
    change(other);
    const std::string text = table_refusal({declares(slip()), declares(other)});
    const std::string head = "updates 'a' and 'b' declare the block 'slip' differently: ";
    EXPECT_EQ(text.substr(0, head.size()), head);
    return text.substr(std::min(head.size(), text.size()));
  };
  EXPECT_EQ(refusal([](BlockSpec& spec) { spec.add("more", "m", 0., 0.); }), "2 and 3 entries");
  EXPECT_EQ(refusal([](BlockSpec& spec) { spec.entries[1].name = "x"; }), "entries 's_2' and 'x'");
  EXPECT_EQ(refusal([](BlockSpec& spec) { spec.entries[1].unit = "mm"; }), "'s_2' in 'm' and 'mm'");
  EXPECT_EQ(refusal([](BlockSpec& spec) { spec.entries[0].sigma = 0.; }), "sigmas of 's_1'");
  EXPECT_EQ(refusal([](BlockSpec& spec) { spec.entries[0].process_sigma = 1.; }),
            "sigmas of 's_1'");
  EXPECT_EQ(refusal([](BlockSpec& spec) { spec.entries[0].needs = Excitation::kTilt; }),
            "what is needed to learn 's_1'");
  EXPECT_EQ(refusal([](BlockSpec& spec) { spec.value[1] = 0.3; }), "values");
  EXPECT_EQ(refusal([](BlockSpec& spec) { spec.group = "base"; }), "groups");
  EXPECT_EQ(refusal([](BlockSpec& spec) { spec.process = Process::kRandomWalk; }), "processes");
  BlockSpec pose = pose_block("pose", "", {0., 0., 0.}, {0., 0., 0.}, Vector6::Ones());
  BlockSpec numbers{.name = "pose"};
  for (const BlockEntry& one : pose.entries) numbers.add(one.name, one.unit, 0., one.sigma);
  EXPECT_EQ(table_refusal({declares(pose), declares(numbers)}),
            "updates 'a' and 'b' declare the block 'pose' differently: retractions");
}

TEST(Declarations, OfOneEntryInTwoBlocksAreRefusedWithBothNames) {
  BlockSpec other = numbers_block("creep", "c_", {0.}, {1.});
  other.entries[0].name = "s_2";
  EXPECT_EQ(table_refusal({declares(slip()), declares(other)}),
            "update 'b': the entry 's_2' of its block 'creep' is also one of the block 'slip' of "
            "update 'a'");
}

TEST(Declarations, OfWhatIsNoBlockOrRoomAreRefused) {
  BlockSpec none = slip();
  none.value.pop_back();
  EXPECT_EQ(table_refusal({declares(none)}), "block 'slip': its value has 1 numbers, not 2");
  EXPECT_EQ(table_refusal({[](Declarations& host) {
              host.room({"points", 5, 12});
            }}),
            "room 'points': its blocks have 12 entries, not 1 to 9");
  EXPECT_EQ(table_refusal({[](Declarations& host) { host.stream({}); }}),
            "a stream without a kind of samples");
}

TEST(Declarations, OfGroupsThatCannotBeWatchedAreRefused) {
  BlockSpec alone = slip();
  alone.group = "base";
  EXPECT_EQ(table_refusal({declares(alone)}), "the group 'base' has no block that is a pose");
  EXPECT_EQ(table_refusal({declares(alone), declares(testing::base_mount())}), "");
  constexpr std::size_t kMost = InformationWindow::kMaxParameters;
  const std::vector<double> many(kMost - 5, 1.);
  EXPECT_EQ(table_refusal({declares(testing::base_mount()),
                           declares(numbers_block("many", "m_", many, many, "base"))}),
            "the group 'base' has " + std::to_string(kMost + 1) +
                " entries to be estimated, at most " + std::to_string(kMost) + " can be watched");
}

TEST(Declarations, OfRoomsBelongToTheUpdateThatMakesThem) {
  RoomId first, second;
  const DeclarationTable table = table_of({[](Declarations&) {},
                                           [&](Declarations& host) {
                                             first = host.room({"points", 5, 3});
                                           },
                                           [&](Declarations& host) {
                                             second = host.room({"points", 7, 1});
                                           }});
  ASSERT_EQ(table.rooms().size(), 2u);
  EXPECT_EQ(table.rooms()[static_cast<std::size_t>(second.index)].blocks, 7);
  EXPECT_EQ(table.owner_of(static_cast<std::size_t>(first.index)), 1u);
  EXPECT_EQ(table.owner_of(static_cast<std::size_t>(second.index)), 2u);
}

TEST(Declarations, OfOneStreamByTwoUpdatesShareIt) {
  StreamId first, second, third;
  const DeclarationTable table =
      table_of({[&](Declarations& host) { first = host.stream(fixes_spec()); },
                [&](Declarations& host) {
                  StreamSpec spec = fixes_spec();
                  spec.given = Given::kSinceOldestClone;
                  spec.awaited = true;
                  spec.clocks = {{0.5, {}}};
                  spec.per_instant = 2;
                  second = host.stream(spec);
                },
                [&](Declarations& host) { third = host.stream(ticks_spec()); }});
  ASSERT_EQ(table.streams().size(), 2u);
  const SharedStream& shared = table.streams()[0];
  EXPECT_EQ(shared.takers, "a, b");
  EXPECT_TRUE(shared.keeps);
  EXPECT_TRUE(shared.spec.awaited);
  EXPECT_FALSE(shared.spec.ends_epochs);
  EXPECT_EQ(shared.spec.per_instant, 2);
  EXPECT_EQ(shared.spec.clocks.size(), 1u);
  EXPECT_EQ(table.streams()[1].takers, "c");
  const auto taken = [&](StreamId id) { return table.taken()[static_cast<std::size_t>(id.index)]; };
  EXPECT_EQ(taken(first).stream, 0u);
  EXPECT_EQ(taken(first).given, Given::kOnce);
  EXPECT_EQ(taken(first).update, 0u);
  EXPECT_EQ(taken(second).stream, 0u);
  EXPECT_EQ(taken(second).given, Given::kSinceOldestClone);
  EXPECT_EQ(taken(second).update, 1u);
  EXPECT_EQ(taken(third).stream, 1u);
}

TEST(Declarations, OfAStreamAreOptionalIfNobodyNeedsIt) {
  const auto optional = [](bool is) {
    return [is](Declarations& host) {
      StreamSpec spec = fixes_spec();
      spec.optional = is;
      host.stream(spec);
    };
  };
  EXPECT_TRUE(table_of({optional(true), optional(true)}).streams()[0].spec.optional);
  EXPECT_FALSE(table_of({optional(true), optional(false)}).streams()[0].spec.optional);
}

TEST(Declarations, OfStreamsOfTwoSensorsAreTwoStreams) {
  DeclarationTable table;
  const auto takes = [](Declarations& host) { host.stream(fixes_spec()); };
  table.declare(entry("a", takes));
  table.declare(entry("b", takes, "left"));
  table.declare(entry(
      "c",
      [](Declarations& host) {
        StreamSpec spec = fixes_spec();
        spec.sensor = "right";
        host.stream(spec);
      },
      "left"));
  table.declare(entry("d", takes, "right"));
  table.finish();
  ASSERT_EQ(table.streams().size(), 3u);
  EXPECT_EQ(table.streams()[0].spec.sensor, "");
  EXPECT_EQ(table.streams()[1].spec.sensor, "left");
  EXPECT_EQ(table.streams()[2].spec.sensor, "right");
  EXPECT_EQ(table.streams()[2].takers, "c, d");
}

TEST(Declarations, OfSamplesOfAnotherVersionOrLayoutAreRefusedWithBothNames) {
  SampleType newer = sample_type<FixSample>();
  newer.version = 2;
  SampleType larger = sample_type<FixSample>();
  larger.layout += 1;
  const auto takes = [](const SampleType& type) {
    return [&type](Declarations& host) {
      StreamSpec spec = fixes_spec();
      spec.type = &type;
      host.stream(spec);
    };
  };
  const SampleType& mine = sample_type<FixSample>();
  EXPECT_EQ(table_refusal({takes(mine), takes(mine), takes(newer)}),
            "'a, b' and 'c' were built with fixes of different versions or layouts (1 and 2)");
  EXPECT_EQ(table_refusal({takes(mine), takes(larger)}),
            "'a' and 'b' were built with fixes of different versions or layouts (1 and 1)");
  const SampleType copy = mine;  // as another library has it
  EXPECT_EQ(table_refusal({takes(mine), takes(copy)}), "");
}

TEST(Declarations, OfTwoClocksForOneStreamAreRefusedWithBothNames) {
  const auto takes = [](double constant_s, const char* block) {
    return [=](Declarations& host) {
      StreamSpec spec = fixes_spec();
      BlockSpec clock{.name = block};
      spec.clocks = {{constant_s, host.block(clock.add(block, "s", 0., 0.1))}};
      host.stream(spec);
    };
  };
  EXPECT_EQ(table_refusal({takes(0., "x"), takes(0., "x")}), "");
  EXPECT_EQ(table_refusal({takes(0., "x"), takes(0., "y")}),
            "'a' and 'b' take the clock of the fixes from different blocks");
  EXPECT_EQ(table_refusal({takes(0., "x"), takes(0.1, "x")}),
            "'a' and 'b' take the clock of the fixes from different blocks");
}

TEST(Declarations, OfAClockThatIsNoneAreRefused) {
  EXPECT_EQ(table_refusal({[](Declarations& host) {
              host.stream(cells_spec(host.block(testing::arm_mount())));
            }}),
            "the block 'arm.mount' is no clock for the cells of 'a': it has 6 entries, not one");
}

/// Keeps what it is given to declare with, and declares in a later call.
class Late final : public Update {
 public:
  enum class When { kInStart, kInUpdate, kInSettle };
  explicit Late(When when) : when_(when) {}
  void declare(Declarations& host) override {
    host_ = &host;
    host.room({"points", 1, 1});
    host.stream(ticks_spec());
  }
  void start(const UpdateSetup&) override { declare_at(When::kInStart); }
  void update(const FilterView&, const EpochData&, FactorSink&) override {
    ++calls;
    declare_at(When::kInUpdate);
  }
  void settle(const FilterView&, BlockEdits&) override { declare_at(When::kInSettle); }
  int calls = 0;

 private:
  void declare_at(When now) {
    if (now == when_) host_->block(slip());
  }
  When when_;
  Declarations* host_ = nullptr;
};

TEST(Declarations, AfterTheStartTurnTheUpdateOffAndTheRunGoesOn) {
  for (const Late::When when : {Late::When::kInUpdate, Late::When::kInSettle}) {
    const auto late = std::make_shared<Late>(when);
    const auto good = std::make_shared<testing::FakeUpdate>();
    Estimator estimator({}, {{"late", late, nullptr, ""}, {"good", good, nullptr, ""}});
    estimator.start(testing::level_prior(kStart));
    for (std::int64_t t = 0; t <= 1000; t += 10) {
      estimator.add(testing::imu_at(kStart + t * testing::kMs));
      if (t % 100 == 50) estimator.add(0, testing::tick_at(kStart + t * testing::kMs));
      while (estimator.step()) {
      }
    }
    EXPECT_EQ(late->calls, 1);
    EXPECT_EQ(good->seen.size(), 10u);
    EXPECT_TRUE(estimator.failures()[0].disabled);
    EXPECT_EQ(estimator.failures()[0].count, 1);
    EXPECT_EQ(estimator.failures()[0].cause, "declares something after the start");
    EXPECT_EQ(estimator.failures()[1].count, 0);
  }
}

TEST(Declarations, WithinTheStartEndTheRunWithTheNameOfTheUpdate) {
  const auto late = std::make_shared<Late>(Late::When::kInStart);
  EXPECT_EQ(error_of<UpdateFailure>([&] {
              const Estimator estimator({}, {{"late", late, nullptr, ""}});
            }),
            "update 'late' failed: declares something after the start");
}

TEST(Declarations, ThatThrowNameTheUpdate) {
  const auto refusal = [](Declare declare) -> std::string {
    try {
      const Estimator estimator({}, {entry("odd", std::move(declare))});
    } catch (const UpdateFailure& failure) {
      return failure.what();
    } catch (const InputError& error) {
      return std::string("input: ") + error.what();
    }
    return "(accepted)";
  };
  EXPECT_EQ(refusal([](Declarations&) { throw std::runtime_error("no idea"); }),
            "update 'odd' failed: no idea");
  EXPECT_EQ(refusal([](Declarations&) { throw 7; }),
            "update 'odd' failed: threw something that is not a std::exception");
  EXPECT_EQ(refusal([](Declarations&) { throw InputError("needs a thing"); }),
            "input: needs a thing");
}

TEST(Declarations, ShowEachUpdateItsOwnPartOfTheConfiguration) {
  const auto rig = std::make_shared<Rig>();
  const Rig *own = nullptr, *none = nullptr;
  DeclarationTable table;
  table.declare(
      {"a", std::make_shared<Declaring>([&](Declarations& host) { own = &host.rig(); }), rig, ""});
  table.declare(entry("b", [&](Declarations& host) { none = &host.rig(); }));
  EXPECT_EQ(own, rig.get());
  ASSERT_NE(none, nullptr);
  EXPECT_NE(none, own);
}

}  // namespace
}  // namespace viwo

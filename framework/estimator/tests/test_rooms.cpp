// Updates that add, rewrite and drop blocks while the filter runs, by the contract and against it.
#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "estimator_fixture.hpp"
#include "viwo/api/status.hpp"
#include "viwo/estimator/estimator.hpp"

namespace viwo {
namespace {

using testing::Counts;
using testing::counts_of;
using testing::FakeUpdate;
using testing::imu_at;
using testing::kMs;
using testing::kNaN;
using testing::kStart;
using testing::level_prior;

/// Has a room, and does in it what the test wants.
class Roomy final : public Update {
 public:
  using Work = std::function<void(Roomy&, const FilterView&, FactorSink&)>;
  using Settle = std::function<void(Roomy&, const FilterView&, BlockEdits&)>;
  Roomy(RoomSpec spec, Work work, Settle settle = {})
      : spec_(std::move(spec)), work_(std::move(work)), settle_(std::move(settle)) {}
  void declare(Declarations& host) override {
    if (spec_.blocks > 0) room = host.room(spec_);
    host.stream(testing::ticks_spec());
  }
  void update(const FilterView& filter, const EpochData&, FactorSink& sink) override {
    ++updates;
    work_(*this, filter, sink);
  }
  void settle(const FilterView& filter, BlockEdits& edits) override {
    ++settles;
    if (settle_) settle_(*this, filter, edits);
  }

  /// A block that is seen with sigma 0.1 from where the base is.
  std::optional<BlockId> add(const FilterView& filter, FactorSink& sink, double value,
                             bool determine = true) {
    const std::vector<double> values(static_cast<std::size_t>(spec_.entries), value);
    const auto id = sink.add_block(room, values);
    if (!id) return id;
    if (factor_ == nullptr) {
      factor_ = &sink.add_information();
      factor_->columns.add(kPositionColumn, 3);
      factor_->Lambda.topLeftCorner(3, 3).setZero();
      factor_->eta.head(3).setZero();
    }
    const BlockView& view = filter.block(*id);
    const int at = factor_->columns.add(view.column(), view.size());
    factor_->Lambda.middleRows(at, view.size()).setZero();
    factor_->eta.segment(at, view.size()).setConstant(0.5);
    for (int i = 0; i < view.size() && determine; ++i) {
      factor_->Lambda(i, i) += 100.;
      factor_->Lambda(at + i, at + i) = 100.;
      factor_->Lambda(at + i, i) = -100.;
    }
    return id;
  }
  void begin() { factor_ = nullptr; }

  RoomId room;
  int updates = 0, settles = 0;
  std::vector<BlockId> mine;

 private:
  RoomSpec spec_;
  Work work_;
  Settle settle_;
  InformationFactor* factor_ = nullptr;
};

/// Two updates and ten epochs.
struct RoomBench {
  std::shared_ptr<Roomy> roomy;
  std::shared_ptr<FakeUpdate> good = std::make_shared<FakeUpdate>();
  std::shared_ptr<Roomy> other;
  Estimator estimator;

  RoomBench(RoomSpec spec, Roomy::Work work, Roomy::Settle settle = {}, Roomy::Work of_other = {})
      : roomy(std::make_shared<Roomy>(std::move(spec), std::move(work), std::move(settle))),
        other(std::make_shared<Roomy>(
            RoomSpec{"lines", of_other ? 2 : 0, 2},
            of_other ? of_other : [](auto&, auto&, auto&) {})),
        estimator({}, {{"roomy", roomy, nullptr, ""},
                       {"good", good, nullptr, ""},
                       {"other", other, nullptr, ""}}) {
    estimator.start(level_prior(kStart));
    for (std::int64_t t = 0; t <= 1050; t += 10) {
      estimator.add(imu_at(kStart + t * kMs));
      if (t % 100 == 0 && t > 0) estimator.add(0, testing::tick_at(kStart + t * kMs));
      while (estimator.step()) {
      }
    }
    EXPECT_EQ(good->seen.size(), 10u) << "the filter goes on";
    EXPECT_EQ(estimator.failure(), "");
  }

  /// Empty as long as it runs.
  std::string turned_off() const {
    const UpdateFailures& failures = estimator.failures()[0];
    if (!failures.disabled) return "";
    EXPECT_EQ(failures.count, 1);
    return failures.cause;
  }
};

const RoomSpec kPointRoom{"points", 3, 3};

TEST(Rooms, AreFilledUntilTheyAreFullAndEmptiedAgain) {
  std::vector<std::size_t> added;
  RoomBench bench(
      kPointRoom,
      [&](Roomy& roomy, const FilterView& filter, FactorSink& sink) {
        roomy.begin();
        added.push_back(0);
        for (int i = 0; i < 2; ++i) {
          if (const auto id = roomy.add(filter, sink, 1.)) {
            roomy.mine.push_back(*id);
            ++added.back();
          }
        }
      },
      [](Roomy& roomy, const FilterView& filter, BlockEdits& edits) {
        for (const BlockId id : roomy.mine) {
          EXPECT_GT(filter.P()(filter.block(id).column(), filter.block(id).column()), 0.);
        }
        if (roomy.updates == 4) {
          edits.drop(roomy.mine[1]);
          roomy.mine.erase(roomy.mine.begin() + 1);
        }
      });
  EXPECT_EQ(added, (std::vector<std::size_t>{2, 1, 0, 0, 1, 0, 0, 0, 0, 0}));
  EXPECT_EQ(bench.roomy->mine, (std::vector<BlockId>{{2}, {4}, {3}}))
      << "behind the two that are declared; the place that was free last is used first";
  EXPECT_EQ(bench.roomy->settles, 10);
  EXPECT_EQ(bench.other->settles, 0) << "it has no room";
  EXPECT_EQ(bench.turned_off(), "");
  EXPECT_EQ(bench.estimator.counts()[0].applied, 0) << "information is counted by the update";
}

TEST(Rooms, BlocksThatTheFactorDoesNotDetermineAreNotAdded) {
  RoomBench bench(kPointRoom, [](Roomy& roomy, const FilterView& filter, FactorSink& sink) {
    roomy.begin();
    EXPECT_TRUE(roomy.add(filter, sink, 1., false)) << "there is always room";
  });
  EXPECT_EQ(bench.roomy->updates, 10);
  EXPECT_EQ(counts_of(bench.estimator).at("roomy: new blocks that no information determines"), 10);
  EXPECT_FALSE(bench.estimator.filter().blocks().exists({2}));
}

TEST(Rooms, BlocksWithoutAnyFactorAreNotAdded) {
  RoomBench bench(kPointRoom, [](Roomy& roomy, const FilterView&, FactorSink& sink) {
    sink.add_block(roomy.room, std::array{1., 2., 3.});
  });
  EXPECT_EQ(counts_of(bench.estimator).at("roomy: new blocks that no information determines"), 10);
  EXPECT_EQ(bench.estimator.filter().blocks().free_blocks({0}).size(), 3u);
}

TEST(Rooms, BlocksAreAddedWithTheResidualsOfTheSameCallTakenIntoAccount) {
  // The base is observed at 0.3 first; the block is where it is, plus its own observation.
  RoomBench bench(kPointRoom, [](Roomy& roomy, const FilterView& filter, FactorSink& sink) {
    if (roomy.updates > 1) return;
    roomy.begin();
    sink.add_residual() =
        testing::observation(kPositionColumn, Eigen::Vector3d::Constant(0.3), 1e-6);
    EXPECT_TRUE(roomy.add(filter, sink, 0.));
  });
  const Filter& filter = bench.estimator.filter();
  // eta = 0.5 of the block and none of the position: the block is 0.005 off what it is tied to.
  EXPECT_NEAR(filter.blocks().view({2}).numbers()[0], 0.3 + 0.5 / 100., 1e-3);
}

/// What turns an update off that adds a block in its first epoch and then misbehaves.
std::string offence(const std::function<void(Roomy&, const FilterView&, BlockEdits&)>& settle) {
  RoomBench bench(
      kPointRoom,
      [](Roomy& roomy, const FilterView& filter, FactorSink& sink) {
        roomy.begin();
        if (roomy.updates == 1) roomy.mine.push_back(*roomy.add(filter, sink, 1.));
      },
      settle,
      [](Roomy& roomy, const FilterView& filter, FactorSink& sink) {
        roomy.begin();
        if (roomy.updates == 1) roomy.mine.push_back(*roomy.add(filter, sink, 1.));
      });
  EXPECT_FALSE(bench.estimator.failures()[2].disabled);
  EXPECT_EQ(bench.estimator.failures()[2].count, 0);
  const std::string cause = bench.turned_off();
  if (!cause.empty()) {
    EXPECT_LT(bench.roomy->updates, 10);
  }
  return cause;
}

BlockRewrite copy_of(BlockId id, const FilterView& filter) {
  BlockRewrite anew;
  anew.id = id;
  anew.columns.add(filter.block(id).column(), filter.block(id).size());
  anew.J.setIdentity(3, 3);
  return anew;
}

TEST(Rooms, DroppingABlockTwiceTurnsTheUpdateOff) {
  EXPECT_EQ(offence([](Roomy& roomy, const FilterView&, BlockEdits& edits) {
              edits.drop(roomy.mine[0]);
              edits.drop(roomy.mine[0]);
            }),
            "drops a block that does not exist (any more)");
}

TEST(Rooms, DroppingWhatIsNotItsOwnTurnsTheUpdateOff) {
  const std::string text = "drops a block that is not its own";
  EXPECT_EQ(offence([](Roomy&, const FilterView&, BlockEdits& edits) { edits.drop({5}); }), text)
      << "of another update";
  EXPECT_EQ(offence([](Roomy&, const FilterView&, BlockEdits& edits) { edits.drop({0}); }), text)
      << "a declared one";
  EXPECT_EQ(offence([](Roomy&, const FilterView&, BlockEdits& edits) { edits.drop({}); }), text);
  EXPECT_EQ(offence([](Roomy&, const FilterView&, BlockEdits& edits) { edits.drop({77}); }), text);
}

TEST(Rooms, DroppingWhatWasNeverAddedTurnsTheUpdateOff) {
  EXPECT_EQ(offence([](Roomy&, const FilterView&, BlockEdits& edits) { edits.drop({3}); }),
            "drops a block that does not exist (any more)");
}

TEST(Rooms, RewritingByTheContractIsFine) {
  EXPECT_EQ(offence([](Roomy& roomy, const FilterView& filter, BlockEdits& edits) {
              edits.rewrite(copy_of(roomy.mine[0], filter));
            }),
            "");
}

TEST(Rooms, RewritingAgainstTheContractTurnsTheUpdateOff) {
  const auto with = [](auto change) {
    return offence([change](Roomy& roomy, const FilterView& filter, BlockEdits& edits) {
      BlockRewrite anew = copy_of(roomy.mine[0], filter);
      change(anew, filter);
      edits.rewrite(anew);
    });
  };
  const std::string size = "rewrites a block with a Jacobian of another size";
  EXPECT_EQ(with([](BlockRewrite& anew, auto&) { anew.J.setIdentity(2, 3); }), size);
  EXPECT_EQ(with([](BlockRewrite& anew, auto&) { anew.J.setIdentity(3, 4); }), size);
  EXPECT_EQ(with([](BlockRewrite& anew, auto&) { anew.columns.add(0, 3); }), size);
  int state_size = 0;
  const std::string beyond = with([&](BlockRewrite& anew, const FilterView& filter) {
    state_size = filter.size;
    anew.columns.clear();
    anew.columns.add(filter.size - 2, 3);
  });
  EXPECT_EQ(beyond, "rewrites a block: columns " + std::to_string(state_size - 2) + " to " +
                        std::to_string(state_size) + " are not in the state of " +
                        std::to_string(state_size));
  const std::string not_finite = "rewrites a block with what is not finite";
  EXPECT_EQ(with([](BlockRewrite& anew, auto&) { anew.J(1, 1) = kNaN; }), not_finite);
  EXPECT_EQ(with([](BlockRewrite& anew, auto&) { anew.value[2] = kNaN; }), not_finite);
  EXPECT_EQ(with([](BlockRewrite& anew, auto&) { anew.first_estimate[0] = kNaN; }), not_finite);
  EXPECT_EQ(with([](BlockRewrite& anew, auto&) { anew.value[3] = kNaN; }), "")
      << "behind its entries";
  EXPECT_EQ(with([](BlockRewrite& anew, auto&) { anew.id = {5}; }),
            "rewrites a block that is not its own");
  EXPECT_EQ(with([](BlockRewrite& anew, auto&) { anew.id = {3}; }),
            "rewrites a block that does not exist (any more)");
}

TEST(Rooms, AddingAgainstTheContractTurnsTheUpdateOffAndNothingOfItIsUsed) {
  const auto adding = [](auto add) {
    RoomBench bench(
        kPointRoom,
        [&](Roomy& roomy, const FilterView&, FactorSink& sink) {
          sink.add_residual() =
              testing::observation(kPositionColumn, Eigen::Vector3d::Constant(50.), 1e-3);
          add(roomy, sink);
        },
        {}, [](Roomy&, const FilterView&, FactorSink&) {});
    EXPECT_EQ(bench.roomy->updates, 1);
    EXPECT_EQ(bench.estimator.counts()[0].applied, 0);
    return bench.turned_off();
  };
  const std::string text = "adds a block to a room that it has not declared";
  EXPECT_EQ(adding([](Roomy&, FactorSink& sink) {
              sink.add_block({1}, std::array{1., 2.});
            }),
            text)
      << "of another update";
  EXPECT_EQ(adding([](Roomy&, FactorSink& sink) {
              sink.add_block({}, std::array{1., 2., 3.});
            }),
            text);
  EXPECT_EQ(adding([](Roomy&, FactorSink& sink) {
              sink.add_block({2}, std::array{1., 2., 3.});
            }),
            text);
  EXPECT_EQ(adding([](Roomy& roomy, FactorSink& sink) {
              sink.add_block(roomy.room, std::array{1., 2.});
            }),
            "adds a block of 2 numbers to a room for blocks of 3");
}

TEST(Rooms, BlocksOfAnUpdateThatIsTurnedOffStayInTheState) {
  RoomBench bench(
      kPointRoom,
      [](Roomy& roomy, const FilterView& filter, FactorSink& sink) {
        roomy.begin();
        roomy.add(filter, sink, 1.);
      },
      [](Roomy&, const FilterView&, BlockEdits&) { throw ContractError("does as it likes"); });
  EXPECT_EQ(bench.roomy->updates, 1);
  EXPECT_EQ(bench.turned_off(), "does as it likes");
  EXPECT_TRUE(bench.estimator.filter().blocks().exists({2}));
}

}  // namespace
}  // namespace viwo

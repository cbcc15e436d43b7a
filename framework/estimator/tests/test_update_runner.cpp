// Updates at work: what they are given, how their factors are applied, and what becomes of those
// that fail.
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "estimator_fixture.hpp"
#include "message_of.hpp"
#include "viwo/api/status.hpp"
#include "viwo/estimator/estimator.hpp"
#include "viwo/plugin_host/plugin_info.hpp"

namespace viwo {
namespace {

using testing::Bench;
using testing::CellSample;
using testing::Counts;
using testing::error_of;
using testing::FakeUpdate;
using testing::FixSample;
using testing::imu_at;
using testing::kMs;
using testing::kNaN;
using testing::kStart;
using testing::level_prior;
using testing::observation;
using testing::Random;
using testing::tick_at;
using testing::TickSample;

TEST(UpdateRunner, SkipsAnUpdateThatThrowsAndDisablesItAfterACount) {
  int calls = 0;
  EstimatorOptions options;
  options.runner.max_update_failures = 3;
  Bench bench = Bench::started(
      {},
      [&](const FilterView&, FactorSink& sink) {
        ++calls;
        sink.count(5, 0);
        sink.add_residual() = observation(kPositionColumn, Eigen::Vector3d::Constant(1.), 1e-3);
        if (calls == 2) return;
        if (calls == 1) throw std::runtime_error("nothing to see here");
        throw 42;
      },
      options);
  bench.imu(-10, 1000);
  for (int t = 100; t <= 800; t += 100) bench.tick(t);
  EXPECT_EQ(bench.steps(), 8) << "the run goes on";
  EXPECT_EQ(calls, 4) << "the third failure is in the fourth call";
  const UpdateFailures& failures = bench.estimator.failures()[0];
  EXPECT_EQ(failures.count, 3);
  EXPECT_TRUE(failures.disabled);
  EXPECT_EQ(failures.cause, "nothing to see here") << "the first cause is the one to mend";
  EXPECT_EQ(bench.estimator.counts()[0].applied, 5 + 1)
      << "nothing of an epoch that failed is used";
}

TEST(UpdateRunner, KeepsAnUpdateThatFailsLessOftenThanTheLimit) {
  int calls = 0;
  Bench bench = Bench::started({}, [&](auto&, auto&) {
    if (++calls <= 9) throw InputError("not yet");
  });
  bench.imu(-10, 1600);
  for (int t = 100; t <= 1500; t += 100) bench.tick(t);
  EXPECT_EQ(bench.steps(), 15);
  EXPECT_EQ(calls, 15);
  EXPECT_EQ(bench.estimator.failures()[0].count, 9);
  EXPECT_FALSE(bench.estimator.failures()[0].disabled);
  EXPECT_EQ(bench.estimator.failures()[0].cause, "not yet");
}

TEST(UpdateRunner, EndsWhenAKinematicModelThrows) {
  const PluginInfo info{"kinematics", "odd", "1", "", "", "odd.so", {}};
  Bench bench =
      Bench::started({}, [&](auto&, auto&) { throw PluginFailure(info, "rows", "seven legs"); });
  bench.imu(-10, 200);
  bench.tick(100);
  EXPECT_EQ(error_of<PluginFailure>([&] { bench.steps(); }),
            "kinematics plugin 'odd' 1 (odd.so) failed in rows: seven legs");
}

TEST(UpdateRunner, NamesTheUpdateThatThrewInAnAnalysis) {
  const auto failure_of = [](const FakeUpdate::Emit& emit) {
    EstimatorOptions options;
    options.runner.frozen = true;
    Bench bench = Bench::started({}, emit, options);
    bench.imu(-10, 200);
    bench.tick(100);
    return error_of<UpdateFailure>([&] { bench.steps(); });
  };
  EXPECT_EQ(failure_of([](auto&, auto&) { throw std::runtime_error("nothing to see here"); }),
            "update 'fake' failed: nothing to see here");
  EXPECT_EQ(failure_of([](auto&, auto&) { throw 42; }),
            "update 'fake' failed: threw something that is not a std::exception");
  EXPECT_EQ(failure_of([](auto&, auto&) { throw ContractError("drops what it must not"); }),
            "update 'fake' failed: drops what it must not");
  EXPECT_EQ(failure_of([](auto&, FactorSink& sink) {
              for (;;) sink.add_residual();
            }),
            "update 'fake' failed: too many residual factors");
}

TEST(UpdateRunner, TurnsAnUpdateOffWhoseFactorsDoNotFit) {
  int size = 0;
  const auto offence = [&size](auto make) {
    int calls = 0;
    Bench bench = Bench::started({}, [&](const FilterView& filter, FactorSink& sink) {
      ++calls;
      size = filter.size;
      make(sink);
    });
    bench.imu(-10, 300);
    for (const std::int64_t t : {100, 200}) bench.tick(t);
    EXPECT_EQ(bench.steps(), 2);
    const UpdateFailures& failures = bench.estimator.failures()[0];
    EXPECT_EQ(calls, failures.disabled ? 1 : 2);
    EXPECT_EQ(bench.estimator.counts()[0].applied, failures.disabled ? 0 : 2);
    return failures.cause;
  };
  const auto residual = [](auto change) {
    return [change](FactorSink& sink) {
      ResidualFactor& factor = sink.add_residual();
      factor = observation(kPositionColumn, Eigen::Vector3d::Zero(), 1.);
      change(factor);
    };
  };
  EXPECT_EQ(offence(residual([](auto&) {})), "");
  const std::string from = "a residual factor: ";
  const std::string set_rows = " columns - call set_rows() after the columns";
  EXPECT_EQ(offence(residual([](auto& factor) {
              factor.columns.add(1000000, 3);
              factor.set_rows(3);
            })),
            from + "columns 1000000 to 1000002 are not in the state of " + std::to_string(size));
  EXPECT_EQ(offence(residual([](auto& factor) {
              factor.columns.add(kPositionColumn + 2, 2);
              factor.set_rows(3);
            })),
            from + "columns " + std::to_string(kPositionColumn + 2) + " to " +
                std::to_string(kPositionColumn + 3) + " overlap another block");
  EXPECT_EQ(offence(residual([](auto& factor) { factor.columns.add(0, 3); })),
            from + "H is 3 x 3 and R 3 x 3 for 3 residuals and 6" + set_rows);
  EXPECT_EQ(offence(residual([](auto& factor) { factor.R.setIdentity(2, 2); })),
            from + "H is 3 x 3 and R 2 x 2 for 3 residuals and 3" + set_rows);
  EXPECT_EQ(
      offence([](FactorSink& sink) {
        InformationFactor& factor = sink.add_information();
        factor.columns.add(kPositionColumn, 3);
        factor.Lambda.setZero(2, 2);
      }),
      "an information factor: Lambda is 2 x 2 and eta " + std::to_string(size) + " for 3 columns");
}

TEST(UpdateRunner, CountsFactorsAndWhatUpdatesCountThemselves) {
  Bench bench = Bench::started({}, [](const FilterView&, FactorSink& sink) {
    sink.count(5, 2);
    sink.add_residual() = observation(kPositionColumn, Eigen::Vector3d::Zero(), 1.);
    sink.add_residual() = observation(kPositionColumn, Eigen::Vector3d::Zero(), 1.);
    ResidualFactor& outlier = sink.add_residual();
    outlier = observation(kPositionColumn, Eigen::Vector3d::Constant(1e3), 0.1);
    outlier.gate_probability = 0.01;
    sink.add_residual() = observation(kPositionColumn, Eigen::Vector3d::Constant(kNaN), 1.);
  });
  bench.imu(-10, 300);
  for (const std::int64_t t : {100, 200}) bench.tick(t);
  EXPECT_EQ(bench.steps(), 2);
  EXPECT_EQ(bench.estimator.counts()[0].applied, 2 * (5 + 2));
  EXPECT_EQ(bench.estimator.counts()[0].rejected, 2 * (2 + 2));
  EXPECT_LT(bench.estimator.filter().imu().p_IinG.norm(), 1.);
  EXPECT_EQ(bench.estimator.updates()[0].name, "fake");
  const std::vector<RejectionCount> rejections = bench.estimator.rejections();
  ASSERT_GE(rejections.size(), 3U);
  const RejectionCount& own = rejections[rejections.size() - 3];
  EXPECT_EQ(own.reason, "fake: a reason of its own");
  EXPECT_EQ(own.count, 3);
  const RejectionCount& gated = rejections[rejections.size() - 2];
  EXPECT_EQ(gated.reason, "fake: measurement dropped by the chi-square gate");
  EXPECT_EQ(gated.count, 2);
  EXPECT_EQ(gated.first, "stamp " + std::to_string(kStart + 100 * kMs) + " ns");
  EXPECT_EQ(rejections.back().reason,
            "fake: residual factor that is not finite, or whose noise is not positive definite");
  EXPECT_EQ(rejections.back().count, 2);
}

TEST(UpdateRunner, CountsInformationThatIsNotFinite) {
  Bench bench = Bench::started({}, [](const FilterView&, FactorSink& sink) {
    InformationFactor& factor = sink.add_information();
    factor.columns.add(0, 3);
    factor.Lambda.topLeftCorner(3, 3).setConstant(kNaN);
    factor.eta.head(3).setZero();
  });
  bench.imu(-10, 200);
  bench.tick(100);
  EXPECT_EQ(bench.steps(), 1);
  EXPECT_EQ(bench.rejected(), (Counts{{"fake: information that is not finite or empty", 1}}));
  EXPECT_EQ(bench.estimator.failure(), "");
}

TEST(UpdateRunner, AppliesTheFactorsOfOneCallAsOneJointUpdate) {
  Random random(11);
  const auto linear = [](const Eigen::MatrixXd& H, const Eigen::VectorXd& r) {
    ResidualFactor factor;
    factor.columns.add(kPositionColumn, 6);  // position and velocity add: exactly linear
    factor.set_rows(static_cast<int>(r.size()));
    factor.H = H;
    factor.residual = r;
    factor.R.setIdentity();
    factor.R *= 1e-4;
    return factor;
  };
  const Eigen::MatrixXd H1 = random.matrix(2, 6), H2 = random.matrix(3, 6), A = random.matrix(4, 6);
  const Eigen::VectorXd r1 = random.matrix(2, 1), r2 = random.matrix(3, 1),
                        ra = random.matrix(4, 1);
  Eigen::VectorXd before, expected;
  const auto pv = [](const ImuState& imu) {
    Eigen::VectorXd x(6);
    x << imu.p_IinG, imu.v_IinG;
    return x;
  };
  Bench bench = Bench::started({}, [&](const FilterView& view, FactorSink& sink) {
    sink.add_residual() = linear(H1, r1);
    sink.add_residual() = linear(H2, r2);
    InformationFactor& information = sink.add_information();
    information.columns.add(kPositionColumn, 6);
    information.Lambda.setConstant(kNaN);  // only the lower triangle is read
    information.Lambda.topLeftCorner(6, 6).triangularView<Eigen::Lower>() = A.transpose() * A * 1e4;
    information.eta.head(6) = A.transpose() * ra * 1e4;
    Eigen::MatrixXd H(9, 6);
    H << H1, H2, A;
    Eigen::VectorXd r(9);
    r << r1, r2, ra;
    const Eigen::MatrixXd P = view.P().block(kPositionColumn, kPositionColumn, 6, 6);
    const Eigen::MatrixXd S = H * P * H.transpose() + 1e-4 * Eigen::MatrixXd::Identity(9, 9);
    before = pv(view.imu);
    expected = before + P * H.transpose() * S.inverse() * r;
  });
  bench.imu(-10, 200);
  bench.tick(100);
  ASSERT_EQ(bench.steps(), 1);
  EXPECT_GT((expected - before).norm(), 0.1);
  EXPECT_LT((pv(bench.estimator.filter().imu()) - expected).norm(), 1e-9);
}

TEST(UpdateRunner, TakesResidualsAsZeroInAnAnalysis) {
  EstimatorOptions options;
  options.runner.frozen = true;
  const auto run = [&](double residual) {
    Bench bench = Bench::started(
        {},
        [&](const FilterView&, FactorSink& sink) {
          sink.add_residual() =
              observation(kPositionColumn, Eigen::Vector3d::Constant(residual), 0.1);
          InformationFactor& information = sink.add_information();
          information.columns.add(kVelocityColumn, 3);
          information.Lambda.topLeftCorner(3, 3).setIdentity();
          information.eta.head(3).setConstant(residual);
        },
        options);
    bench.imu(-10, 300);
    for (const std::int64_t t : {100, 200}) bench.tick(t);
    EXPECT_EQ(bench.steps(), 2);
    const Filter& filter = bench.estimator.filter();
    return std::pair{filter.imu().p_IinG, Eigen::MatrixXd(filter.covariance())};
  };
  const auto with = run(0.5), without = run(0.);
  EXPECT_EQ(with.first, without.first);
  EXPECT_EQ(with.second, without.second);
}

/// Looks at every stream that an update is shown, not only at its own.
class Curious final : public Update {
 public:
  explicit Curious(std::vector<StreamSpec> streams) : streams_(std::move(streams)) {}
  void declare(Declarations& host) override {
    for (const StreamSpec& spec : streams_) own.push_back(host.stream(spec).index);
  }
  void update(const FilterView&, const EpochData& data, FactorSink&) override {
    std::vector<int> full;
    for (std::size_t i = 0; i < data.streams.size(); ++i) {
      if (data.streams[i].size > 0) full.push_back(static_cast<int>(i));
    }
    shown.push_back(full);
    if (!streams_.empty() && *streams_[0].type == sample_type<FixSample>()) {
      for (const FixSample& fix : data.samples<FixSample>(StreamId{own[0]})) {
        values.push_back(fix.value);
      }
      EXPECT_THROW(data.samples<TickSample>(StreamId{own[0]}), std::logic_error);
    }
  }
  std::vector<int> own;
  std::vector<std::vector<int>> shown;  ///< by call: the streams that were not empty
  std::vector<double> values;

 private:
  std::vector<StreamSpec> streams_;
};

/// Notes which streams an observer is shown.
class StreamObserver final : public EstimatorObserver {
 public:
  void on_epoch(const Filter&, const EpochData& data) override {
    for (const SampleSpan& span : data.streams) sizes.push_back(span.size);
  }
  std::vector<std::size_t> sizes;
};

TEST(UpdateRunner, ShowsEachUpdateTheSamplesOfItsOwnStreamsOnly) {
  // GIVEN updates of ticks, of fixes, of nothing, of cells, of fixes again
  const auto ticks = std::make_shared<Curious>(std::vector{testing::ticks_spec()});
  const auto fixes = std::make_shared<Curious>(std::vector{testing::fixes_spec()});
  const auto none = std::make_shared<Curious>(std::vector<StreamSpec>{});
  const auto cells = std::make_shared<Curious>(std::vector{testing::cells_spec({})});
  const auto again = std::make_shared<Curious>(std::vector{testing::fixes_spec()});
  Estimator estimator({}, {{"ticks", ticks, nullptr, ""},
                           {"fixes", fixes, nullptr, ""},
                           {"none", none, nullptr, ""},
                           {"cells", cells, nullptr, ""},
                           {"again", again, nullptr, ""}});
  ASSERT_EQ(estimator.streams().size(), 3u);
  StreamObserver observer;
  estimator.observe(&observer);
  estimator.start(level_prior(kStart));
  for (std::int64_t t = 0; t <= 110; t += 10) {
    estimator.add(imu_at(kStart + t * kMs));
    estimator.add(1, FixSample{kStart + t * kMs + 1, static_cast<double>(t)});
    estimator.add(2, testing::cell_at(kStart + t * kMs));
  }
  estimator.add(0, tick_at(kStart + 100 * kMs));
  // WHEN there is an epoch
  ASSERT_TRUE(estimator.step());
  // THEN
  EXPECT_EQ(ticks->shown, (std::vector<std::vector<int>>{{ticks->own[0]}}));
  EXPECT_EQ(fixes->shown, (std::vector<std::vector<int>>{{fixes->own[0]}}));
  EXPECT_EQ(none->shown, (std::vector<std::vector<int>>{{}}));
  EXPECT_EQ(cells->shown, (std::vector<std::vector<int>>{{cells->own[0]}}));
  EXPECT_EQ(again->shown, (std::vector<std::vector<int>>{{again->own[0]}}));
  EXPECT_NE(fixes->own[0], again->own[0]);
  EXPECT_EQ(fixes->values, again->values) << "both have the shared samples";
  EXPECT_EQ(fixes->values, (std::vector<double>{0, 10, 20, 30, 40, 50, 60, 70, 80, 90}));
  // AND who observes has each where it was declared, whoever came last
  EXPECT_EQ(observer.sizes, (std::vector<std::size_t>{1, 10, 12, 10}));
}

}  // namespace
}  // namespace viwo

// When the estimator makes epochs, what it hands to the updates and does with their factors.
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "estimator_fixture.hpp"
#include "viwo/filter/estimator.hpp"
#include "viwo/plugin_host/plugin_info.hpp"

namespace viwo {
namespace {

using testing::Counts;
using testing::encoder_at;
using testing::expect_same;
using testing::FakeUpdate;
using testing::imu_at;
using testing::kMs;
using testing::kNaN;
using testing::kStart;
using testing::level_prior;
using testing::observation;
using testing::Random;
using testing::Rig;
using testing::Seen;

TEST(Estimator, MakesEpochsAtImagesBetweenImuSamples) {
  Rig rig;
  rig.imu(-10, 400);
  for (const std::int64_t t : {113, 120, 124, 227, 339}) rig.image(t);
  EXPECT_EQ(rig.steps(), 5);
  std::int64_t last_ns = kStart;
  for (const Seen& seen : rig.update->seen) {
    EXPECT_EQ(seen.begin_ns, last_ns);
    ASSERT_GE(seen.imu.size(), 2u);
    EXPECT_EQ(seen.imu.front().t_ns, seen.begin_ns);
    EXPECT_EQ(seen.imu.back().t_ns, seen.end_ns);
    EXPECT_EQ(seen.clones.back(), seen.end_ns);
    for (std::size_t i = 0; i < seen.imu.size(); ++i) {
      if (i > 0) {
        EXPECT_LT(seen.imu[i - 1].t_ns, seen.imu[i].t_ns);
      }
      expect_same(seen.imu[i], imu_at(seen.imu[i].t_ns), 1e-12);
      // All samples in between are there, as they are.
      const bool inside = i > 0 && i + 1 < seen.imu.size();
      if (inside) {
        EXPECT_EQ(seen.imu[i].t_ns % (10 * kMs), 0);
      }
    }
    const std::int64_t first = seen.begin_ns / (10 * kMs), last = (seen.end_ns - 1) / (10 * kMs);
    EXPECT_EQ(static_cast<std::int64_t>(seen.imu.size()) - 2, last - first);
    ASSERT_EQ(seen.features.size(), 1u);
    EXPECT_EQ(seen.features[0].t_ns, seen.end_ns);
    EXPECT_EQ(seen.features[0].points[1].id, 9);
    last_ns = seen.end_ns;
  }
  EXPECT_EQ(last_ns, kStart + 339 * kMs);
  EXPECT_EQ(rig.estimator.epochs(), 5);
  EXPECT_EQ(rig.rejected(), Counts{});
}

TEST(Estimator, MovesTheStateAsOnePropagationOverTheWholeTimeWould) {
  Rig rig;
  rig.imu(-10, 300);
  for (const std::int64_t t : {57, 113, 200}) rig.image(t);
  EXPECT_EQ(rig.steps(), 3);
  ImuView expected = level_prior(kStart).state;
  std::vector<ImuSample> samples;
  for (std::int64_t t = 0; t <= 200; t += 10) samples.push_back(imu_at(kStart + t * kMs));
  propagate(samples, {}, 9.81, expected);
  EXPECT_LT((rig.estimator.filter().imu().R_GtoI - expected.R_GtoI).norm(), 1e-9);
  EXPECT_LT((rig.estimator.filter().imu().v_IinG - expected.v_IinG).norm(), 1e-7);
  EXPECT_LT((rig.estimator.filter().imu().p_IinG - expected.p_IinG).norm(), 1e-8);
}

TEST(Estimator, TakesImagesOfOneStampTogether) {
  Rig rig;
  rig.imu(-10, 100);
  rig.image(100, 0);
  EXPECT_EQ(rig.steps(), 0) << "the other camera's image may be on its way";
  rig.image(100, 1);
  EXPECT_EQ(rig.steps(), 0);
  rig.imu(100, 110);
  EXPECT_EQ(rig.steps(), 1);
  const Seen& seen = rig.update->seen.at(0);
  ASSERT_EQ(seen.features.size(), 2u);
  EXPECT_EQ(seen.features[0].camera, 0);
  EXPECT_EQ(seen.features[1].camera, 1);
  EXPECT_EQ(seen.features[1].points[0].u_px, 101.);
  rig.image(100, 2);
  EXPECT_EQ(rig.rejected(), (Counts{{"image at or before the present epoch", 1}}));
}

TEST(Estimator, MakesEpochsInDarkness) {
  EstimatorOptions options;
  options.max_epoch_s = 0.2;
  Rig rig(false, {}, options);
  rig.imu(-10, 1000);
  rig.image(450);
  EXPECT_EQ(rig.steps(), 5);
  std::vector<std::int64_t> ends;
  std::vector<std::size_t> images;
  for (const Seen& seen : rig.update->seen) {
    ends.push_back((seen.end_ns - kStart) / kMs);
    images.push_back(seen.features.size());
  }
  EXPECT_EQ(ends, (std::vector<std::int64_t>{200, 400, 450, 650, 850}));
  EXPECT_EQ(images, (std::vector<std::size_t>{0, 0, 1, 0, 0}));
}

TEST(Estimator, SkipsAnUpdateThatThrowsAndDisablesItAfterACount) {
  int calls = 0;
  EstimatorOptions options;
  options.max_update_failures = 3;
  Rig rig(
      false,
      [&](const FilterView&, FactorSink& sink) {
        ++calls;
        sink.count(5, 0);
        sink.add_residual() = observation(kPositionColumn, Eigen::Vector3d::Constant(1.), 1e-3);
        if (calls == 2) return;
        if (calls == 1) throw std::runtime_error("no wheels here");
        throw 42;
      },
      options);
  rig.imu(-10, 1000);
  for (int t = 100; t <= 800; t += 100) rig.image(t);
  EXPECT_EQ(rig.steps(), 8) << "the run goes on";
  EXPECT_EQ(calls, 4) << "the third failure is in the fourth call";
  const UpdateFailures& failures = rig.estimator.failures()[0];
  EXPECT_EQ(failures.count, 3);
  EXPECT_TRUE(failures.disabled);
  EXPECT_EQ(failures.cause, "no wheels here") << "the first cause is the one to mend";
  EXPECT_EQ(rig.estimator.counts()[0].applied, 5 + 1) << "nothing of an epoch that failed is used";
}

TEST(Estimator, KeepsAnUpdateThatFailsLessOftenThanTheLimit) {
  int calls = 0;
  Rig rig(false, [&](auto&, auto&) {
    if (++calls <= 9) throw std::runtime_error("not yet");
  });
  rig.imu(-10, 1600);
  for (int t = 100; t <= 1500; t += 100) rig.image(t);
  EXPECT_EQ(rig.steps(), 15);
  EXPECT_EQ(calls, 15);
  EXPECT_EQ(rig.estimator.failures()[0].count, 9);
  EXPECT_FALSE(rig.estimator.failures()[0].disabled);
}

TEST(Estimator, EndsWhenAKinematicModelThrows) {
  const PluginInfo info{"kinematics", "odd", "1", "", "", "odd.so", {}};
  Rig rig(false, [&](auto&, auto&) { throw PluginFailure(info, "rows", "seven wheels"); });
  rig.imu(-10, 200);
  rig.image(100);
  try {
    rig.steps();
    FAIL() << "nothing thrown";
  } catch (const PluginFailure& failure) {
    EXPECT_STREQ(failure.what(), "kinematics plugin 'odd' 1 (odd.so) failed in rows: seven wheels");
  }
}

TEST(Estimator, NamesTheUpdateThatThrewInAnAnalysis) {
  const auto failure_of = [](const FakeUpdate::Emit& emit) -> std::string {
    EstimatorOptions options;
    options.frozen = true;
    Rig rig(false, emit, options);
    rig.imu(-10, 200);
    rig.image(100);
    try {
      rig.steps();
    } catch (const UpdateFailure& failure) {
      return failure.what();
    }
    return "(nothing thrown)";
  };
  EXPECT_EQ(failure_of([](auto&, auto&) { throw std::runtime_error("no wheels here"); }),
            "update 'fake' failed: no wheels here");
  EXPECT_EQ(failure_of([](auto&, auto&) { throw 42; }),
            "update 'fake' failed: threw something that is not a std::exception");
  EXPECT_EQ(failure_of([](auto&, FactorSink& sink) {
              for (;;) sink.add_residual();
            }).substr(0, 22),
            "update 'fake' failed: ");
}

TEST(Estimator, CountsFactorsAndWhatUpdatesCountThemselves) {
  Rig rig(false, [](const FilterView&, FactorSink& sink) {
    sink.count(5, 2);
    sink.add_residual() = observation(kPositionColumn, Eigen::Vector3d::Zero(), 1.);
    sink.add_residual() = observation(kPositionColumn, Eigen::Vector3d::Zero(), 1.);
    ResidualFactor& outlier = sink.add_residual();
    outlier = observation(kPositionColumn, Eigen::Vector3d::Constant(1e3), 0.1);
    outlier.gate_probability = 0.01;
    sink.add_residual() = observation(kPositionColumn, Eigen::Vector3d::Constant(kNaN), 1.);
  });
  rig.imu(-10, 300);
  for (const std::int64_t t : {100, 200}) rig.image(t);
  EXPECT_EQ(rig.steps(), 2);
  EXPECT_EQ(rig.estimator.counts()[0].applied, 2 * (5 + 2));
  EXPECT_EQ(rig.estimator.counts()[0].rejected, 2 * (2 + 2));
  EXPECT_LT(rig.estimator.filter().imu().p_IinG.norm(), 1.);
  EXPECT_EQ(rig.estimator.updates()[0].name, "fake");
  const std::vector<RejectionCount> rejections = rig.estimator.rejections();
  ASSERT_GE(rejections.size(), 2U);
  const RejectionCount& own = rejections[rejections.size() - 2];
  EXPECT_EQ(own.reason, "fake: a reason of its own");
  EXPECT_EQ(own.count, 3);
  const RejectionCount& gated = rejections.back();
  EXPECT_EQ(gated.reason, "fake: measurement dropped by the chi-square gate");
  EXPECT_EQ(gated.count, 2);
  EXPECT_EQ(gated.first, "stamp " + std::to_string(kStart + 100 * kMs) + " ns");
}

TEST(Estimator, CountsInformationThatIsNotFinite) {
  Rig rig(false, [](const FilterView&, FactorSink& sink) {
    InformationFactor& factor = sink.add_information();
    factor.columns.add(0, 3);
    factor.Lambda.topLeftCorner(3, 3).setConstant(kNaN);
    factor.eta.head(3).setZero();
  });
  rig.imu(-10, 200);
  rig.image(100);
  EXPECT_EQ(rig.steps(), 1);
  EXPECT_EQ(rig.rejected(), (Counts{{"fake: information that is not finite or empty", 1}}));
  EXPECT_EQ(rig.estimator.failure(), "");
}

TEST(Estimator, NamesTheStagesInTheOrderTheyRun) {
  const auto first = std::make_shared<FakeUpdate>(), second = std::make_shared<FakeUpdate>();
  Estimator estimator({}, {}, {}, {{"one", first, -1}, {"two", second, -1}});
  EXPECT_EQ(estimator.stage_names(),
            (std::vector<std::string>{"propagate", "one", "two", "marginalise"}));
  ASSERT_EQ(estimator.stage_ms().size(), 4u);
  estimator.start(level_prior(kStart));
  for (std::int64_t t = 0; t <= 300; t += 10) estimator.add(imu_at(kStart + t * kMs));
  ASSERT_TRUE(estimator.step());
  for (const double ms : estimator.stage_ms()) EXPECT_GT(ms, 0.);
  EXPECT_EQ(first->seen.size(), 1u);
  EXPECT_EQ(second->seen.size(), 1u);
}

TEST(Estimator, TellsUpdatesWhatTheStateLooksLike) {
  EstimatorOptions options;
  options.filter.clones = 5;
  const Rig rig(true, {}, options);
  EXPECT_EQ(rig.update->setup.max_clones, 6);
  EXPECT_EQ(rig.update->setup.max_state_size, rig.estimator.filter().size());
  EXPECT_EQ(rig.update->setup.cameras.data(), rig.estimator.filter().cameras().data());
  EXPECT_EQ(rig.update->setup.wheels, &rig.estimator.filter().wheels()[0]);
  EXPECT_EQ(Rig(false).update->setup.wheels, nullptr);
}

TEST(Estimator, DropsTheOldestCloneWhenTheWindowIsFull) {
  EstimatorOptions options;
  options.filter.clones = 3;
  options.growing_window = false;
  Rig rig(false, {}, options);
  rig.imu(-10, 700);
  for (std::int64_t t = 100; t <= 600; t += 100) rig.image(t);
  EXPECT_EQ(rig.steps(), 6);
  for (std::size_t k = 0; k < 6; ++k) {
    const Seen& seen = rig.update->seen[k];
    EXPECT_EQ(seen.clones.size(), std::min<std::size_t>(k + 1, 4));
    EXPECT_EQ(seen.oldest_leaves, k >= 3);
    EXPECT_EQ(seen.clones.front(), kStart + (k < 4 ? 100 : 100 * (static_cast<int>(k) - 2)) * kMs);
  }
  EXPECT_EQ(rig.estimator.filter().clones().size(), 3u);
}

TEST(Estimator, BeginsWithThreeClonesAndAddsOneEveryThirdEpoch) {
  EstimatorOptions options;
  options.filter.clones = 5;
  Rig rig(false, {}, options);
  rig.imu(-10, 1600);
  for (std::int64_t t = 100; t <= 1500; t += 100) rig.image(t);
  ASSERT_EQ(rig.steps(), 15);
  const std::vector<std::size_t> expected{1, 2, 3, 3, 4, 4, 4, 5, 5, 5, 6, 6, 6, 6, 6};
  for (std::size_t k = 0; k < 15; ++k) {
    const Seen& seen = rig.update->seen[k];
    EXPECT_EQ(seen.clones.size(), expected[k]) << k;
    EXPECT_EQ(seen.oldest_leaves, k >= 2 && expected[k] == std::min<std::size_t>(3 + k / 3, 6))
        << k;
  }
}

TEST(Estimator, FactorsOfOneCallAreOneJointUpdate) {
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
  const auto pv = [](const FilterView& view) {
    Eigen::VectorXd x(6);
    x << view.imu.p_IinG, view.imu.v_IinG;
    return x;
  };
  Rig rig(false, [&](const FilterView& view, FactorSink& sink) {
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
    before = pv(view);
    expected = before + P * H.transpose() * S.inverse() * r;
  });
  rig.imu(-10, 200);
  rig.image(100);
  ASSERT_EQ(rig.steps(), 1);
  EXPECT_GT((expected - before).norm(), 0.1);
  EXPECT_LT((pv(rig.estimator.filter().view(-1)) - expected).norm(), 1e-9);
}

TEST(Estimator, StopsWhenTheFilterHasDiverged) {
  Rig rig(false, [](const FilterView&, FactorSink& sink) {
    ResidualFactor factor = observation(kPositionColumn, Eigen::VectorXd::Constant(1, 1e308), 1e-9);
    factor.H(0, 0) = 0.1;
    sink.add_residual() = factor;
  });
  rig.imu(-10, 500);
  for (const std::int64_t t : {100, 200, 300}) rig.image(t);
  EXPECT_EQ(rig.steps(), 1);
  EXPECT_EQ(rig.estimator.failure(), "the estimate or its covariance is not finite any more");
  EXPECT_EQ(rig.estimator.epochs(), 1);
}

/// State and covariance after a run with pseudo-random measurements and factors.
std::pair<Eigen::VectorXd, Eigen::MatrixXd> random_run() {
  Random random(12);
  EstimatorOptions options;
  options.filter.clones = 4;
  Rig rig(
      true,
      [&](const FilterView& view, FactorSink& sink) {
        ResidualFactor& factor = sink.add_residual();
        factor.columns.add(0, kImuSize);
        factor.columns.add(view.clones.front().column, kPoseSize);
        factor.columns.add(view.wheels->extrinsics_column, 10);
        factor.set_rows(4);
        factor.H = random.matrix(4, factor.columns.size());
        factor.residual = 0.01 * random.matrix(4, 1);
        factor.R.setIdentity();
      },
      options);
  for (std::int64_t t = 0; t <= 2000; t += 10) {
    ImuSample sample = testing::imu_sample(kStart + t * kMs, random);
    rig.estimator.add(sample);
    rig.estimator.add(encoder_at(kStart + t * kMs), 0);
    if (t % 70 == 35) rig.image(t);
    rig.steps();
  }
  const Filter& filter = rig.estimator.filter();
  Eigen::VectorXd state(15);
  state << filter.imu().p_IinG, filter.imu().v_IinG, filter.imu().R_GtoI.row(0).transpose(),
      filter.imu().gyro_bias, filter.wheels()[0].p_IinO;
  return {state, filter.covariance()};
}

TEST(Estimator, GivesTheSameBitsTwiceInARow) {
  const auto first = random_run(), second = random_run();
  EXPECT_EQ(first.first, second.first);
  EXPECT_EQ(first.second, second.second);
  EXPECT_TRUE(first.first.allFinite());
}

}  // namespace
}  // namespace viwo

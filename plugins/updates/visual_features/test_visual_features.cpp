// The update as the host sees it: selection, bad data, consistency.
#include <cmath>
#include <limits>
#include <map>

#include <gtest/gtest.h>

#include "message_of.hpp"
#include "rejections.hpp"
#include "test_support.hpp"
#include "viwo/math/chi2.hpp"

namespace viwo::visual {
namespace {

using testing::Random;
using testing::Scene;
using testing::SceneOptions;
using viwo::testing::counts_of;

/// The defaults, changed by `change`.
template <class Change>
VisualFeatures update_with(const Change& change) {
  Params params = testing::default_params();
  change(params);
  return VisualFeatures(params, HostServices{});
}

FactorSink sink_for(const Scene& scene) { return {1, static_cast<int>(scene.P.cols())}; }

constexpr const char* kShort = "track lost with too few observations (min_observations)";
constexpr const char* kTooMany = "track beyond max_features";

/// Mean NEES of clones and calibration after one batch; `flip` turns the sign of the factor's part
/// of dtheta.
double mean_nees(const SceneOptions& options, double sigma_used_px, double flip, int runs) {
  Random random(21);
  double sum = 0.;
  for (int run = 0; run < runs; ++run) {
    Scene truth = testing::make_scene(options, 40, random);
    const int n = static_cast<int>(truth.P.cols());
    // What is held has no variance, and no error.
    const Eigen::VectorXd sigma = truth.P.diagonal().cwiseSqrt();
    const Eigen::VectorXd inverse = (sigma.array() > 0.).select(sigma.cwiseInverse(), 1.);
    const Eigen::MatrixXd correlation =
        inverse.asDiagonal() * truth.P * inverse.asDiagonal() +
        Eigen::MatrixXd((sigma.array() == 0.).cast<double>().matrix().asDiagonal());
    const Eigen::MatrixXd L = correlation.llt().matrixL();
    const Eigen::VectorXd error = sigma.asDiagonal() * (L * testing::normals(random, n));
    Scene estimate = truth;  // truth = estimate [+] error
    estimate.plus(-error);
    estimate.first_estimates();
    VisualFeatures update = update_with([&](Params& p) {
      p.sigma_px = sigma_used_px;
      p.gate_probability = 0.;
    });
    FactorSink sink = sink_for(truth);
    testing::show_all(update, truth, estimate, 1., random, sink);
    EXPECT_GT(sink.applied(), 10);
    Eigen::MatrixXd Lambda = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd eta = Eigen::VectorXd::Zero(n);
    testing::scatter(*sink.information(), Lambda, eta);
    Eigen::VectorXd sign = Eigen::VectorXd::Ones(n);
    for (const CloneState& clone : truth.clones) sign.segment<3>(clone.column).setConstant(flip);
    Lambda = sign.asDiagonal() * Lambda * sign.asDiagonal();
    eta = sign.asDiagonal() * eta;
    Lambda = sigma.asDiagonal() * Lambda * sigma.asDiagonal();
    Lambda += correlation.inverse();
    const Eigen::VectorXd left =
        inverse.asDiagonal() * error - Lambda.llt().solve(sigma.asDiagonal() * eta);
    const auto held = static_cast<double>((sigma.array() == 0.).count());
    sum += left.dot(Lambda * left) / (n - held);
  }
  return sum / runs;
}

// Two-sided 99.9 % bounds of mean_nees(), n dimensions.
void expect_consistent(double nees, int n, int runs, bool consistent) {
  const double low = chi2_quantile(0.0005, n * runs) / (n * runs);
  const double high = chi2_quantile(0.9995, n * runs) / (n * runs);
  EXPECT_EQ(nees > low && nees < high, consistent) << low << " < " << nees << " < " << high;
}

TEST(VisualFeatures, PosteriorIsConsistentAndWrongNoiseOrSignIsNot) {
  const SceneOptions options{.n_clones = 8, .sigma_theta = 0.003, .sigma_p = 0.01};
  const int n = kImuSize + 8 * kPoseSize, runs = 60;
  expect_consistent(mean_nees(options, 1., 1., runs), n, runs, true);
  expect_consistent(mean_nees(options, 2., 1., runs), n, runs, false);
  expect_consistent(mean_nees(options, 0.5, 1., runs), n, runs, false);
  expect_consistent(mean_nees(options, 1., -1., runs), n, runs, false);
}

TEST(VisualFeatures, PosteriorOfFisheyeStereoWithCalibrationIsConsistent) {
  const SceneOptions options{.n_clones = 6,
                             .n_cameras = 2,
                             .distortion = CameraDistortion::kEquidistant,
                             .calibrates = true,
                             .sigma_theta = 0.003,
                             .sigma_p = 0.01};
  const int n = kImuSize + 6 * kPoseSize + 2 * kCalibrationSize - 1 - 2, runs = 40;
  expect_consistent(mean_nees(options, 1., 1., runs), n, runs, true);
  expect_consistent(mean_nees(options, 0.5, 1., runs), n, runs, false);
}

TEST(VisualFeatures, DropsTracksByTheGateAtTheRateThatItPromises) {
  Random random(22);
  std::int64_t applied = 0, rejected = 0, wild_applied = 0;
  for (int run = 0; run < 40; ++run) {
    Scene truth =
        testing::make_scene({.n_clones = 8, .sigma_theta = 1e-5, .sigma_p = 1e-5}, 50, random);
    VisualFeatures update = update_with([](Params& p) { p.gate_probability = 0.05; });
    FactorSink sink = sink_for(truth);
    testing::show_all(update, truth, truth, 1., random, sink);
    applied += sink.applied();
    rejected += sink.rejected();
    VisualFeatures wild = update_with([](Params& p) { p.gate_probability = 0.05; });
    testing::show_all(wild, truth, truth, 4., random, sink);
    wild_applied += sink.applied();
  }
  const double n = static_cast<double>(applied + rejected);
  const double rate = static_cast<double>(rejected) / n;
  EXPECT_NEAR(rate, 0.05, 4. * std::sqrt(0.05 * 0.95 / n));
  // Some of sixteen sights with four times the noise agree on a point by chance, without the rest.
  EXPECT_LT(static_cast<double>(wild_applied), 0.05 * n);
}

/// Tracks of both cameras through eight clones, of points that move.
std::vector<RejectionCount> tracks_of_moving_points(const Eigen::Vector3d& v, std::int64_t& applied,
                                                    std::int64_t& rejected) {
  Random random(24);
  Scene scene = testing::make_scene(
      {.n_clones = 8, .n_cameras = 2, .sigma_theta = 1e-5, .sigma_p = 1e-5}, 100, random);
  VisualFeatures update = update_with([](Params& p) { p.min_observations = 16; });
  FactorSink sink = sink_for(scene);
  scene.start(update);
  for (std::size_t k = 0; k < 8; ++k) {
    testing::epoch(update, scene, k + 1, testing::images(scene, k, 1., random), sink);
    for (Eigen::Vector3d& p_FinG : scene.landmarks) p_FinG += 0.1 * v;
  }
  testing::epoch(update, scene, 8, testing::empty_images(scene, 7), sink);
  applied = sink.applied();
  rejected = sink.rejected();
  std::vector<RejectionCount> counts = viwo::testing::all_rejections(update);
  std::erase_if(counts, [](const RejectionCount& count) {
    return !count.reason.starts_with("track dropped: its point moves");
  });
  return counts;
}

TEST(VisualFeatures, DropsTracksOfPointsThatMove) {
  std::int64_t applied = 0, rejected = 0;
  EXPECT_TRUE(tracks_of_moving_points({0., 0., 0.}, applied, rejected).empty());
  EXPECT_GT(applied, 30);
  // 0.2 m/s across the way of the cameras: 14 cm from the first image to the last, 9 px and more.
  // Scattered evenly over sixteen sights that is a chi-square of about 130 where 18 is the limit.
  const auto counts = tracks_of_moving_points({-0.06, 0.19, 0.}, applied, rejected);
  EXPECT_EQ(applied, 0);
  EXPECT_GT(rejected, 30);
  ASSERT_EQ(counts.size(), 1u);
  EXPECT_EQ(counts[0].count, rejected);
  EXPECT_EQ(counts[0].of, rejected);
}

TEST(VisualFeatures, UsesLostTracksAndThoseOfALeavingCloneOnce) {
  Random random(23);
  Scene scene = testing::make_scene({.n_clones = 5}, 0, random);
  Scene truth = scene;
  truth.landmarks = {{0.3, 0.1, 4.}, {0.5, -0.1, 4.}, {0.4, 0.2, 3.5}};
  VisualFeatures update = update_with([](Params& p) { p.gate_probability = 0.; });
  scene.start(update);
  FactorSink sink = sink_for(scene);
  for (std::size_t k = 0; k < 5; ++k) {
    auto samples = testing::images(truth, k, 0.5, random);
    ASSERT_EQ(samples[0].points.size(), 3u);
    if (k == 0) samples[0].points.resize(2);  // the third track starts at the second clone
    if (k == 4) samples[0].points.erase(samples[0].points.begin());  // the first one is lost
    testing::epoch(update, scene, k + 1, samples, sink, k == 4);
    EXPECT_EQ(sink.applied(), k == 4 ? 2 : 0);
    EXPECT_EQ(sink.information() != nullptr, k == 4);
  }
  // All of its observations are gone: only the third track is left.
  testing::epoch(update, scene, 5, testing::empty_images(scene, 4), sink);
  EXPECT_EQ(sink.applied(), 1);
  testing::epoch(update, scene, 5, testing::empty_images(scene, 4), sink);
  EXPECT_EQ(sink.applied(), 0);
  EXPECT_TRUE(counts_of(update).empty());
}

TEST(VisualFeatures, TriesTheLongestTracksFirstAndDropsLostOnesBeyondTheLimit) {
  Random random(24);
  Scene scene = testing::make_scene({.n_clones = 6}, 0, random);
  for (int i = 0; i < 6; ++i) scene.landmarks.emplace_back(0.2 + 0.1 * i, 0.1, 4.);
  VisualFeatures update = update_with([](Params& p) {
    p.max_features = 2;
    p.gate_probability = 0.;
  });
  scene.start(update);
  FactorSink sink = sink_for(scene);
  for (std::size_t k = 0; k < 6; ++k) {
    auto samples = testing::images(scene, k, 0.5, random);
    ASSERT_EQ(samples[0].points.size(), 6u);
    // Ids 100 .. 105: only 103 and 105 are there from the start.
    if (k < 2) samples[0].points = {samples[0].points[3], samples[0].points[5]};
    testing::epoch(update, scene, k + 1, samples, sink);
  }
  testing::epoch(update, scene, 6, testing::empty_images(scene, 5), sink);
  EXPECT_EQ(sink.applied(), 2);
  EXPECT_EQ(counts_of(update).at(kTooMany), 4);
  // Only the clones that these two saw first have information.
  const int column = scene.clones[0].column;
  Eigen::MatrixXd Lambda = Eigen::MatrixXd::Zero(scene.P.rows(), scene.P.cols());
  Eigen::VectorXd eta = Eigen::VectorXd::Zero(scene.P.rows());
  testing::scatter(*sink.information(), Lambda, eta);
  EXPECT_GT(Lambda(column, column), 1.);
  testing::epoch(update, scene, 6, testing::empty_images(scene, 5), sink);
  EXPECT_EQ(sink.applied(), 0);
}

TEST(VisualFeatures, WaitsForACameraThatMissesAnImage) {
  Random random(25);
  Scene scene = testing::make_scene({.n_clones = 6, .n_cameras = 2}, 0, random);
  scene.landmarks = {{0.4, 0.1, 4.}};
  VisualFeatures update = update_with([](Params& p) { p.gate_probability = 0.; });
  scene.start(update);
  FactorSink sink = sink_for(scene);
  for (std::size_t k = 0; k < 4; ++k) {
    testing::epoch(update, scene, k + 1, testing::images(scene, k, 0.5, random), sink);
  }
  testing::epoch(update, scene, 5, {}, sink);
  EXPECT_EQ(sink.applied(), 0);
  testing::epoch(update, scene, 6, testing::empty_images(scene, 5), sink);
  EXPECT_EQ(sink.applied(), 1);
  EXPECT_TRUE(counts_of(update).empty());
}

TEST(VisualFeatures, ForgetsObservationsOfClonesThatAreGone) {
  Random random(26);
  Scene scene = testing::make_scene({.n_clones = 5}, 0, random);
  scene.landmarks = {{0.3, 0.1, 4.}};
  VisualFeatures update = update_with([](Params&) {});
  scene.start(update);
  FactorSink sink = sink_for(scene);
  for (std::size_t k = 0; k < 3; ++k) {
    testing::epoch(update, scene, k + 1, testing::images(scene, k, 0.5, random), sink);
  }
  // The same slots at other times: a restart of the filter.
  for (CloneState& clone : scene.clones) clone.t_ns += 1'000'000'000;
  testing::epoch(update, scene, 3, testing::empty_images(scene, 2), sink);
  EXPECT_EQ(sink.applied(), 0);
  EXPECT_TRUE(counts_of(update).empty());
}

TEST(VisualFeatures, CountsBadDataAndGoesOn) {
  Random random(27);
  Scene scene = testing::make_scene({.n_clones = 5}, 0, random);
  scene.landmarks = {{0.3, 0.1, 4.}, {0.5, 0.2, 4.}};
  VisualFeatures update = update_with([](Params& p) {
    p.max_tracks = 3;
    p.gate_probability = 0.;
  });
  scene.start(update);
  FactorSink sink = sink_for(scene);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t k = 0; k < 4; ++k) {
    auto samples = testing::images(scene, k, 0.5, random);
    auto& points = samples[0].points;
    points.push_back(points[0]);     // twice
    points.push_back({7, nan, 3.});  // no pixel
    points.push_back({8, std::numeric_limits<double>::infinity(), 3.});
    points.push_back({9, 1e9, -1e9});                                    // no direction
    points.push_back({static_cast<std::int64_t>(200 + k), 300., 200.});  // seen once
    points.push_back({static_cast<std::int64_t>(300 + k), 300., 200.});  // no room
    const std::vector<FeaturePoint> same = points;  // push_back moves the samples
    samples.push_back({samples[0].t_ns, 5, same});
    samples.push_back({samples[0].t_ns, -1, same});
    testing::epoch(update, scene, k + 1, samples, sink);
  }
  testing::epoch(update, scene, 5, testing::empty_images(scene, 4), sink);
  EXPECT_EQ(sink.applied(), 2);
  const std::map<std::string, std::int64_t> expected{
      {"camera that the configuration does not have", 8},
      {"id twice in one image", 4},
      {"pixel without a direction", 12},
      // One place for 200 .. 203 and 300 .. 303. A lost track keeps it for one epoch more: 200
      // and 202 have it, the others do not.
      {"no room for another track (max_tracks)", 6},
      {kShort, 2}};
  EXPECT_EQ(counts_of(update), expected);
}

TEST(VisualFeatures, SurvivesNothingAtAllAndBrokenEstimates) {
  Random random(28);
  Scene scene = testing::make_scene({.n_clones = 5}, 30, random);
  VisualFeatures update = update_with([](Params& p) { p.min_observations = 4; });
  scene.start(update);
  FactorSink sink = sink_for(scene);
  FilterView empty = scene.view();
  empty.clones = {};
  update.update(empty, scene.epoch(), sink);
  testing::epoch(update, scene, 1, {}, sink);
  Scene broken = scene;
  broken.clones[1].R_GtoI.setConstant(std::numeric_limits<double>::quiet_NaN());
  broken.P.setConstant(std::numeric_limits<double>::quiet_NaN());
  for (std::size_t k = 0; k < 5; ++k) {
    testing::epoch(update, broken, k + 1, testing::images(scene, k, 1., random), sink);
  }
  testing::epoch(update, broken, 5, testing::empty_images(scene, 4), sink);
  EXPECT_EQ(sink.applied(), 0);
  broken = scene;
  broken.clones[0].slot = 99;
  broken.clones[1].slot = -3;
  broken.clones[2].column = -1;
  for (std::size_t k = 0; k < 5; ++k) {
    testing::epoch(update, broken, k + 1, testing::images(scene, k, 1., random), sink, true);
  }
}

TEST(VisualFeatures, RefusesImpossibleConfigurations) {
  Random random(29);
  Scene scene = testing::make_scene({.n_clones = 5}, 0, random);
  VisualFeatures update = update_with([](Params&) {});
  Scene blind;
  EXPECT_EQ(viwo::testing::error_of([&] { update.declare(blind); }),
            "needs a camera: there is no section 'cameras'");
  update.declare(scene);
  EXPECT_THROW(update.start({.max_clones = 65, .max_state_size = 500}), InputError);
}

TEST(VisualFeatures, GivesTheSameBitsWhateverTheOrderOfThePoints) {
  SceneOptions options{.n_clones = 6, .n_cameras = 2};
  std::vector<Eigen::MatrixXd> Lambdas;
  for (const bool reversed : {false, true}) {
    Random random(30);
    Scene scene = testing::make_scene(options, 80, random);
    VisualFeatures update = update_with([](Params&) {});
    scene.start(update);
    FactorSink sink = sink_for(scene);
    for (std::size_t k = 0; k < 6; ++k) {
      auto samples = testing::images(scene, k, 1., random);
      for (FeatureSample& sample : samples) {
        if (reversed) std::reverse(sample.points.begin(), sample.points.end());
      }
      testing::epoch(update, scene, k + 1, samples, sink);
    }
    testing::epoch(update, scene, 6, testing::empty_images(scene, 5), sink);
    ASSERT_GT(sink.applied(), 30);
    Lambdas.emplace_back(
        sink.information()->Lambda.topLeftCorner(36, 36).triangularView<Eigen::Lower>());
  }
  EXPECT_EQ(Lambdas[0], Lambdas[1]);
}

TEST(TrackStore, FindsWhatAMapFinds) {
  Random random(31);
  TrackStore store;
  store.start(50, 4, 1);
  std::map<std::int64_t, int> reference;
  for (int i = 0; i < 20000; ++i) {
    const auto id = static_cast<std::int64_t>(random() % 120) * 1024 - 60000;
    if (random() % 2 == 0) {
      const int track = store.find_or_add(id);
      if (reference.contains(id)) {
        ASSERT_EQ(track, reference[id]);
      } else if (reference.size() == 50) {
        ASSERT_EQ(track, -1);
      } else {
        ASSERT_GE(track, 0);
        reference[id] = track;
      }
    } else if (reference.contains(id)) {
      store.remove(reference[id]);
      reference.erase(id);
    }
    ASSERT_EQ(store.find(id), reference.contains(id) ? reference[id] : -1);
    ASSERT_EQ(store.active().size(), reference.size());
  }
}

}  // namespace
}  // namespace viwo::visual

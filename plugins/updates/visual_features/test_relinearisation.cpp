// Tracks of a rough start are linearised twice.
#include <cmath>
#include <cstdint>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "test_support.hpp"
#include "visual_features.hpp"
#include "viwo/api/host_services.hpp"

namespace viwo::visual {
namespace {

using testing::Random;
using testing::Scene;

/// How far clones are off from each other, m, after one batch of good pixels from a start that is
/// off by a decimetre.
double off_after_a_rough_start(bool linearises_once) {
  double squared = 0.;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    Scene truth = testing::make_scene(
        {.n_clones = 6, .n_cameras = 2, .sigma_theta = 0.01, .sigma_p = 0.1}, 60, random);
    const Eigen::MatrixXd L = truth.P.llt().matrixL();
    Scene estimate = truth;
    estimate.plus(-L * testing::normals(random, static_cast<int>(truth.P.cols())));
    estimate.first_estimates();
    Params params = testing::default_params();
    params.sigma_px = 0.2;
    params.gate_probability = 0.;
    params.linearise_twice = !linearises_once;
    VisualFeatures update(params, HostServices{});
    FactorSink sink{1, static_cast<int>(truth.P.cols())};
    testing::show_all(update, truth, estimate, params.sigma_px, random, sink);
    EXPECT_GT(sink.applied(), 10);
    estimate.apply(sink);
    const auto way = [](const Scene& scene) -> Eigen::Vector3d {
      const CloneState &first = scene.clones.front(), &last = scene.clones.back();
      return first.R_GtoI * (last.p_IinG - first.p_IinG);
    };
    squared += (way(estimate) - way(truth)).squaredNorm();
  }
  return std::sqrt(squared / 10.);
}

TEST(Relinearisation, OfARoughStartIsWhereItsFactorPutsTheClones) {
  EXPECT_LT(off_after_a_rough_start(false), 0.3 * off_after_a_rough_start(true));
}

}  // namespace
}  // namespace viwo::visual

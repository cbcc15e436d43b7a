// The steady state of the update does not touch the heap, however it is reached.
#include <gtest/gtest.h>

#include "allocations.hpp"
#include "test_support.hpp"

namespace viwo::visual {
namespace {

/// A window that slides over a long path, twice as long as the window: allocations of the second
/// half.
void check(const testing::SceneOptions& window, double gate_probability) {
  testing::Random random(41);
  testing::SceneOptions options = window;
  options.n_clones = 3 * window.n_clones;
  testing::Scene path = testing::make_scene(options, 300, random);
  testing::Scene scene = path.with_clones(static_cast<std::size_t>(window.n_clones));
  Params params = testing::default_params();
  params.gate_probability = gate_probability;
  VisualFeatures update(params, HostServices{});
  scene.start(update);
  FactorSink sink(1, static_cast<int>(scene.P.cols()));
  const auto n = static_cast<std::size_t>(window.n_clones);
  long counted = 0;
  std::int64_t applied = 0;
  for (std::size_t k = 0; k < path.clones.size(); ++k) {
    const std::size_t begin = k + 1 > n ? k + 1 - n : 0;
    scene.clones.assign(path.clones.begin() + static_cast<std::ptrdiff_t>(begin),
                        path.clones.begin() + static_cast<std::ptrdiff_t>(k + 1));
    for (std::size_t i = 0; i < scene.clones.size(); ++i) {
      scene.clones[i].slot = static_cast<int>((begin + i) % n);
      scene.clones[i].column = path.clones[0].column - kPoseSize * path.clones[0].slot +
                               kPoseSize * scene.clones[i].slot;
    }
    FilterView filter = scene.view();
    filter.oldest_leaves = scene.clones.size() == n;
    const auto samples = testing::images(path, k, 1., random);
    EpochData data = scene.epoch(samples);
    data.end_ns = path.clones[k].t_ns;
    sink.clear();
    const long before = viwo::testing::allocations();
    update.update(filter, data, sink);
    const long allocations = viwo::testing::allocations() - before;
    if (k > n) {
      counted += allocations;
      applied += sink.applied();
    }
  }
  EXPECT_EQ(counted, 0);
  EXPECT_GT(applied, 100);
}

TEST(VisualFeatures, DoesNotAllocateInTheSteadyState) {
  if (!viwo::testing::counts_allocations()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  check({.n_clones = 12}, 0.05);
  check({.n_clones = 12, .n_cameras = 2}, 0.9);
  check({.n_clones = 8, .n_cameras = 2, .calibrates = true}, 0.9);
}

TEST(VisualFeatures, CountingSeesAnAllocationOfEigen) {
  if (!viwo::testing::counts_allocations()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  const long before = viwo::testing::allocations();
  Eigen::MatrixXd matrix(50, 50);
  matrix.setZero();
  EXPECT_EQ(matrix.sum(), 0.);
  EXPECT_GT(viwo::testing::allocations() - before, 0);
}

}  // namespace
}  // namespace viwo::visual

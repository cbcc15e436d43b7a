// A feature with all sights of a landmark.
#pragma once

#include <gtest/gtest.h>

#include "feature.hpp"
#include "test_support.hpp"

namespace viwo::visual {

/// Track 0 of a store, with all sights of a landmark.
struct Track {
  TrackStore store;
  Window window;
  Feature feature;

  Track(testing::Scene& truth, testing::Scene& estimate, const Eigen::Vector3d& landmark,
        double sigma_px, double noise_px, testing::Random& random, double min_distance_m = 0.1) {
    const int n_clones = static_cast<int>(truth.clones.size());
    const int n_cameras = static_cast<int>(truth.n_cameras());
    window.start(n_clones, estimate.rig().cameras(), estimate.camera_blocks);
    window.set(estimate.view());
    store.start(4, n_clones, n_cameras);
    store.keep_clones(truth.clones);
    const int track = store.find_or_add(7);
    for (std::size_t i = 0; i < truth.clones.size(); ++i) {
      for (std::size_t j = 0; j < truth.n_cameras(); ++j) {
        Observation seen;
        if (!truth.see(i, j, landmark, seen.uv)) continue;
        seen.uv += noise_px * Eigen::Vector2d(testing::normals(random, 2));
        const int camera = static_cast<int>(j);
        seen.ray = unproject(estimate.camera(j), seen.uv).value();
        Eigen::Vector2d uv;
        EXPECT_TRUE(project(estimate.camera(j), seen.ray, uv, seen.J_ray));
        EXPECT_EQ(window.take_image(camera, truth.stamp_ns(i, j)), truth.clones[i].slot);
        store.set(track, truth.clones[i].slot, camera, seen);
      }
    }
    window.set_poses();
    feature.start(n_clones * n_cameras, sigma_px, min_distance_m);
    feature.collect(store, track, window);
  }
};

}  // namespace viwo::visual

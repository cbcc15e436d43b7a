// A window of clones and cameras in front of a field of landmarks, for the tests of
// visual_features.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "visual_features.hpp"
#include "visual_features_params.hpp"
#include "viwo/api/filter_view.hpp"
#include "viwo/api/host_services.hpp"
#include "viwo/api/params.hpp"
#include "viwo/camera/camera_model.hpp"
#include "viwo/math/so3.hpp"

namespace viwo::visual::testing {

using Random = std::mt19937_64;

inline double normal(Random& random) { return std::normal_distribution<double>()(random); }
inline double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
inline Eigen::VectorXd normals(Random& random, int n) {
  Eigen::VectorXd x(n);
  for (double& value : x) value = normal(random);
  return x;
}
inline Eigen::Vector3d normal3(Random& random) { return normals(random, 3); }

inline ParamSet params_with(const std::vector<std::pair<std::string, double>>& changes = {}) {
  ParamSet params;
  const auto put = [&](const ParamSpec& spec, double value) {
    if (spec.type == ParamType::kInt) {
      params.set(spec.name, static_cast<std::int64_t>(value));
    } else {
      params.set(spec.name, value);
    }
  };
  for (const ParamSpec& spec : kParams) {
    put(spec, std::stod(spec.fallback));
    for (const auto& [name, value] : changes) {
      if (name == spec.name) put(spec, value);
    }
  }
  return params;
}

inline CameraView make_camera(CameraDistortion distortion) {
  CameraView camera;
  camera.distortion = distortion;
  if (distortion == CameraDistortion::kRadtan) {
    camera.width_px = 752;
    camera.height_px = 480;
    camera.intrinsics << 458.7, 457.3, 367.2, 248.4, -0.283, 0.0739, 1.9e-4, 1.8e-5;
  } else {
    camera.width_px = 848;
    camera.height_px = 800;
    camera.intrinsics << 286.2, 286.4, 423.1, 397.7, -8e-3, 4.4e-2, -4.2e-2, 7.6e-3;
  }
  return camera;
}

struct SceneOptions {
  int n_clones = 12;
  int n_cameras = 1;
  CameraDistortion distortion = CameraDistortion::kRadtan;
  bool calibrates = false;
  double first_estimate_off = 0.;  ///< rad, m
  double sigma_theta = 0.005, sigma_p = 0.02;
};

/// `clones`, `cameras`: estimates. Columns: 15 of the IMU, extrinsics of the first camera, clones
/// (a ring that has turned), the rest of the calibration.
struct Scene {
  std::vector<CloneView> clones;
  std::vector<CameraView> cameras;
  Eigen::MatrixXd P;
  std::vector<Eigen::Vector3d> landmarks;

  FilterView view(std::size_t n_clones) const {
    FilterView filter;
    filter.clones = {clones.data(), n_clones};
    filter.cameras = cameras;
    filter.size = static_cast<int>(P.rows());
    filter.covariance_data = P.data();
    filter.covariance_stride = static_cast<int>(P.outerStride());
    return filter;
  }
  FilterView view() const { return view(clones.size()); }
  UpdateSetup setup() const {
    return {.max_clones = static_cast<int>(clones.size()),
            .max_state_size = static_cast<int>(P.rows()),
            .cameras = cameras};
  }

  /// Adds an error to estimates (not to the first ones).
  void move(const Eigen::VectorXd& dx) {
    const auto turn = [&](int column, Eigen::Matrix3d& R, Eigen::Vector3d& p) {
      if (column < 0) return;
      R = exp_so3(-Eigen::Vector3d(dx.segment<3>(column))) * R;
      p += dx.segment<3>(column + 3);
    };
    for (CloneView& clone : clones) turn(clone.column, clone.R_GtoI, clone.p_IinG);
    for (CameraView& camera : cameras) {
      turn(camera.extrinsics_column, camera.R_ItoC, camera.p_IinC);
      if (camera.intrinsics_column >= 0) {
        camera.intrinsics += dx.segment<8>(camera.intrinsics_column);
      }
    }
  }

  /// Pixel of a landmark; false when it is not in the image.
  bool see(std::size_t clone, std::size_t camera, const Eigen::Vector3d& p_FinG,
           Eigen::Vector2d& uv) const {
    const CameraView& c = cameras[camera];
    const Eigen::Vector3d p_I = clones[clone].R_GtoI * (p_FinG - clones[clone].p_IinG);
    return project(c, c.R_ItoC * p_I + c.p_IinC, uv) && in_image(c, uv);
  }
};

/// Covariance of the window with correlations, and a prior of the calibration.
inline Eigen::MatrixXd make_covariance(const Scene& scene, const SceneOptions& options, int size,
                                       Random& random) {
  Eigen::VectorXd sigma = Eigen::VectorXd::Constant(size, 0.01);
  for (const CloneView& clone : scene.clones) {
    sigma.segment<3>(clone.column).setConstant(options.sigma_theta);
    sigma.segment<3>(clone.column + 3).setConstant(options.sigma_p);
  }
  for (const CameraView& camera : scene.cameras) {
    if (camera.extrinsics_column < 0) continue;
    sigma.segment<6>(camera.extrinsics_column).setConstant(0.002);
    sigma.segment<8>(camera.intrinsics_column) << 1., 1., 1., 1., 2e-3, 2e-3, 2e-4, 2e-4;
  }
  Eigen::MatrixXd A = Eigen::MatrixXd::Identity(size, size);
  for (int i = 0; i < size; ++i) A.col(i) += 0.05 * normals(random, size);
  A = sigma.asDiagonal() * A;
  return A * A.transpose();
}

inline Scene make_scene(const SceneOptions& options, int n_landmarks, Random& random) {
  Scene scene;
  int size = kImuSize;
  for (int j = 0; j < options.n_cameras; ++j) {
    CameraView camera = make_camera(options.distortion);
    camera.R_ItoC = exp_so3(0.05 * normal3(random));
    camera.p_IinC = Eigen::Vector3d(-0.2 * j, 0., 0.) + 0.02 * normal3(random);
    if (options.calibrates && j == 0) {
      camera.extrinsics_column = size;
      size += kPoseSize;
    }
    scene.cameras.push_back(camera);
  }
  for (int i = 0; i < options.n_clones; ++i) {
    CloneView clone;
    clone.t_ns = 1'000'000'000 + std::int64_t{100'000'000} * i;
    clone.slot = (i + 5) % options.n_clones;
    clone.column = size + kPoseSize * clone.slot;
    clone.R_GtoI_fej = exp_so3(0.08 * normal3(random));
    clone.p_IinG_fej = Eigen::Vector3d(0.15 * i, 0.05 * i, 0.02 * i) + 0.05 * normal3(random);
    clone.R_GtoI = exp_so3(options.first_estimate_off * normal3(random)) * clone.R_GtoI_fej;
    clone.p_IinG = clone.p_IinG_fej + options.first_estimate_off * normal3(random);
    scene.clones.push_back(clone);
  }
  size += kPoseSize * options.n_clones;
  for (std::size_t j = 0; options.calibrates && j < scene.cameras.size(); ++j) {
    scene.cameras[j].intrinsics_column = size;
    size += 8;
    if (j == 0) continue;
    scene.cameras[j].extrinsics_column = size;
    size += kPoseSize;
  }
  scene.P = make_covariance(scene, options, size, random);
  for (int i = 0; i < n_landmarks; ++i) {
    scene.landmarks.emplace_back(uniform(random, -1., 2.5), uniform(random, -1.2, 1.6),
                                 uniform(random, 2.5, 7.));
  }
  return scene;
}

/// Images of one clone of the true scene; landmark i has id 100 + i.
inline std::vector<FeatureSample> images(const Scene& truth, std::size_t clone, double sigma_px,
                                         Random& random) {
  std::vector<FeatureSample> samples;
  for (std::size_t j = 0; j < truth.cameras.size(); ++j) {
    FeatureSample& sample = samples.emplace_back();
    sample.t_ns = truth.clones[clone].t_ns;
    sample.camera = static_cast<int>(j);
    for (std::size_t i = 0; i < truth.landmarks.size(); ++i) {
      Eigen::Vector2d uv;
      if (!truth.see(clone, j, truth.landmarks[i], uv)) continue;
      uv += sigma_px * Eigen::Vector2d(normals(random, 2));
      sample.points.push_back({100 + static_cast<std::int64_t>(i), uv.x(), uv.y()});
    }
  }
  return samples;
}

inline std::vector<FeatureSample> empty_images(const Scene& scene, std::size_t clone) {
  std::vector<FeatureSample> samples;
  for (std::size_t j = 0; j < scene.cameras.size(); ++j) {
    samples.push_back({scene.clones[clone].t_ns, static_cast<int>(j), {}});
  }
  return samples;
}

/// One epoch with the first `n_clones` clones.
inline void epoch(VisualFeatures& update, const Scene& estimate, std::size_t n_clones,
                  const std::vector<FeatureSample>& samples, FactorSink& sink,
                  bool oldest_leaves = false) {
  FilterView filter = estimate.view(n_clones);
  filter.oldest_leaves = oldest_leaves;
  EpochData data;
  data.end_ns = estimate.clones[n_clones - 1].t_ns;
  data.features = samples;
  sink.clear();
  update.update(filter, data, sink);
}

/// Shows the true scene clone after clone, then an empty image, so that all tracks are used in the
/// last epoch: its factor is in `sink`.
inline void show_all(VisualFeatures& update, const Scene& truth, const Scene& estimate,
                     double sigma_px, Random& random, FactorSink& sink) {
  update.start(estimate.setup());
  const std::size_t n = truth.clones.size();
  for (std::size_t k = 0; k < n; ++k) {
    epoch(update, estimate, k + 1, images(truth, k, sigma_px, random), sink);
  }
  epoch(update, estimate, n, empty_images(truth, n - 1), sink);
}

/// Scatters a factor into the whole error state.
inline void scatter(const InformationFactor& factor, Eigen::MatrixXd& Lambda,
                    Eigen::VectorXd& eta) {
  std::vector<int> columns;
  for (const ColumnRange& range : factor.columns.blocks()) {
    for (int i = 0; i < range.count; ++i) columns.push_back(range.first + i);
  }
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto row = static_cast<int>(i);
    eta[columns[i]] += factor.eta[row];
    for (std::size_t j = 0; j < columns.size(); ++j) {
      const auto column = static_cast<int>(j);
      Lambda(columns[i], columns[j]) += factor.Lambda(std::max(row, column), std::min(row, column));
    }
  }
}

}  // namespace viwo::visual::testing

// A window of clones and cameras in front of a field of landmarks, for the tests of
// visual_features.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
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
#include "viwo/testing/update_host.hpp"

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

/// The defaults, with the noise that is configured.
inline Params default_params() {
  Params params;
  params.find_noise = false;
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
  double first_estimate_off = 0.;  ///< rad, m, also of the calibration
  double sigma_theta = 0.005, sigma_p = 0.02;
  double image_off_s = 0.;  ///< images of camera j are (j + 1) times as late as their clones
  double line_delay_s = 0.;
};

/// An estimate (or the truth) of a window, with landmarks. Columns: 15 of the IMU, extrinsics of
/// the first camera, clones (a ring that has turned), the rest of the calibration.
struct Scene : viwo::testing::UpdateHost {
  using UpdateHost::UpdateHost;

  /// Blocks of a room are as others, at the end of the state; free from the first on.
  RoomId room(const RoomSpec& spec) override {
    const auto before = P.rows();
    P.conservativeResizeLike(Eigen::MatrixXd::Zero(before + spec.blocks * spec.entries,
                                                   before + spec.blocks * spec.entries));
    for (int i = 0; i < spec.blocks; ++i) {
      free_blocks.insert(free_blocks.begin(), {static_cast<int>(blocks.size())});
      Block& block = blocks.emplace_back();
      block.spec.name = spec.name + "." + std::to_string(i);
      for (int k = 0; k < spec.entries; ++k) block.spec.add(std::to_string(k), "", 0., 1.);
      block.value = block.first_estimate = block.spec.value;
      block.column = static_cast<int>(before) + spec.entries * i;
    }
    return UpdateHost::room(spec);
  }
  /// A sink that knows the room.
  FactorSink sink() const {
    FactorSink sink(1, static_cast<int>(P.rows()));
    for (const RoomSpec& spec : rooms) sink.rooms().push_back({&free_blocks, spec.entries, 0});
    return sink;
  }

  std::vector<BlockId> free_blocks;
  std::vector<CameraBlocks> camera_blocks;
  std::vector<Eigen::Vector3d> landmarks;
  double image_off_s = 0.;

  std::size_t n_cameras() const { return camera_blocks.size(); }
  CameraView camera(std::size_t j) {
    CameraView camera = rig().cameras()[j].camera;
    camera_blocks[j].read(view(), camera);
    return camera;
  }
  int extrinsics_column(std::size_t j) const { return column(camera_blocks[j].extrinsics); }
  int intrinsics_column(std::size_t j) const { return column(camera_blocks[j].intrinsics); }
  int clock_column(std::size_t j) const { return column(camera_blocks[j].clock); }

  /// With the first `n` clones only.
  Scene with_clones(std::size_t n) const {
    Scene part = *this;
    part.clones.resize(n);
    return part;
  }

  /// Stamp of the image of a clone, for the clock that was declared.
  std::int64_t stamp_ns(std::size_t clone, std::size_t j) {
    const CameraView& declared = rig().cameras()[j].camera;
    const double offset_s =
        static_cast<double>(j + 1) * image_off_s - declared.t_CtoI_s - declared.middle_s();
    return clones[clone].t_ns + std::llround(1e9 * offset_s);
  }

  /// Pixel of a landmark by the estimates, in row `v_px` of an image with a stamp, where there is a
  /// rolling shutter; false when there is none.
  bool predict(std::size_t clone, std::size_t j, std::int64_t stamp_ns, double v_px,
               const Eigen::Vector3d& p_FinG, Eigen::Vector2d& uv) {
    const CameraView c = camera(j);
    const CloneState& at = clones[clone];
    const double dt = seconds_between(at.t_ns, stamp_ns) + c.t_CtoI_s + v_px * c.line_delay_s;
    const Eigen::Vector3d v_IinI = at.R_GtoI_fej * at.v_IinG;  // kept in I
    const Eigen::Vector3d p_IinG = at.p_IinG + dt * (at.R_GtoI.transpose() * v_IinI);
    const Eigen::Matrix3d R_GtoI = exp_so3(-dt * at.w_IinI) * at.R_GtoI;
    return project(c, c.R_ItoC * (R_GtoI * (p_FinG - p_IinG)) + c.p_IinC, uv);
  }
  bool see(std::size_t clone, std::size_t j, const Eigen::Vector3d& p_FinG, Eigen::Vector2d& uv) {
    uv.y() = 0.5 * camera(j).height_px;
    // The row that sees it is the one that it is seen in.
    for (int i = 0; i < 20; ++i) {
      if (!predict(clone, j, stamp_ns(clone, j), uv.y(), p_FinG, uv)) return false;
    }
    return in_image(camera(j), uv);
  }
};

/// Covariance of the window with correlations, and a prior of the calibration.
inline Eigen::MatrixXd make_covariance(const Scene& scene, const SceneOptions& options, int size,
                                       Random& random) {
  Eigen::VectorXd sigma = Eigen::VectorXd::Constant(size, 0.01);
  for (const CloneState& clone : scene.clones) {
    sigma.segment<3>(clone.column).setConstant(options.sigma_theta);
    sigma.segment<3>(clone.column + 3).setConstant(options.sigma_p);
  }
  for (const viwo::testing::UpdateHost::Block& block : scene.blocks) {
    for (std::size_t k = 0; block.column >= 0 && k < block.spec.entries.size(); ++k) {
      sigma[block.column + static_cast<int>(k)] = block.spec.entries[k].sigma;
    }
  }
  Eigen::MatrixXd A = Eigen::MatrixXd::Identity(size, size);
  for (int i = 0; i < size; ++i) A.col(i) += 0.05 * normals(random, size);
  A = sigma.asDiagonal() * A;
  return A * A.transpose();
}

inline std::vector<CameraPrior> make_cameras(const SceneOptions& options, Random& random) {
  std::vector<CameraPrior> cameras;
  for (int j = 0; j < options.n_cameras; ++j) {
    CameraPrior& prior = cameras.emplace_back();
    prior.camera = make_camera(options.distortion);
    prior.camera.R_ItoC = exp_so3(0.05 * normal3(random));
    prior.camera.p_IinC = Eigen::Vector3d(-0.2 * j, 0., 0.) + 0.02 * normal3(random);
    prior.camera.line_delay_s = options.line_delay_s;
    if (!options.calibrates) continue;
    prior.camera.t_CtoI_s = 0.01 + 0.002 * j;
    prior.sigma_extrinsics.setConstant(0.002);
    // The last distortion coefficient is held.
    prior.sigma_intrinsics << 1., 1., 1., 1., 2e-3, 2e-3, 2e-4, 0.;
    prior.sigma_clock_s = 1e-3;
  }
  return cameras;
}

inline Scene make_scene(const SceneOptions& options, int n_landmarks, Random& random) {
  Scene scene(Rig(make_cameras(options, random), std::nullopt));
  for (int j = 0; j < options.n_cameras; ++j) {
    scene.camera_blocks.push_back(declare_camera(scene, j));
  }
  scene.image_off_s = options.image_off_s;
  int size = kImuSize;
  const auto place = [&](BlockId id) {
    auto& block = scene.blocks[static_cast<std::size_t>(id.index)];
    if (!options.calibrates || block.column >= 0) return;
    block.column = size;
    size += static_cast<int>(block.spec.entries.size());
  };
  place(scene.camera_blocks[0].extrinsics);
  for (int i = 0; i < options.n_clones; ++i) {
    CloneState& clone = scene.clones.emplace_back();
    clone.t_ns = 1'000'000'000 + std::int64_t{100'000'000} * i;
    clone.slot = (i + 5) % options.n_clones;
    clone.column = size + kPoseSize * clone.slot;
    clone.R_GtoI_fej = exp_so3(0.08 * normal3(random));
    clone.p_IinG_fej = Eigen::Vector3d(0.15 * i, 0.05 * i, 0.02 * i) + 0.05 * normal3(random);
    clone.R_GtoI = exp_so3(options.first_estimate_off * normal3(random)) * clone.R_GtoI_fej;
    clone.p_IinG = clone.p_IinG_fej + options.first_estimate_off * normal3(random);
    clone.w_IinI = 0.3 * normal3(random);
    clone.v_IinG = Eigen::Vector3d(1.5, 0.5, 0.2) + 0.3 * normal3(random);
  }
  size += kPoseSize * options.n_clones;
  for (const CameraBlocks& blocks : scene.camera_blocks) {
    for (const BlockId id : {blocks.intrinsics, blocks.extrinsics, blocks.clock}) place(id);
  }
  scene.P = make_covariance(scene, options, size, random);
  if (options.calibrates) {
    Eigen::VectorXd off = options.first_estimate_off * normals(random, size);
    off.head(kImuSize).setZero();
    for (const CloneState& clone : scene.clones) off.segment<kPoseSize>(clone.column).setZero();
    for (std::size_t j = 0; j < scene.n_cameras(); ++j) off[scene.clock_column(j)] *= 0.03;
    scene.plus(off);
  }
  for (int i = 0; i < n_landmarks; ++i) {
    scene.landmarks.emplace_back(uniform(random, -1., 2.5), uniform(random, -1.2, 1.6),
                                 uniform(random, 2.5, 7.));
  }
  return scene;
}

/// Images of one clone of the true scene; landmark i has id 100 + i.
inline std::vector<FeatureSample> images(Scene& truth, std::size_t clone, double sigma_px,
                                         Random& random) {
  std::vector<FeatureSample> samples;
  for (std::size_t j = 0; j < truth.n_cameras(); ++j) {
    FeatureSample& sample = samples.emplace_back();
    sample.t_ns = truth.stamp_ns(clone, j);
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

inline std::vector<FeatureSample> empty_images(Scene& scene, std::size_t clone) {
  std::vector<FeatureSample> samples;
  for (std::size_t j = 0; j < scene.n_cameras(); ++j) {
    samples.push_back({scene.stamp_ns(clone, j), static_cast<int>(j), {}});
  }
  return samples;
}

/// One epoch with the first `n_clones` clones.
inline void epoch(VisualFeatures& update, const Scene& estimate, std::size_t n_clones,
                  const std::vector<FeatureSample>& samples, FactorSink& sink,
                  bool oldest_leaves = false) {
  FilterView filter = estimate.view();
  filter.clones = filter.clones.first(n_clones);
  filter.oldest_leaves = oldest_leaves;
  EpochData data = estimate.epoch(samples);
  data.end_ns = estimate.clones[n_clones - 1].t_ns;
  sink.clear();
  update.update(filter, data, sink);
}

/// Shows the true scene clone after clone, then an empty image, so that all tracks are used in the
/// last epoch: its factor is in `sink`.
inline void show_all(VisualFeatures& update, Scene& truth, Scene& estimate, double sigma_px,
                     Random& random, FactorSink& sink) {
  estimate.start(update);
  const std::size_t n = truth.clones.size();
  for (std::size_t k = 0; k < n; ++k) {
    epoch(update, estimate, k + 1, images(truth, k, sigma_px, random), sink);
  }
  epoch(update, estimate, n, empty_images(truth, n - 1), sink);
}

/// What a turn of the world about the vertical, and moving it, do to the error state: at the first
/// estimates.
inline Eigen::MatrixXd world_motions(const Scene& scene, Eigen::Index size) {
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(size, 4);
  for (const CloneState& clone : scene.clones) {
    N.block<3, 1>(clone.column, 0) = clone.R_GtoI_fej * Eigen::Vector3d::UnitZ();
    N.block<3, 1>(clone.column + 3, 0) = Eigen::Vector3d::UnitZ().cross(clone.p_IinG_fej);
    N.block<3, 3>(clone.column + 3, 1).setIdentity();
  }
  return N;
}

/// Rows by the whole error state without what they say of the orientation of a clone about the
/// vertical as it was first: there rows are not quite derivatives.
inline Eigen::MatrixXd without_verticals(Eigen::MatrixXd H, const Scene& scene) {
  for (const CloneState& clone : scene.clones) {
    const Eigen::Vector3d u = clone.R_GtoI_fej * Eigen::Vector3d::UnitZ();
    auto block = H.middleCols<3>(clone.column);
    block -= (block * u).eval() * u.transpose();
  }
  return H;
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

// Monte-Carlo runs of the wheel updates alone: poses of the IMU are given at each epoch with noise,
// the calibration starts wrong and is carried along.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "filter_fixture.hpp"
#include "viwo/sim/planar_motion.hpp"

namespace viwo::testing {

struct CalibrationRuns {
  std::vector<std::string> updates;  ///< YAML sections, applied in this order
  std::string model =
      swerve("four_wis_wid", ", prior_sigma_radius_m: 0.00025, prior_sigma_position_m: 0.01");
  std::string motion = "icr_sweep";
  int seeds = 12;
  double duration_s = 10.;
  double ramp_s = 1.;
  bool extrinsics = true;  ///< estimated, with time offset; else known
  double pose_sigma_rad = 2e-4, pose_sigma_m = 3e-4;
};

struct CalibrationResult {
  double nees_intrinsics = 0.;  ///< mean over the seeds, per degree of freedom
  double nees_mount = 0.;       ///< of extrinsics and time offset
  double chi2 = 0.;             ///< mean of the residual factors, per row
  Eigen::VectorXd rms;          ///< errors of x_WI in units of the prior sigma
  double microseconds = 0.;     ///< mean time of the update() calls of an epoch
  std::int64_t applied = 0, rejected = 0;
};

inline double nees(const Eigen::VectorXd& error, const Eigen::MatrixXd& P,
                   const std::vector<int>& columns) {
  const auto n = static_cast<Eigen::Index>(columns.size());
  Eigen::VectorXd e(n);
  Eigen::MatrixXd C(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const int row = columns[static_cast<std::size_t>(i)];
    e[i] = error[row];
    for (Eigen::Index k = 0; k < n; ++k) C(i, k) = P(row, columns[static_cast<std::size_t>(k)]);
  }
  const Eigen::VectorXd scale = C.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd correlation = scale.asDiagonal() * C * scale.asDiagonal();
  const Eigen::VectorXd scaled = scale.cwiseProduct(e);
  return scaled.dot(correlation.ldlt().solve(scaled)) / static_cast<double>(n);
}

/// Calibration off by draws of its prior.
inline void start_wrong(const CalibrationRuns& options, const Intrinsics& sigma,
                        std::mt19937_64& rng, SmallFilter& filter) {
  const int m0 = filter.column(filter.wheels.extrinsics);
  Eigen::VectorXd prior = Eigen::VectorXd::Zero(filter.P.rows());
  if (options.extrinsics) {
    prior.segment<3>(m0).setConstant(0.01);
    prior.segment<3>(m0 + 3).setConstant(0.1);
    prior[m0 + 6] = 0.01;
  }
  prior.tail(sigma.size()) = sigma;
  filter.P = prior.cwiseAbs2().asDiagonal();
  filter.plus(-prior.cwiseProduct(gaussian(static_cast<int>(prior.size()), rng)));
}

/// Poses as an independent source tells them, new at each epoch.
inline void give_poses(const CalibrationRuns& options, std::mt19937_64& rng, SmallFilter& filter) {
  for (CloneState& clone : filter.clones) {
    const int c = clone.column;
    filter.P.middleRows(c, 6).setZero();
    filter.P.middleCols(c, 6).setZero();
    const Eigen::VectorXd noise = gaussian(6, rng);
    for (int i = 0; i < 6; ++i) {
      const double s = i < 3 ? options.pose_sigma_rad : options.pose_sigma_m;
      filter.P(c + i, c + i) = s * s;
    }
    clone.R_GtoI = exp_so3(options.pose_sigma_rad * noise.head<3>()) * clone.R_GtoI;
    clone.p_IinG -= options.pose_sigma_m * noise.tail<3>();
    clone.R_GtoI_fej = clone.R_GtoI;
    clone.p_IinG_fej = clone.p_IinG;
  }
}

/// Of the end of a seed.
inline void add_errors(const CalibrationRuns& options, const Intrinsics& sigma,
                       const Eigen::VectorXd& error, SmallFilter& filter,
                       CalibrationResult& result) {
  const int m0 = filter.column(filter.wheels.extrinsics);
  std::vector<int> intrinsics;
  for (int i = 0; i < sigma.size(); ++i) {
    if (sigma[i] == 0.) continue;
    intrinsics.push_back(m0 + 7 + i);
    result.rms[i] += std::pow(error[m0 + 7 + i] / sigma[i], 2) / options.seeds;
  }
  result.nees_intrinsics += nees(error, filter.P, intrinsics) / options.seeds;
  if (!options.extrinsics) return;
  result.nees_mount +=
      nees(error, filter.P, {m0, m0 + 1, m0 + 2, m0 + 3, m0 + 4, m0 + 5, m0 + 6}) / options.seeds;
}

inline CalibrationResult run_calibration(const CalibrationRuns& options) {
  constexpr double kTimeOffset = 0.02;
  constexpr std::int64_t kEpochNs = 100'000'000;
  const auto model = load_model(options.model);
  const TiltedDrive drive;
  const sim::PlanarMotion motion(options.motion, {.ramp_s = options.ramp_s});
  const Intrinsics truth = model->nominal();
  const Intrinsics sigma = model->prior_sigma();
  const int n = model->n_intrinsics();
  CalibrationResult result;
  result.rms.setZero(n);
  std::int64_t calls = 0;
  double rows = 0.;
  for (int seed = 0; seed < options.seeds; ++seed) {
    sim::EncoderSimulation simulation;
    simulation.duration_s = options.duration_s + 1.;
    simulation.time_offset_s = kTimeOffset;
    const auto encoders = sim::simulate_encoders(model->model(), truth, motion, simulation,
                                                 static_cast<std::uint64_t>(seed));
    std::mt19937_64 rng(static_cast<std::uint64_t>(1000 + seed));
    SmallFilter filter(free_wheels(drive, model.get(), kTimeOffset));
    filter.clones.resize(2);
    filter.layout();
    const int m0 = filter.column(filter.wheels.extrinsics);
    start_wrong(options, sigma, rng, filter);

    std::vector<std::shared_ptr<Update>> updates;
    for (const std::string& yaml : options.updates) {
      updates.push_back(load_update(yaml));
      filter.start(*updates.back());
    }
    FactorSink sink(4, static_cast<int>(filter.P.rows()));
    sim::PoseIntegrator pose(motion);
    CloneState before;
    const auto epochs = static_cast<std::int64_t>(options.duration_s * 10.);
    for (std::int64_t k = 1; k <= epochs; ++k) {
      const std::int64_t t_ns = k * kEpochNs;
      const double t = 1e-9 * static_cast<double>(t_ns);
      const CloneState now =
          drive.clone(t_ns, static_cast<int>(k % 2), pose.advance_to(t), motion.twist(t));
      filter.clones[0] = k == 1 ? now : before;
      filter.clones[1] = now;
      before = now;
      filter.layout();
      give_poses(options, rng, filter);
      const auto first = std::max<std::int64_t>(0, 10 * (k - 4));
      const auto count =
          std::min<std::int64_t>(70, static_cast<std::int64_t>(encoders.size()) - first);
      EpochData data = filter.epoch(std::span(encoders).subspan(static_cast<std::size_t>(first),
                                                                static_cast<std::size_t>(count)));
      data.begin_ns = t_ns - kEpochNs;
      data.end_ns = t_ns;
      for (const auto& update : updates) {
        sink.clear();
        FilterView fresh = filter.view();
        if (k == 1) fresh.clones = fresh.clones.last(1);
        const auto start = std::chrono::steady_clock::now();
        update->update(fresh, data, sink);
        result.microseconds +=
            std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start)
                .count();
        result.applied += sink.applied();
        result.rejected += sink.rejected();
        for (const ResidualFactor& factor : sink.residuals()) {
          rows += static_cast<double>(factor.residual.size());
        }
        result.chi2 += filter.apply(sink);
      }
      ++calls;
    }
    const WheelsView estimate = filter.wheels_view();
    Eigen::VectorXd error = Eigen::VectorXd::Zero(filter.P.rows());
    error.segment<3>(m0) = -log_so3(drive.R_ItoO * estimate.R_ItoO.transpose());
    error.segment<3>(m0 + 3) = drive.p_IinO - estimate.p_IinO;
    error[m0 + 6] = kTimeOffset - estimate.t_OtoI_s;
    error.tail(n) = truth - estimate.x_WI;
    add_errors(options, sigma, error, filter, result);
  }
  result.rms = result.rms.cwiseSqrt().eval();
  if (rows > 0.) result.chi2 /= rows;
  result.microseconds /= static_cast<double>(calls);
  return result;
}

}  // namespace viwo::testing

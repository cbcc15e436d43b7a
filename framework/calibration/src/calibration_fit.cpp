// The fit of a batch calibration: priors, noise scales found in the data, solver.
#include <algorithm>
#include <cmath>
#include <memory>

#include <Eigen/Dense>
#include <ceres/ceres.h>

#include "calibration_problem.hpp"
#include "fit_costs.hpp"
#include "recording_name.hpp"
#include "residual_groups.hpp"
#include "undetermined.hpp"
#include "viwo/calibration/calibrate.hpp"
#include "viwo/math/se2.hpp"

namespace viwo::calibration {
namespace {

class Fit {
 public:
  Fit(const CalibrationSetup& setup, const std::vector<std::size_t>& recordings,
      const CalibrationOptions& options, const FitStart& start)
      : setup_(setup),
        options_(options),
        recordings_(recordings),
        prior_(setup.recordings[recordings.front()], options, start),
        shared_(static_cast<std::size_t>(prior_.n_shared()), 0.),
        own_(recordings.size(), {0., 0.}) {
    for (const std::size_t index : recordings) {
      problems_.push_back(std::make_unique<RecordingProblem>(setup.recordings[index], options));
      problems_.back()->weigh_rows_at(start.x_WI);
    }
    require_some_to_compare();
  }

  CalibrationEstimate run() {
    // Noise scales and estimate by turns, as each needs the other (CAL-5): few steps at a time once
    // the estimate is near.
    constexpr int kMostRounds = 50, kFewIterations = 2, kMostIterations = 50;
    constexpr double kUnchanged = 1e-3;
    solve(kMostIterations);
    for (int round = 0; round < kMostRounds; ++round) {
      for (std::size_t k = 0; k < problems_.size(); ++k) problems_[k]->weigh_rows_at(point(k).x_WI);
      if (rescale(linearise()) <= kUnchanged) break;
      for (const auto& problem : problems_) problem->weigh_segments();
      solve(kFewIterations);
    }
    solve(kMostIterations);
    return result(linearise());
  }

 private:
  void require_some_to_compare() const {
    int all = 0, with_holes = 0;
    for (const auto& problem : problems_) {
      all += static_cast<int>(problem->motions().size());
      with_holes += problem->n_with_holes();
    }
    if (all == 0 || with_holes < all) return;
    fail(setup_.recordings[recordings_.front()].label,
         ": all segments have holes in which wheels or gyro were not seen: choose shorter ones "
         "(segment_s)");
  }

  CalibrationPoint point(std::size_t k) const {
    return prior_.point(shared_.data(), own_[k].data());
  }

  void solve(int most_iterations) {
    for (const auto& problem : problems_) problem->set_noise(estimate_.noise);
    ceres::Problem problem;
    for (std::size_t k = 0; k < problems_.size(); ++k) {
      problem.AddResidualBlock(new RecordingCost(*problems_[k], prior_), nullptr, shared_.data(),
                               own_[k].data());
      problem.AddResidualBlock(new PriorCost(Eigen::Matrix2d::Identity()), nullptr, own_[k].data());
    }
    problem.AddResidualBlock(new PriorCost(prior_.whitening), nullptr, shared_.data());
    set_bounds(problem);
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.logging_type = ceres::SILENT;
    options.max_num_iterations = most_iterations;
    options.num_threads = 1;  // same bits on every machine; recordings share no scratch memory
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    if (!summary.IsSolutionUsable()) {
      throw NoSolution("the calibration did not converge: " + summary.message);
    }
    estimate_.iterations += static_cast<int>(summary.iterations.size());
    estimate_.converged = summary.termination_type == ceres::CONVERGENCE;
    estimate_.cost = summary.final_cost;
  }

  /// Not at the bounds themselves, where a model may break down: a radius of zero.
  void set_bounds(ceres::Problem& problem) {
    constexpr double kInside = 0.005;  // prior sigmas; the judgement calls twice this at the bound
    for (int i = 0; i < prior_.sigma.size(); ++i) {
      const double sigma = prior_.sigma[i];
      const IntrinsicSpec& spec = spec_of(i);
      if (!(sigma > 0.)) continue;
      const double lowest = (spec.lowest - prior_.x_WI[i]) / sigma + kInside;
      const double highest = (spec.highest - prior_.x_WI[i]) / sigma - kInside;
      if (std::isfinite(lowest)) problem.SetParameterLowerBound(shared_.data(), i, lowest);
      if (std::isfinite(highest)) problem.SetParameterUpperBound(shared_.data(), i, highest);
    }
  }

  const IntrinsicSpec& spec_of(int i) const {
    return setup_.recordings.front().setup.model->description().intrinsics[static_cast<std::size_t>(
        i)];
  }

  Linearisation linearise() {
    const int n = prior_.n_shared();
    const int size = n + 2 * static_cast<int>(problems_.size());
    Linearisation all;
    for (NoiseGroup& group : all) {
      group.information.setZero(size, size);
      group.batches.assign(n_batches(), Eigen::VectorXd::Zero(size));
    }
    std::size_t first_batch = 0;
    const Eigen::VectorXd scale = prior_.scale();
    for (std::size_t k = 0; k < problems_.size(); ++k) {
      RecordingResiduals at;
      problems_[k]->evaluate(point(k), true, at);
      Eigen::VectorXd J = Eigen::VectorXd::Zero(size);
      for (int i = 0; i < at.r.size(); ++i) {
        const Eigen::VectorXd scaled = scale.cwiseProduct(at.J.row(i).transpose());
        J.head(n) = scaled.head(n);
        J.segment<2>(n + 2 * static_cast<int>(k)) = scaled.tail<2>();
        if (at.r[i] == 0. && J.isZero(0.)) continue;  // a direction without parity information
        const ResidualKind kind = problems_[k]->kinds()[static_cast<std::size_t>(i)];
        NoiseGroup& group = all[static_cast<std::size_t>(kind)];
        group.information.noalias() += J * J.transpose();
        group.squares += at.r[i] * at.r[i];
        ++group.residuals;
        if (kind != ResidualKind::kYaw && kind != ResidualKind::kPosition) continue;
        group.batches[first_batch + batch(k, i / problems_[k]->rows_per_segment())] += at.r[i] * J;
      }
      const double parity = std::pow(estimate_.noise.parity_scale, -2);
      auto& batches = all[static_cast<std::size_t>(ResidualKind::kParity)].batches;
      const auto& gradients = problems_[k]->parity_gradients();
      for (std::size_t i = 0; options_.parity && i < gradients.size(); ++i) {
        const std::size_t b = first_batch + i * n_batches(k) / gradients.size();
        batches[b].head(gradients[i].size()) += parity * prior_.sigma.cwiseProduct(gradients[i]);
      }
      first_batch += n_batches(k);
    }
    return all;
  }

  /// About thirty for all recordings, at least one for each.
  std::size_t n_batches(std::size_t k) const {
    double all_s = 0.;
    for (const auto& problem : problems_) all_s += problem->duration_s();
    const auto share = static_cast<int>(std::lround(30. * problems_[k]->duration_s() / all_s));
    return static_cast<std::size_t>(std::max(share, 1));
  }
  std::size_t n_batches() const {
    std::size_t sum = 0;
    for (std::size_t k = 0; k < problems_.size(); ++k) sum += n_batches(k);
    return sum;
  }
  std::size_t batch(std::size_t k, int segment) const {
    return static_cast<std::size_t>(segment) * n_batches(k) /
           static_cast<std::size_t>(problems_[k]->n_segments());
  }

  /// Variance components (CAL-5), group by group. Returns by what part the most changed of them
  /// did.
  double rescale(const Linearisation& at) {
    const Eigen::MatrixXd P = covariance(at, true);
    double most = 0.;
    // Whether there was enough to find it in.
    const auto rescale_noise = [&](double variance, double& noise) {
      if (variance < 1e-12) return false;
      const double by = std::sqrt(variance);
      noise *= by;
      most = std::max(most, std::abs(by - 1.));
      return true;
    };
    CalibrationNoise& noise = estimate_.noise;
    noise.position_is_found |=
        rescale_noise(variance_of(at[index(ResidualKind::kPosition)], P), noise.position_m);
    noise.yaw_is_found |=
        rescale_noise(variance_of(at[index(ResidualKind::kYaw)], P), noise.yaw_rad);
    rescale_noise(variance_of_parity(at, P), noise.parity_scale);
    return most;
  }

  /// `white`: as if what is left did not persist.
  Eigen::MatrixXd covariance(const Linearisation& at, bool white = false) const {
    const auto size = at[0].information.rows();
    const int n = prior_.n_shared();
    Eigen::MatrixXd information = Eigen::MatrixXd::Identity(size, size);
    information.topLeftCorner(n, n) = prior_.information();
    for (const NoiseGroup& group : at) {
      information += group.information / (white ? 1. : std::max(1., persistence(group).ratio));
    }
    return information.llt().solve(Eigen::MatrixXd::Identity(size, size));
  }

  CalibrationEstimate result(const Linearisation& at) {
    const CalibrationPoint final_point = point(0);
    estimate_.x_WI = final_point.x_WI;
    estimate_.extrinsics = final_point.extrinsics;
    estimate_.extrinsics[2] = wrap_angle(estimate_.extrinsics[2]);
    const Eigen::MatrixXd P = covariance(at);
    const auto n = static_cast<int>(prior_.sigma.size());
    estimate_.prior_sigma = prior_.sigma;
    estimate_.sigma = prior_.sigma.cwiseProduct(P.diagonal().head(n).cwiseSqrt());
    const Eigen::VectorXd inverse = P.diagonal().head(n).cwiseSqrt().cwiseInverse();
    estimate_.correlations = inverse.asDiagonal() * P.topLeftCorner(n, n) * inverse.asDiagonal();
    estimate_.extrinsics_sigma =
        prior_.extrinsics_sigma.cwiseProduct(P.diagonal().segment<3>(n).cwiseSqrt());
    for (std::size_t k = 0; k < own_.size(); ++k) {
      const auto at_own = prior_.n_shared() + 2 * static_cast<Eigen::Index>(k);
      const CalibrationPoint found = point(k);
      const Eigen::Vector2d sigma =
          prior_.own_sigma.cwiseProduct(P.diagonal().segment<2>(at_own).cwiseSqrt());
      estimate_.clock_offset_s.push_back(found.clock_offset_s);
      estimate_.clock_offset_sigma_s.push_back(sigma[0]);
      estimate_.gyro_bias_rad_per_s.push_back(found.gyro_bias_rad_per_s);
      estimate_.gyro_bias_sigma_rad_per_s.push_back(sigma[1]);
    }
    count(at);
    look_at_what_was_measured_by_hand();
    estimate_.segments = options_.segments;
    estimate_.segment_s = options_.segments == Segments::kWhole ? 0. : options_.segment_s;
    find_undetermined(P);
    return estimate_;
  }

  void look_at_what_was_measured_by_hand() {
    for (std::size_t k = 0; k < problems_.size(); ++k) {
      const MotionReference& motion = setup_.recordings[recordings_[k]].motion;
      if (!motion.distance_m && !motion.turn_rad) continue;
      RecordingResiduals at;
      problems_[k]->evaluate(point(k), false, at);
      for (int i = 0; i < at.r.size(); ++i) {
        const ResidualKind kind = problems_[k]->kinds()[static_cast<std::size_t>(i)];
        if (kind != ResidualKind::kDistance && kind != ResidualKind::kTurn) continue;
        estimate_.by_hand.push_back(
            {recordings_[k], kind == ResidualKind::kTurn ? "turn_deg" : "distance_m", at.r[i]});
      }
    }
  }

  /// How much there was to fit, and what moved.
  void count(const Linearisation& at) {
    for (const ResidualKind kind : {ResidualKind::kYaw, ResidualKind::kPosition,
                                    ResidualKind::kDistance, ResidualKind::kTurn}) {
      estimate_.residuals += at[static_cast<std::size_t>(kind)].residuals;
    }
    int segments = 0;
    for (std::size_t p = 0; p < problems_.size(); ++p) {
      const auto& problem = problems_[p];
      estimate_.weighed_down += problem->n_weighed_down();
      estimate_.with_holes += problem->n_with_holes();
      problem->add_turns(estimate_.gyro_bias_rad_per_s[p], estimate_.turns);
      for (std::size_t k = 0; k < problem->motions().size(); ++k) {
        if (!problem->is_compared(k)) continue;
        const Eigen::Vector3d& motion = problem->motions()[k];
        estimate_.turn_rms_rad += motion[0] * motion[0];
        estimate_.way_rms_m += motion.tail<2>().squaredNorm();
        ++segments;
      }
    }
    estimate_.turn_rms_rad = std::sqrt(estimate_.turn_rms_rad / std::max(1, segments));
    estimate_.way_rms_m = std::sqrt(estimate_.way_rms_m / std::max(1, segments));
    const auto& parity = at[static_cast<std::size_t>(ResidualKind::kParity)].information;
    // In units of the sigmas of the drawing.
    const auto n = prior_.sigma.size();
    const Intrinsics drawn =
        (prior_.sigma.array() > 0.).select(prior_.drawn_sigma.cwiseQuotient(prior_.sigma), 0.);
    const Eigen::MatrixXd told =
        drawn.asDiagonal() * parity.topLeftCorner(n, n) * drawn.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(told, Eigen::EigenvaluesOnly);
    estimate_.parity_directions = static_cast<int>((eigen.eigenvalues().array() > 1.).count());
  }

  /// Directions whose posterior sigma is more than 0.7 of the prior's: the data say less than it.
  void find_undetermined(const Eigen::MatrixXd& P) {
    std::vector<int> free;
    for (int i = 0; i < prior_.sigma.size(); ++i) {
      if (prior_.sigma[i] > 0.) free.push_back(i);
    }
    const auto n = static_cast<int>(free.size());
    estimate_.unknowns = n;
    const auto count = [](const auto& sigmas) {
      return static_cast<int>((sigmas.array() > 0.).count());
    };
    estimate_.unknowns +=
        count(prior_.extrinsics_sigma) + static_cast<int>(own_.size()) * count(prior_.own_sigma);
    // In what is known before, which hangs together where the gauge holds entries.
    const auto all = prior_.sigma.size();
    const Eigen::MatrixXd W = prior_.whitening.topLeftCorner(all, all);
    const Eigen::MatrixXd P_white = W * P.topLeftCorner(all, all) * W.transpose();
    const Eigen::MatrixXd P_free = P_white(free, free);
    // Below zero: by how many powers of e the data have narrowed what was known.
    estimate_.log_volume = P_free.llt().matrixLLT().diagonal().array().log().sum();
    const auto& specs = setup_.recordings.front().setup.model->description().intrinsics;
    estimate_.undetermined = undetermined_of(P_free, prior_.root(free, free), free, specs);
  }

  const CalibrationSetup& setup_;
  const CalibrationOptions options_;
  const std::vector<std::size_t> recordings_;
  Prior prior_;
  std::vector<double> shared_;
  std::vector<std::array<double, 2>> own_;  ///< clock offset and gyro bias of each recording
  std::vector<std::unique_ptr<RecordingProblem>> problems_;
  CalibrationEstimate estimate_;
};

}  // namespace

CalibrationEstimate fit(const CalibrationSetup& setup, const std::vector<std::size_t>& recordings,
                        const CalibrationOptions& options, const FitStart& start) {
  return Fit(setup, recordings, options, start).run();
}

}  // namespace viwo::calibration

// The fit of a batch calibration: priors, noise scales found in the data, solver.
#include <algorithm>
#include <cmath>
#include <memory>

#include <Eigen/Dense>
#include <ceres/ceres.h>

#include "calibration_problem.hpp"
#include "viwo/calibration/calibrate.hpp"

namespace viwo::calibration {
namespace {

/// Unknowns in units of their prior sigmas: u = (value - start) / sigma. Entries with sigma 0 are
/// held.
struct Prior {
  Intrinsics x_WI, sigma;
  PlanarExtrinsics extrinsics_sigma;
  double clock_sigma_s;

  Prior(const RunSetup& setup, const CalibrationOptions& options)
      : x_WI(setup.model->nominal()), sigma(setup.model->prior_sigma()) {
    for (int i = 0; i < sigma.size(); ++i) {
      // Without extrinsics the reference body is the frame O: nothing is left to a gauge.
      if (!options.estimate_extrinsics) {
        sigma[i] = setup.model->description().intrinsics[static_cast<std::size_t>(i)].prior_sigma;
      }
    }
    const double m = options.estimate_extrinsics ? options.extrinsics_sigma_m : 0.;
    const double rad = options.estimate_extrinsics ? options.extrinsics_sigma_rad : 0.;
    extrinsics_sigma = {m, m, rad};
    clock_sigma_s = options.clock_offset_sigma_s;
  }

  int n_shared() const { return static_cast<int>(sigma.size()) + 3; }

  CalibrationPoint point(const double* shared, double clock) const {
    CalibrationPoint at;
    const auto n = static_cast<int>(sigma.size());
    at.x_WI = x_WI + sigma.cwiseProduct(Eigen::Map<const Eigen::VectorXd>(shared, n));
    at.extrinsics = extrinsics_sigma.cwiseProduct(Eigen::Map<const Eigen::Vector3d>(shared + n));
    at.clock_offset_s = clock_sigma_s * clock;
    return at;
  }

  /// Derivative by the scaled unknowns [shared, clock].
  Eigen::VectorXd scale() const {
    Eigen::VectorXd all(n_shared() + 1);
    all << sigma, extrinsics_sigma, clock_sigma_s;
    return all;
  }
};

/// Residuals of one recording, poses over parity, for the solver.
class RecordingCost final : public ceres::CostFunction {
 public:
  RecordingCost(RecordingProblem& problem, const Prior& prior) : problem_(problem), prior_(prior) {
    set_num_residuals(problem.n_pose() + problem.n_parity());
    *mutable_parameter_block_sizes() = {prior.n_shared(), 1};
  }

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    RecordingResiduals at;
    problem_.evaluate(prior_.point(parameters[0], parameters[1][0]), jacobians != nullptr, at);
    Eigen::Map<Eigen::VectorXd> r(residuals, num_residuals());
    r << at.pose, at.parity;
    if (jacobians == nullptr) return r.allFinite();
    const int n = prior_.n_shared();
    Eigen::MatrixXd J(r.size(), n + 1);
    J << at.J_pose, at.J_parity;
    J *= prior_.scale().asDiagonal();
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    if (jacobians[0] != nullptr) {
      Eigen::Map<RowMajor>(jacobians[0], r.size(), n) = J.leftCols(n);
    }
    if (jacobians[1] != nullptr) Eigen::Map<Eigen::VectorXd>(jacobians[1], r.size()) = J.col(n);
    return r.allFinite() && J.allFinite();
  }

 private:
  RecordingProblem& problem_;
  const Prior& prior_;
};

/// The prior of scaled unknowns: r = u.
class PriorCost final : public ceres::CostFunction {
 public:
  explicit PriorCost(int size) {
    set_num_residuals(size);
    *mutable_parameter_block_sizes() = {size};
  }
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    const int n = num_residuals();
    std::copy_n(parameters[0], n, residuals);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::MatrixXd>(jacobians[0], n, n).setIdentity();
    }
    return true;
  }
};

/// Residuals of one size, and their information about all unknowns [shared, clock of each
/// recording].
struct NoiseGroup {
  Eigen::MatrixXd information;  ///< J^T J
  double squares = 0.;
  int residuals = 0;
};

/// All residuals at a solution.
struct Linearisation {
  NoiseGroup position, yaw, parity;
};

class Fit {
 public:
  Fit(const CalibrationSetup& setup, const std::vector<std::size_t>& recordings)
      : setup_(setup),
        prior_(setup.recordings[recordings.front()].setup, setup.options),
        shared_(static_cast<std::size_t>(prior_.n_shared()), 0.),
        clock_(recordings.size(), 0.) {
    for (const std::size_t index : recordings) {
      problems_.push_back(
          std::make_unique<RecordingProblem>(setup.recordings[index], setup.options));
    }
  }

  CalibrationEstimate run() {
    // Noise scales and estimate by turns, as each needs the other (CAL-5): few steps at a time once
    // the estimate is near.
    constexpr int kMostRounds = 50, kFewIterations = 2, kMostIterations = 50;
    constexpr double kUnchanged = 1e-3;
    solve(kMostIterations);
    for (int round = 0; round < kMostRounds && rescale(linearise()) > kUnchanged; ++round) {
      solve(kFewIterations);
    }
    solve(kMostIterations);
    return result(linearise());
  }

 private:
  CalibrationPoint point(std::size_t k) const { return prior_.point(shared_.data(), clock_[k]); }

  void solve(int most_iterations) {
    for (const auto& problem : problems_) problem->set_noise(estimate_.noise);
    ceres::Problem problem;
    for (std::size_t k = 0; k < problems_.size(); ++k) {
      problem.AddResidualBlock(new RecordingCost(*problems_[k], prior_), nullptr, shared_.data(),
                               &clock_[k]);
      problem.AddResidualBlock(new PriorCost(1), nullptr, &clock_[k]);
    }
    problem.AddResidualBlock(new PriorCost(prior_.n_shared()), nullptr, shared_.data());
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.logging_type = ceres::SILENT;
    options.max_num_iterations = most_iterations;
    options.num_threads = 1;  // same bits on every machine; recordings share no scratch memory
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    if (!summary.IsSolutionUsable()) {
      throw std::runtime_error("the calibration did not converge: " + summary.message);
    }
    estimate_.iterations += static_cast<int>(summary.iterations.size());
    estimate_.converged = summary.termination_type == ceres::CONVERGENCE;
  }

  Linearisation linearise() {
    const int n = prior_.n_shared();
    const int size = n + static_cast<int>(problems_.size());
    Linearisation all;
    for (NoiseGroup* group : {&all.position, &all.yaw, &all.parity}) {
      group->information.setZero(size, size);
    }
    const Eigen::VectorXd scale = prior_.scale();
    for (std::size_t k = 0; k < problems_.size(); ++k) {
      RecordingResiduals at;
      problems_[k]->evaluate(point(k), true, at);
      const auto add = [&](double r, const Eigen::VectorXd& by_all, NoiseGroup& group) {
        const Eigen::VectorXd scaled = scale.cwiseProduct(by_all);
        Eigen::VectorXd J = Eigen::VectorXd::Zero(size);
        J.head(n) = scaled.head(n);
        J[n + static_cast<int>(k)] = scaled[n];
        if (r == 0. && J.isZero(0.)) return;  // a direction without parity information
        group.information.noalias() += J * J.transpose();
        group.squares += r * r;
        ++group.residuals;
      };
      for (int i = 0; i < at.pose.size(); ++i) {
        add(at.pose[i], at.J_pose.row(i), i % 3 == 0 ? all.yaw : all.position);
      }
      for (int i = 0; i < at.parity.size(); ++i) add(at.parity[i], at.J_parity.row(i), all.parity);
    }
    return all;
  }

  /// Variance components: squares over redundancy, group by group. Returns by what part the most
  /// changed of them did.
  double rescale(const Linearisation& at) {
    const Eigen::MatrixXd P = covariance(at);
    const auto factor = [&](const NoiseGroup& group) {
      const double redundancy = group.residuals - (P * group.information).trace();
      // What fits exactly, or has nothing to spare, says nothing about its own size.
      if (redundancy < 1. || group.squares < 1e-12) return 1.;
      return std::sqrt(group.squares / redundancy);
    };
    const double position = factor(at.position), yaw = factor(at.yaw);
    const double parity = setup_.options.parity ? factor(at.parity) : 1.;
    estimate_.noise.position_m *= position;
    estimate_.noise.yaw_rad *= yaw;
    estimate_.noise.parity_scale *= parity;
    return std::max({std::abs(position - 1.), std::abs(yaw - 1.), std::abs(parity - 1.)});
  }

  static Eigen::MatrixXd covariance(const Linearisation& at) {
    const auto size = at.position.information.rows();
    const Eigen::MatrixXd information = at.position.information + at.yaw.information +
                                        at.parity.information +
                                        Eigen::MatrixXd::Identity(size, size);
    return information.llt().solve(Eigen::MatrixXd::Identity(size, size));
  }

  CalibrationEstimate result(const Linearisation& at) {
    const CalibrationPoint final_point = point(0);
    estimate_.x_WI = final_point.x_WI;
    estimate_.extrinsics = final_point.extrinsics;
    const Eigen::MatrixXd P = covariance(at);
    const auto n = static_cast<int>(prior_.sigma.size());
    estimate_.sigma = prior_.sigma.cwiseProduct(P.diagonal().head(n).cwiseSqrt());
    estimate_.extrinsics_sigma =
        prior_.extrinsics_sigma.cwiseProduct(P.diagonal().segment<3>(n).cwiseSqrt());
    for (const double u : clock_) estimate_.clock_offset_s.push_back(prior_.clock_sigma_s * u);
    find_undetermined(P);
    return estimate_;
  }

  /// Directions whose posterior sigma is more than 0.7 of the prior's: the data say less than it.
  void find_undetermined(const Eigen::MatrixXd& P) {
    std::vector<int> free;
    for (int i = 0; i < prior_.sigma.size(); ++i) {
      if (prior_.sigma[i] > 0.) free.push_back(i);
    }
    const auto n = static_cast<int>(free.size());
    Eigen::MatrixXd P_free(n, n);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        P_free(i, j) = P(free[static_cast<std::size_t>(i)], free[static_cast<std::size_t>(j)]);
      }
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(P_free);
    const auto& specs = setup_.recordings.front().setup.model->description().intrinsics;
    for (int k = n - 1; k >= 0 && eigen.eigenvalues()[k] > 0.5; --k) {
      UndeterminedDirection direction;
      direction.sigma_ratio = std::sqrt(eigen.eigenvalues()[k]);
      for (int i = 0; i < n; ++i) {
        const auto index = static_cast<std::size_t>(free[static_cast<std::size_t>(i)]);
        direction.weights.emplace_back(specs[index].name, eigen.eigenvectors()(i, k));
      }
      std::stable_sort(
          direction.weights.begin(), direction.weights.end(),
          [](const auto& a, const auto& b) { return std::abs(a.second) > std::abs(b.second); });
      estimate_.undetermined.push_back(std::move(direction));
    }
  }

  const CalibrationSetup& setup_;
  Prior prior_;
  std::vector<double> shared_;
  std::vector<double> clock_;
  std::vector<std::unique_ptr<RecordingProblem>> problems_;
  CalibrationEstimate estimate_;
};

}  // namespace

CalibrationEstimate fit(const CalibrationSetup& setup, const std::vector<std::size_t>& recordings) {
  return Fit(setup, recordings).run();
}

}  // namespace viwo::calibration

// The update in a filter, on simulated motions: calibration that starts wrong, and landmarks in the
// state. Are the covariances honest, and what is it good for.
#include <cmath>
#include <memory>
#include <optional>
#include <random>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "anchored_point.hpp"
#include "test_support.hpp"
#include "viwo/estimator/estimator.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/chi2.hpp"
#include "viwo/sim/body_trajectory.hpp"
#include "viwo/sim/feature_simulator.hpp"
#include "viwo/sim/imu_simulator.hpp"

namespace viwo::visual {
namespace {

using testing::Random;

constexpr std::int64_t kStartNs = 1'000'000'000;

/// Circles, up and down, with all rotations.
sim::BodyTrajectory circles(double duration_s) {
  std::vector<PoseSample> poses;
  for (double t = -1.; t < duration_s + 1.; t += 0.04) {
    PoseSample& pose = poses.emplace_back();
    pose.t_ns = kStartNs + std::llround(1e9 * t);
    pose.p_BinW_m = {3. * std::cos(0.4 * t), 3. * std::sin(0.4 * t), 0.5 * std::sin(0.7 * t)};
    const Eigen::Quaterniond q(sim::rotation_from_euler(
        0.4 * t + 1.6 + 0.3 * std::sin(0.9 * t), 0.15 * std::sin(1.1 * t), 0.15 * std::cos(t)));
    pose.q_BtoW_xyzw = {q.x(), q.y(), q.z(), q.w()};
  }
  return sim::BodyTrajectory::through(poses, kStartNs, false, 0.2);
}

struct RunOptions {
  int n_cameras = 1;
  double duration_s = 20.;
  int max_landmarks = 0;
  bool breaks_anchors = false;
  double wrong = 0.;  ///< calibration that starts wrong: times the sigmas below
  double line_delay_s = 0.;
  bool knows_shutter = true;
  double sigma_velocity_m_per_s = 5e-3;  ///< of the start
  double far = 1.;                       ///< times as far as they are usually
  double sigma_orientation_rad = 2e-3;   ///< of the start
  Consistency consistency = Consistency::kTransform;
};

/// Takes from new anchors what depends on their clones.
class BreaksAnchors final : public Update {
 public:
  explicit BreaksAnchors(std::shared_ptr<VisualFeatures> update) : update_(std::move(update)) {}
  void declare(Declarations& host) override { update_->declare(host); }
  void start(const UpdateSetup& setup) override { update_->start(setup); }
  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override {
    update_->update(filter, data, sink);
  }
  void settle(const FilterView& filter, BlockEdits& edits) override {
    struct Broken final : BlockEdits {
      explicit Broken(BlockEdits& given) : host(given) {}
      void drop(BlockId id) override { host.drop(id); }
      void rewrite(const BlockRewrite& block) override {
        BlockRewrite broken = block;
        broken.J.middleCols(3, 2 * kPoseSize).setZero();
        host.rewrite(broken);
      }
      BlockEdits& host;
    } broken(edits);
    update_->settle(filter, broken);
  }

 private:
  std::shared_ptr<VisualFeatures> update_;
};

/// One simulated run.
class FilterRun {
 public:
  FilterRun(const sim::BodyTrajectory& trajectory, const RunOptions& options, std::uint64_t seed)
      : trajectory_(trajectory), options_(options), random_(seed) {
    for (int j = 0; j < options.n_cameras; ++j) {
      cameras_.push_back(nominal(j));
      cameras_.back().line_delay_s = options.line_delay_s;
    }
    std::vector<CameraPrior> priors = draw_priors();
    imu_ = sim::simulate_imu(trajectory, {}, imu_options(), seed);
    features_ = sim::simulate_features(trajectory, {}, cameras_, feature_options(), seed);
    Params params = testing::default_params();
    params.max_landmarks = options.max_landmarks;
    visual_ = std::make_shared<VisualFeatures>(params, HostServices{});
    std::shared_ptr<Update> update = visual_;
    if (options.breaks_anchors) update = std::make_shared<BreaksAnchors>(visual_);
    EstimatorOptions estimator;
    estimator.growing_window = false;
    estimator.filter.imu_noise = imu_options().densities;
    estimator.filter.consistency = options.consistency;
    estimator_ = std::make_unique<Estimator>(
        estimator, std::vector{UpdateEntry{"visual_features", update,
                                           std::make_shared<Rig>(priors, std::nullopt), ""}});
    start();
  }

  /// Runs up to `t_s` and returns whether it is well.
  bool run_to(double t_s) {
    const std::int64_t end_ns = kStartNs + std::llround(1e9 * t_s);
    while (next_ < features_.samples.size() && features_.samples[next_].t_ns <= end_ns) {
      const FeatureSample& image = features_.samples[next_++];
      while (next_imu_ < imu_.samples.size() &&
             imu_.samples[next_imu_].t_ns <= image.t_ns + 50'000'000) {
        estimator_->add(imu_.samples[next_imu_++]);
      }
      estimator_->add(0, image);
      while (estimator_->step()) {
        squared_m_ += pose_error().tail<3>().squaredNorm();
        ++epochs_;
      }
    }
    return estimator_->failure().empty() && estimator_->failures()[0].count == 0;
  }

  double rmse_m() const { return std::sqrt(squared_m_ / epochs_); }
  const Estimator& estimator() const { return *estimator_; }
  std::size_t n_landmarks() const { return visual_->landmarks().size(); }

  /// Chi-square of the errors of pose, calibration and landmarks; adds their number to `dof`.
  double nees(int& dof) const {
    errors_.clear();
    columns_.clear();
    add(pose_error(), 0);
    for (std::size_t j = 0; options_.wrong > 0. && j < cameras_.size(); ++j) add_calibration(j);
    for (const Landmark& landmark : visual_->landmarks()) add_landmark(landmark);
    const auto n = static_cast<Eigen::Index>(columns_.size());
    Eigen::MatrixXd P(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index k = 0; k < n; ++k) {
        P(i, k) = filter().covariance()(columns_[static_cast<std::size_t>(i)],
                                        columns_[static_cast<std::size_t>(k)]);
      }
    }
    dof += static_cast<int>(n);
    const Eigen::VectorXd e = Eigen::Map<const Eigen::VectorXd>(errors_.data(), n);
    return e.dot(P.llt().solve(e));
  }

 private:
  static CameraView nominal(int j) {
    CameraView camera = testing::make_camera(CameraDistortion::kRadtan);
    camera.R_ItoC << 0., -1., 0., 0., 0., -1., 1., 0., 0.;
    camera.p_IinC = Eigen::Vector3d(0.05 - 0.15 * j, 0.02, 0.04);
    return camera;
  }
  sim::ImuSimulation imu_options() const {
    sim::ImuSimulation imu;
    imu.duration_s = options_.duration_s;
    imu.start_ns = kStartNs;
    return imu;
  }
  sim::FeatureSimulation feature_options() const {
    sim::FeatureSimulation features;
    features.duration_s = options_.duration_s;
    features.start_ns = kStartNs;
    features.phase_s = 0.0137;
    features.features = 150;
    features.landmark_min_m *= options_.far;
    features.landmark_max_m *= options_.far;
    return features;
  }

  /// Moves the true cameras off the nominal ones by what the priors say.
  std::vector<CameraPrior> draw_priors() {
    std::vector<CameraPrior> priors(cameras_.size());
    const double late_s = options_.wrong * 0.005 * testing::normal(random_);
    for (std::size_t j = 0; j < cameras_.size(); ++j) {
      priors[j].camera = cameras_[j];
      if (!options_.knows_shutter) {  // all rows are those of the middle one
        priors[j].camera.t_CtoI_s += cameras_[j].middle_s();
        priors[j].camera.line_delay_s = 0.;
      }
      if (options_.wrong == 0.) continue;
      priors[j].sigma_extrinsics.setConstant(0.01);
      priors[j].sigma_intrinsics << 1., 1., 1., 1., 2e-3, 2e-3, 2e-4, 2e-4;
      priors[j].sigma_clock_s = 0.005;
      CameraView& truth = cameras_[j];
      const Eigen::VectorXd draw = options_.wrong * testing::normals(random_, 14);
      truth.R_ItoC = exp_so3(-0.01 * draw.head<3>()) * truth.R_ItoC;
      truth.p_IinC += 0.01 * draw.segment<3>(3);
      truth.intrinsics += priors[j].sigma_intrinsics.cwiseProduct(draw.tail<8>());
      truth.t_CtoI_s += late_s;
    }
    return priors;
  }

  StateSample truth_at(std::int64_t t_ns) const {
    return sim::true_state(trajectory_, {}, imu_, kStartNs, t_ns);
  }
  static Eigen::Matrix3d R_GtoI(const StateSample& state) {
    const auto& q = state.q_ItoG_xyzw;
    return Eigen::Quaterniond(q[3], q[0], q[1], q[2]).toRotationMatrix().transpose();
  }

  void start() {
    const StateSample truth = truth_at(kStartNs);
    Eigen::VectorXd sigma(kImuSize);
    sigma << Eigen::Vector3d::Constant(options_.sigma_orientation_rad),
        Eigen::Vector3d::Constant(5e-3), Eigen::Vector3d::Constant(options_.sigma_velocity_m_per_s),
        Eigen::VectorXd::Constant(6, 2e-3);
    const Eigen::VectorXd e = sigma.cwiseProduct(testing::normals(random_, kImuSize));
    ImuPrior prior;
    prior.t_ns = kStartNs;
    prior.P = sigma.cwiseAbs2().asDiagonal();
    prior.state.R_GtoI = exp_so3(Eigen::Vector3d(e.head<3>())) * R_GtoI(truth);
    prior.state.p_IinG = to_vector(truth.p_IinG_m) - e.segment<3>(3);
    prior.state.v_IinG = to_vector(truth.v_IinG_m_per_s) - e.segment<3>(6);
    prior.state.gyro_bias = to_vector(truth.gyro_bias_rad_per_s) - e.segment<3>(9);
    prior.state.accel_bias = to_vector(truth.accel_bias_m_per_s2) - e.segment<3>(12);
    estimator_->start(prior);
  }

  const Filter& filter() const { return estimator_->filter(); }

  Eigen::Matrix<double, 6, 1> pose_error() const {
    const StateSample truth = truth_at(filter().t_ns());
    Eigen::Matrix<double, 6, 1> e;
    e << -log_so3(R_GtoI(truth) * filter().imu().R_GtoI.transpose()),
        to_vector(truth.p_IinG_m) - filter().imu().p_IinG;
    return e;
  }

  void add(const Eigen::VectorXd& errors, int column) const {
    for (Eigen::Index k = 0; k < errors.size(); ++k) {
      errors_.push_back(errors[k]);
      columns_.push_back(column + static_cast<int>(k));
    }
  }
  void add_calibration(std::size_t j) const {
    const CameraView& truth = cameras_[j];
    const auto specs = filter().blocks().specs();
    for (std::size_t k = 0; k < specs.size(); ++k) {
      const std::string cam = "cam" + std::to_string(j) + ".";
      const BlockView& block = filter().blocks().views()[k];
      if (specs[k].name == cam + "extrinsics") {
        add(-log_so3(truth.R_ItoC * block.rotation().transpose()), block.column());
        add(truth.p_IinC - block.numbers(), block.column() + 3);
      } else if (specs[k].name == cam + "intrinsics") {
        add(truth.intrinsics - block.numbers(), block.column());
      } else if (specs[k].name == cam + "clock") {
        add(Eigen::VectorXd::Constant(1, truth.t_CtoI_s - block.numbers()[0]), block.column());
      }
    }
  }
  void add_landmark(const Landmark& landmark) const {
    const StateSample truth = truth_at(landmark.clone_ns);
    const CameraView& camera = cameras_[static_cast<std::size_t>(landmark.camera)];
    const Anchor anchor{R_GtoI(truth), camera.R_ItoC, to_vector(truth.p_IinG_m), camera.p_IinC};
    const Eigen::Vector3d p_C =
        anchor.to_camera(features_.p_FinG[static_cast<std::size_t>(landmark.id)]);
    const BlockView& block = filter().blocks().view(landmark.block);
    add(inverse_depth_of_point(p_C) - block.numbers(), block.column());
  }

  const sim::BodyTrajectory& trajectory_;
  RunOptions options_;
  Random random_;
  std::vector<CameraView> cameras_;  // as they truly are
  sim::SimulatedImu imu_;
  sim::SimulatedFeatures features_;
  std::shared_ptr<VisualFeatures> visual_;
  std::unique_ptr<Estimator> estimator_;
  std::size_t next_ = 0, next_imu_ = 0;
  double squared_m_ = 0.;
  int epochs_ = 0;
  mutable std::vector<double> errors_;
  mutable std::vector<int> columns_;
};

/// Sums over seeds at one instant are chi-square distributed, whatever the runs did before. Empty
/// when they are within two-sided bounds at all instants.
std::string inconsistency(const RunOptions& options, int seeds) {
  const std::vector<double> instants{6., 12., 19.5};
  const sim::BodyTrajectory trajectory = circles(options.duration_s);
  std::vector<double> sums(instants.size(), 0.);
  std::vector<int> dofs(instants.size(), 0);
  for (int seed = 1; seed <= seeds; ++seed) {
    FilterRun run(trajectory, options, static_cast<std::uint64_t>(seed));
    for (std::size_t k = 0; k < instants.size(); ++k) {
      if (!run.run_to(instants[k])) return "a run has failed: " + run.estimator().failure();
      if (options.max_landmarks > 0 && run.n_landmarks() == 0) return "no landmarks";
      sums[k] += run.nees(dofs[k]);
    }
  }
  constexpr double kErrorProbability = 0.001;
  const double tail = 0.5 * kErrorProbability / static_cast<double>(instants.size());
  std::string out;
  for (std::size_t k = 0; k < instants.size(); ++k) {
    const double low = chi2_quantile(tail, dofs[k]), high = chi2_quantile(1. - tail, dofs[k]);
    if (sums[k] > low && sums[k] < high) continue;
    out += "at " + std::to_string(instants[k]) + " s: " + std::to_string(sums[k]) + " outside of " +
           std::to_string(low) + " .. " + std::to_string(high) + "\n";
  }
  return out;
}

TEST(VisualRuns, PoseAndLandmarksAreConsistent) {
  EXPECT_EQ(inconsistency({.max_landmarks = 10}, 8), "");
  EXPECT_EQ(inconsistency({.n_cameras = 2, .max_landmarks = 10}, 8), "");
}

TEST(VisualRuns, LandmarksWhoseNewAnchorsForgetTheirClonesAreNotConsistent) {
  EXPECT_NE(inconsistency({.max_landmarks = 10, .breaks_anchors = true}, 8).find("outside of"),
            std::string::npos);
}

TEST(VisualRuns, CalibrationThatStartsWrongIsFoundConsistently) {
  EXPECT_EQ(inconsistency({.wrong = 1.}, 8), "");
  EXPECT_EQ(inconsistency({.n_cameras = 2, .wrong = 1.}, 8), "");
  EXPECT_EQ(inconsistency({.n_cameras = 2, .max_landmarks = 10, .wrong = 1.}, 8), "");
}

TEST(VisualRuns, AStartWhoseVelocityIsHardlyKnownIsConsistent) {
  // One camera has the scale of all from the IMU: a quarter of it is corrected on the way.
  EXPECT_EQ(inconsistency({.sigma_velocity_m_per_s = 0.3}, 8), "");
  EXPECT_EQ(inconsistency({.n_cameras = 2, .sigma_velocity_m_per_s = 0.3}, 8), "");
  // What was found with another scale is not expected of those that are found later.
  EXPECT_EQ(inconsistency({.sigma_velocity_m_per_s = 0.6, .far = 2.}, 8), "");
}

TEST(VisualRuns, RoughStartsAmongNearPointsAreConsistentIfTheCovarianceGoesWithTheEstimate) {
  for (const int n_cameras : {1, 2}) {
    RunOptions options{.n_cameras = n_cameras,
                       .sigma_velocity_m_per_s = 0.3,
                       .far = 0.1,
                       .sigma_orientation_rad = 0.03};
    EXPECT_EQ(inconsistency(options, 12), "") << n_cameras;
    options.consistency = Consistency::kNone;
    EXPECT_NE(inconsistency(options, 12).find("outside of"), std::string::npos) << n_cameras;
  }
}

TEST(VisualRuns, PointsThatAreTooFarForParallaxDoNoHarm) {
  for (const double far : {30., 100., 400.}) {
    EXPECT_EQ(inconsistency({.far = far}, 8), "") << far;
    EXPECT_EQ(inconsistency({.n_cameras = 2, .far = far}, 8), "") << far;
  }
}

TEST(VisualRuns, RollingShuttersAreConsistentIfTheyAreKnown) {
  RunOptions options{.line_delay_s = 5e-5};
  EXPECT_EQ(inconsistency(options, 8), "");
  options.knows_shutter = false;
  EXPECT_NE(inconsistency(options, 8).find("outside of"), std::string::npos);
  EXPECT_EQ(inconsistency({.n_cameras = 2, .wrong = 1., .line_delay_s = 5e-5}, 8), "");
  EXPECT_EQ(inconsistency({.n_cameras = 2, .max_landmarks = 10, .line_delay_s = 5e-5}, 8), "");
}

TEST(VisualRuns, LandmarksInTheStateMakeTheEstimateBetter) {
  for (const int n_cameras : {1, 2}) {
    double with = 0., without = 0.;
    RunOptions options{.n_cameras = n_cameras, .duration_s = 40.};
    const sim::BodyTrajectory trajectory = circles(options.duration_s);
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      for (const int most : {0, 20}) {
        options.max_landmarks = most;
        FilterRun run(trajectory, options, seed);
        ASSERT_TRUE(run.run_to(options.duration_s));
        (most == 0 ? without : with) += run.rmse_m();
      }
    }
    EXPECT_LT(with, 0.9 * without) << n_cameras << " cameras";
  }
}

}  // namespace
}  // namespace viwo::visual

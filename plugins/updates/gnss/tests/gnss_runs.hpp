// Monte-Carlo runs of the real filter with an IMU and a satellite receiver, on a base that drives
// over uneven ground; where the Earth lies in G, the lever arm and the start are drawn anew for
// each seed.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <GeographicLib/LocalCartesian.hpp>

#include "filter_fixture.hpp"
#include "rejections.hpp"
#include "viwo/estimator/estimator.hpp"
#include "viwo/eval/consistency.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/sim/imu_simulator.hpp"

namespace viwo::testing {

struct GnssDrive {
  std::string motion = "figure_eight";  ///< 40 m long and 20 m wide
  double yaw_rate_rad_per_s = 0.15;
  double duration_s = 100.;
  double rate_hz = 5.;
  /// Of a fix, east, north and up; what the messages say, too.
  Eigen::Vector3d sigma_m{1., 1., 2.};
  double noise_scale = 1.;  ///< of the noise that is drawn, not of what is said of it
  Eigen::Vector3d sigma_drift_m = Eigen::Vector3d::Zero();
  double drift_time_constant_s = 30.;
  double outlier_probability = 0.;  ///< of fixes that are up to 50 m off along each axis
  Eigen::Vector3d p_AinI{0.3, -0.2, 0.8};
  double sigma_lever_m = 0.05;
  /// Noise and first errors of the inertial state, in those of a cheap IMU: without wheels it is
  /// the odometry between fixes.
  double inertia = 0.03;
  Consistency consistency = Consistency::kTransform;
  std::string update;  ///< further parameters of the update: ", sigma_scale: 2"
  /// What is done to the fixes, and to the factors of the update before they are applied.
  std::function<void(std::vector<GnssSample>&)> edit;
  std::function<void(ResidualFactor&)> spoil;
  std::vector<double> instants_s{10., 50., 99.};
};

/// A poor receiver on a good odometry, and the other way round.
inline GnssDrive poor_receiver() { return {}; }
inline GnssDrive poor_odometry() {
  GnssDrive drive;
  drive.motion = "icr_sweep";
  drive.yaw_rate_rad_per_s = 0.6;
  drive.duration_s = 60.;
  drive.instants_s = {10., 30., 59.};
  drive.sigma_m = {0.02, 0.02, 0.03};
  drive.inertia = 1.;
  return drive;
}

struct GnssRun {
  /// Normalised estimation errors squared, by what and when, with their degrees of freedom.
  std::map<std::string, std::pair<double, int>> nees;
  bool aligned = false;
  double sigma_yaw = 0., error_yaw = 0.;
  UpdateCounts counts;
  Counts left_out;
  std::string failure;
};

inline constexpr std::array kOriginOfE{48.14, 11.58, 520.};
inline constexpr std::int64_t kGnssStartNs = 1'000'000'000;

/// What is true in a run.
struct GnssTruth {
  sim::BodyTrajectory trajectory;
  sim::Mounting mounting;
  double yaw_EtoG = 0.;
  Eigen::Vector3d p_EinG = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_AinI = Eigen::Vector3d::Zero();

  Eigen::Vector3d to_E(const Eigen::Vector3d& p_G) const {
    return exp_so3({0., 0., -yaw_EtoG}) * (p_G - p_EinG);
  }
  Eigen::Vector3d p_AinE(double t_s) const {
    const sim::BodyMotion imu = trajectory.imu(t_s, mounting);
    return to_E(imu.p_BinG + imu.R_BtoG * p_AinI);
  }
};

inline GnssSample fix_at(const Eigen::Vector3d& p_AinE, std::int64_t t_ns,
                         const Eigen::Vector3d& sigma) {
  static const GeographicLib::LocalCartesian frame(kOriginOfE[0], kOriginOfE[1], kOriginOfE[2]);
  GnssSample fix;
  fix.t_ns = t_ns;
  frame.Reverse(p_AinE.x(), p_AinE.y(), p_AinE.z(), fix.latitude_deg, fix.longitude_deg,
                fix.altitude_m);
  for (std::size_t i = 0; i < 3; ++i) {
    fix.covariance_ENU_m2[4 * i] = std::pow(sigma[static_cast<Eigen::Index>(i)], 2);
  }
  return fix;
}

inline std::vector<GnssSample> simulate_fixes(const GnssDrive& drive, const GnssTruth& truth,
                                              std::mt19937_64& rng) {
  std::vector<GnssSample> fixes;
  Eigen::Vector3d drift = drive.sigma_drift_m.cwiseProduct(gaussian(3, rng));
  const double kept = std::exp(-1. / drive.rate_hz / drive.drift_time_constant_s);
  std::uniform_real_distribution<double> uniform(-1., 1.);
  for (double t_s = 0.03; t_s < drive.duration_s; t_s += 1. / drive.rate_hz) {
    drift = (kept * drift +
             std::sqrt(1. - kept * kept) * drive.sigma_drift_m.cwiseProduct(gaussian(3, rng)))
                .eval();
    Eigen::Vector3d noise = drive.noise_scale * drive.sigma_m.cwiseProduct(gaussian(3, rng));
    if (0.5 + 0.5 * uniform(rng) < drive.outlier_probability) {
      noise += 50. * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng));
    }
    fixes.push_back(fix_at(truth.p_AinE(t_s) + drift + noise,
                           kGnssStartNs + std::llround(1e9 * t_s), drive.sigma_m));
  }
  return fixes;
}

inline GnssTruth draw_truth(const GnssDrive& drive, std::mt19937_64& rng) {
  sim::MotionOptions motion;
  motion.speed_m_per_s = 1.;
  motion.yaw_rate_rad_per_s = drive.yaw_rate_rad_per_s;
  sim::Mounting mounting;
  mounting.R_ItoO = exp_so3({0.1, -0.2, 1.3});
  mounting.p_IinO = {0.05, 0.02, 0.15};
  GnssTruth truth{
      sim::BodyTrajectory::drive(sim::PlanarMotion(drive.motion, motion),
                                 sim::Ground::uneven(0.05, 4.), -1., drive.duration_s + 1.),
      mounting, 0., 20. * gaussian(3, rng), drive.p_AinI};
  truth.yaw_EtoG = std::uniform_real_distribution<double>(-std::numbers::pi, std::numbers::pi)(rng);
  return truth;
}

/// The first state: the true one with an error that is drawn from its covariance.
inline ImuPrior draw_start(const GnssDrive& drive, const StateSample& truth, std::mt19937_64& rng) {
  Eigen::Matrix<double, kImuSize, 1> sigma;
  sigma << 0.01, 0.01, 0.01, 0.02, 0.02, 0.02, 0.05, 0.05, 0.05, 1e-3, 1e-3, 1e-3, 0.02, 0.02, 0.02;
  sigma *= drive.inertia;
  const Eigen::VectorXd error = sigma.cwiseProduct(gaussian(kImuSize, rng));
  ImuPrior prior;
  prior.t_ns = truth.t_ns;
  prior.state.R_GtoI =
      exp_so3(error.head<3>()) * to_quaternion(truth.q_ItoG_xyzw).toRotationMatrix().transpose();
  prior.state.p_IinG = to_vector(truth.p_IinG_m) - error.segment<3>(3);
  prior.state.v_IinG = to_vector(truth.v_IinG_m_per_s) - error.segment<3>(6);
  prior.state.gyro_bias = to_vector(truth.gyro_bias_rad_per_s) - error.segment<3>(9);
  prior.state.accel_bias = to_vector(truth.accel_bias_m_per_s2) - error.segment<3>(12);
  prior.P = sigma.cwiseAbs2().asDiagonal();
  return prior;
}

inline std::string gnss_section(const GnssDrive& drive, std::mt19937_64& rng) {
  const Eigen::Vector3d lever = drive.p_AinI + drive.sigma_lever_m * gaussian(3, rng);
  std::ostringstream yaml;
  yaml.precision(17);
  yaml << "{type: gnss, p_AinI_m: [" << lever[0] << ", " << lever[1] << ", " << lever[2]
       << "], sigma_p_AinI_m: [" << drive.sigma_lever_m << ", " << drive.sigma_lever_m << ", "
       << drive.sigma_lever_m << "]" << drive.update << "}";
  return yaml.str();
}

inline BlockId block_named(const Filter& filter, const std::string& name) {
  const auto specs = filter.blocks().specs();
  for (std::size_t i = 0; i < specs.size(); ++i) {
    if (specs[i].name == name) return {static_cast<int>(i)};
  }
  throw std::logic_error("no block " + name);
}

/// What the update says of its frames.
struct Frames {
  std::array<double, 3> origin = kOriginOfE;  ///< of E: latitude, longitude [deg], altitude [m]
  bool is_known = false;

  void read(const std::string& text) {
    const auto at = text.find("latitude ");
    if (at == std::string::npos) return;
    is_known = std::sscanf(text.substr(at).c_str(), "latitude %lf, longitude %lf, altitude %lf",
                           &origin[0], &origin[1], &origin[2]) == 3;
  }
  /// Where the origin is in the E of the truth.
  Eigen::Vector3d offset() const {
    const GeographicLib::LocalCartesian frame(kOriginOfE[0], kOriginOfE[1], kOriginOfE[2]);
    Eigen::Vector3d p;
    frame.Forward(origin[0], origin[1], origin[2], p.x(), p.y(), p.z());
    return p;
  }
};

/// The update, and what is done to its factors.
class WatchedGnss final : public Update {
 public:
  WatchedGnss(const std::string& yaml, std::function<void(ResidualFactor&)> spoil)
      : registry_({VIWO_TEST_PLUGIN_DIR},
                  [this](const PluginInfo&, LogLevel, std::string_view text) {
                    frames.read(std::string(text));
                  }),
        spoil_(std::move(spoil)) {
    config::Errors errors;
    update_ = registry_.make_update(config::parse(yaml, "test"), "updates", 0, errors).object;
    errors.throw_if_any();
  }

  void declare(Declarations& host) override { update_->declare(host); }
  void start(const UpdateSetup& setup) override { update_->start(setup); }
  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override {
    update_->update(filter, data, sink);
    if (!spoil_) return;
    for (const ResidualFactor& factor : sink.residuals()) {
      spoil_(const_cast<ResidualFactor&>(factor));
    }
  }
  void settle(const FilterView& filter, BlockEdits& edits) override {
    update_->settle(filter, edits);
  }
  void rejections(std::vector<RejectionCount>& out) const override { update_->rejections(out); }

  Frames frames;

 private:
  PluginRegistry registry_;
  std::function<void(ResidualFactor&)> spoil_;
  std::shared_ptr<Update> update_;
};

inline double nees_of(const Filter& filter, int column, const Eigen::VectorXd& error) {
  return eval::nees(error, filter.covariance().block(column, column, error.size(), error.size()));
}

/// Where the filter has the antenna in E, with its covariance, `ahead_s` after its last epoch.
struct AntennaInE {
  Eigen::Vector3d p;
  Eigen::Matrix3d P;
};

inline AntennaInE antenna_in_E(const Filter& filter, double ahead_s = 0.) {
  const BlockView& alignment = filter.blocks().view(block_named(filter, "gnss.alignment"));
  const BlockView& lever = filter.blocks().view(block_named(filter, "gnss.lever_arm"));
  const Eigen::Matrix3d R_ItoG = filter.imu().R_GtoI.transpose();
  const Eigen::Matrix3d R_GtoE = exp_so3({0., 0., -alignment.numbers()[0]});
  const Eigen::Vector3d l = lever.numbers();
  const Eigen::Vector3d u = filter.imu().p_IinG + ahead_s * filter.imu().v_IinG + R_ItoG * l -
                            alignment.numbers().tail<3>();
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(3, filter.size());
  H.middleCols<3>(kThetaColumn) = -R_GtoE * R_ItoG * skew(l);
  H.middleCols<3>(kPositionColumn) = R_GtoE;
  H.middleCols<3>(lever.column()) = R_GtoE * R_ItoG;
  H.col(alignment.column()) = -R_GtoE * Eigen::Vector3d::UnitZ().cross(u);
  H.middleCols<3>(alignment.column() + 1) = -R_GtoE;
  return {R_GtoE * u, H * filter.covariance() * H.transpose()};
}

/// Of pose, alignment and lever arm, and of the antenna in E, which needs their correlations.
inline void judge(const Filter& filter, const GnssTruth& truth, const StateSample& state,
                  const Frames& frames, const std::string& when, GnssRun& run) {
  const BlockView& alignment = filter.blocks().view(block_named(filter, "gnss.alignment"));
  const BlockView& lever = filter.blocks().view(block_named(filter, "gnss.lever_arm"));
  Eigen::VectorXd pose(6), aligned(4);
  const Eigen::Matrix3d R_GtoI = to_quaternion(state.q_ItoG_xyzw).toRotationMatrix().transpose();
  pose << -log_so3(R_GtoI * filter.imu().R_GtoI.transpose()),
      to_vector(state.p_IinG_m) - filter.imu().p_IinG;
  aligned << std::remainder(truth.yaw_EtoG - alignment.numbers()[0], 2. * std::numbers::pi),
      truth.p_EinG + exp_so3({0., 0., truth.yaw_EtoG}) * frames.offset() -
          alignment.numbers().tail<3>();
  run.error_yaw = aligned[0];
  run.sigma_yaw = std::sqrt(filter.covariance()(alignment.column(), alignment.column()));
  run.aligned = run.sigma_yaw < 0.5;
  run.nees["pose " + when] = {nees_of(filter, kThetaColumn, pose), 6};
  if (!run.aligned) return;
  run.nees["alignment " + when] = {nees_of(filter, alignment.column(), aligned), 4};
  run.nees["lever arm " + when] = {nees_of(filter, lever.column(), truth.p_AinI - lever.numbers()),
                                   3};
  const AntennaInE antenna = antenna_in_E(filter);
  const double t_s = seconds_between(kGnssStartNs, filter.t_ns());
  run.nees["antenna in E " + when] = {
      eval::nees(truth.p_AinE(t_s) - frames.offset() - antenna.p, antenna.P), 3};
}

inline GnssRun run_gnss(const GnssDrive& drive, std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  const GnssTruth truth = draw_truth(drive, rng);
  sim::ImuSimulation imu;
  imu.duration_s = drive.duration_s;
  imu.rate_hz = 100.;
  imu.start_ns = kGnssStartNs;
  imu.densities = {drive.inertia * 1e-3, drive.inertia * 1e-2, drive.inertia * 2e-5,
                   drive.inertia * 1e-3};
  const sim::SimulatedImu readings =
      sim::simulate_imu(truth.trajectory, truth.mounting, imu, seed + 1000);
  const auto state = [&](std::int64_t t_ns) {
    return sim::true_state(truth.trajectory, truth.mounting, readings, kGnssStartNs, t_ns);
  };
  std::vector<GnssSample> fixes = simulate_fixes(drive, truth, rng);
  if (drive.edit) drive.edit(fixes);

  EstimatorOptions options;
  options.filter.consistency = drive.consistency;
  options.filter.imu_noise = imu.densities;
  options.schedule.max_epoch_s = 0.1;
  options.schedule.max_wait_s = 0.;
  options.monitor.enabled = false;
  options.growing_window = false;
  const auto watched = std::make_shared<WatchedGnss>(gnss_section(drive, rng), drive.spoil);
  Estimator estimator(options, {{"gnss", watched, nullptr, ""}});
  estimator.start(draw_start(drive, state(kGnssStartNs), rng));

  GnssRun run;
  std::size_t fix = 0, instant = 0;
  for (const ImuSample& sample : readings.samples) {
    while (fix < fixes.size() && fixes[fix].t_ns <= sample.t_ns) estimator.add(0, fixes[fix++]);
    estimator.add(sample);
    while (estimator.step()) {
      const Filter& filter = estimator.filter();
      if (instant == drive.instants_s.size() ||
          seconds_between(kGnssStartNs, filter.t_ns()) < drive.instants_s[instant]) {
        continue;
      }
      const std::string when = "at " + std::to_string(std::lround(drive.instants_s[instant++]));
      judge(filter, truth, state(filter.t_ns()), watched->frames, when + " s", run);
    }
  }
  run.counts = estimator.counts()[0];
  run.failure = estimator.failure();
  run.left_out = counts_of(estimator);
  for (const UpdateFailures& f : estimator.failures()) run.failure += f.cause;
  return run;
}

inline std::vector<GnssRun> run_gnss_seeds(const GnssDrive& drive, int seeds) {
  std::vector<GnssRun> runs;
  for (int seed = 1; seed <= seeds; ++seed) {
    runs.push_back(run_gnss(drive, static_cast<std::uint64_t>(seed)));
  }
  return runs;
}

/// Mean NEES that are outside of their two-sided bounds, which hold for all of them together with
/// 99 %; empty when there are none. Only of what every run has.
inline std::string inconsistency(const std::vector<GnssRun>& runs) {
  std::map<std::string, double> sums;
  std::map<std::string, int> counts, dofs;
  for (const GnssRun& run : runs) {
    if (!run.failure.empty()) return "a run failed: " + run.failure;
    if (!run.aligned) return "a run did not find the alignment";
    for (const auto& [what, nees] : run.nees) {
      sums[what] += nees.first;
      dofs[what] = nees.second;
      ++counts[what];
    }
  }
  const auto n = static_cast<int>(runs.size());
  std::erase_if(counts, [&](const auto& count) { return count.second < n; });
  std::ostringstream out;
  for (const auto& [what, count] : counts) {
    const auto bounds =
        eval::mean_nees_bounds(dofs[what], n, 1. - 0.01 / static_cast<double>(counts.size()));
    const double mean = sums[what] / n;
    if (mean > bounds.low && mean < bounds.high) continue;
    out << what << ": mean NEES " << mean << " outside of " << bounds.low << " .. " << bounds.high
        << "\n";
  }
  return out.str();
}

}  // namespace viwo::testing

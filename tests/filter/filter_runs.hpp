// Runs of the delivered configurations, whole or measurement by measurement.
#pragma once

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "registry.hpp"
#include "viwo/eval/consistency.hpp"
#include "viwo/experiment/experiment.hpp"
#include "viwo/run/run.hpp"
#include "viwo/setup/configuration.hpp"

namespace viwo::testing {

/// A run of a delivered configuration, with assignments as --set would give them.
inline RunSetup run_setup(const std::string& name, const std::vector<std::string>& assignments,
                          std::uint64_t seed = 1) {
  const auto run = load_run_configuration(configuration(name), assignments);
  return read_run(resolve_placeholders(run), registry(), seed);
}

/// One variant of an experiment of configs/experiments, over the seeds 1 .. `seeds`.
inline std::vector<RunResult> variant_runs(const std::string& experiment,
                                           const std::string& variant, int seeds,
                                           std::vector<std::string> assignments) {
  experiment::ExperimentOptions options;
  options.seeds = seeds;
  options.assignments = std::move(assignments);
  auto setup =
      experiment::read_experiment(configuration("experiments/" + experiment + ".yaml"), options);
  std::erase_if(setup.variants, [&](const auto& v) { return v.name != variant; });
  auto result = experiment::run_experiment(setup, options, registry(), {});
  std::vector<RunResult> runs;
  for (experiment::ExperimentRun& run : result.runs) runs.push_back(std::move(run.result));
  return runs;
}

enum class MayBeModest { kNo, kYes };

/// Empty when the pose is consistent at all instants (s), each with its share of an error
/// probability of 0.001, else what is not.
inline std::string inconsistency_of_pose(const std::vector<RunResult>& runs,
                                         const std::vector<double>& instants,
                                         MayBeModest modest = MayBeModest::kNo) {
  std::ostringstream out;
  const int n = static_cast<int>(runs.size());
  const auto bounds =
      eval::mean_nees_bounds(6, n, 1. - 0.001 / static_cast<double>(instants.size()));
  for (const double instant : instants) {
    double mean = 0.;
    for (const auto& run : runs) {
      const auto& series = run.nees.series;
      const auto at = std::find_if(series.begin(), series.end(),
                                   [&](const auto& entry) { return entry.first >= instant; });
      if (at == series.end()) return "a run ended early: " + run.cause;
      mean += at->second / n;
    }
    if ((modest == MayBeModest::kYes || mean > bounds.low) && mean < bounds.high) continue;
    out << "at " << instant << " s: mean NEES of the pose " << mean << " outside of " << bounds.low
        << " .. " << bounds.high << "\n";
  }
  return out.str();
}

/// The estimator of a run that starts at the first true state.
inline Estimator make_estimator(const RunSetup& run, const StateSample& truth) {
  const FilterSetup& setup = *run.filter;
  Estimator estimator = make_estimator(setup);
  const auto& q = truth.q_ItoG_xyzw;
  const auto vector = [](const std::array<double, 3>& v) { return Eigen::Vector3d(v.data()); };
  ImuPrior prior;
  prior.t_ns = truth.t_ns;
  prior.state.R_GtoI = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).toRotationMatrix().transpose();
  prior.state.p_IinG = vector(truth.p_IinG_m);
  prior.state.v_IinG = vector(truth.v_IinG_m_per_s);
  prior.state.gyro_bias = vector(truth.gyro_bias_rad_per_s);
  prior.state.accel_bias = vector(truth.accel_bias_m_per_s2);
  const auto put = [&](int column, double sigma) {
    prior.P.diagonal().segment<3>(column).setConstant(sigma * sigma);
  };
  put(kThetaColumn, setup.start.sigma_orientation_rad);
  put(kPositionColumn, setup.start.sigma_position_m);
  put(kVelocityColumn, setup.start.sigma_velocity_m_per_s);
  put(kGyroBiasColumn, setup.start.sigma_gyro_bias_rad_per_s);
  put(kAccelBiasColumn, setup.start.sigma_accel_bias_m_per_s2);
  estimator.start(prior);
  return estimator;
}

/// A sample of a run and the sensor that gave it; valid as long as the data of the run.
struct Given {
  const std::string* sensor;
  SampleView sample;
};

/// What a filter takes of a run in the order of stamps: IMU, encoders, tracks.
inline std::vector<Given> in_time_order(const RunData& data) {
  std::vector<Given> all;
  for (const SampleType* type : sample_types<ImuSample, EncoderSample, FeatureSample>()) {
    for (const Recorded::Track& track : data.recorded.tracks()) {
      if (!(track.samples->type() == *type)) continue;
      for (std::size_t i = 0; i < track.samples->size(); ++i) {
        all.push_back({&track.sensor, track.samples->view(i)});
      }
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const Given& a, const Given& b) {
    return a.sample.t_ns() < b.sample.t_ns();
  });
  return all;
}

inline void add(Estimator& estimator, const RunSetup& setup, const Given& given) {
  setup.routes.dispatch(*given.sensor, given.sample.type(), [&](const Route& route) {
    if (route.consumer == Consumer::kImu) {
      estimator.add(*given.sample.get_if<ImuSample>());
    } else if (route.consumer == Consumer::kStream) {
      estimator.add(route.stream, given.sample);
    }
  });
}

}  // namespace viwo::testing

#include "viwo/smoother/smoother.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include <Eigen/Cholesky>

#include "block_values.hpp"
#include "factor_collector.hpp"
#include "path_recorder.hpp"
#include "viwo/api/status.hpp"
#include "viwo/config/overrides.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/run/parallel_for.hpp"
#include "viwo/setup/calibration_values.hpp"

namespace viwo::smoother {
namespace {

using config::Node;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostPasses = 25;
/// Nothing moves by more than a tenth of its sigma. Gates, which open and close, leave less.
constexpr double kConverged = 0.01;

using Values = std::vector<std::vector<double>>;  ///< of blocks

/// One recording between two passes.
struct Recording {
  const Input* input = nullptr;
  Node run;  ///< with the noises that the filter has found
  std::optional<PathRecorder> filter;
  BlockColumns columns;
  ImuState start;
  std::shared_ptr<GivenPath> path;
  Values blocks;
  std::optional<FactorCollector> factors;
  RunResult result;
};

/// What is the same in all recordings: columns of blocks of cameras and wheels that are estimated.
struct Shared {
  std::vector<Eigen::Index> columns;  ///< of BlockPrior::P, of the first recording
  std::vector<std::string> names;
  MatrixXd Lambda;  ///< of the prior

  int size() const { return static_cast<int>(columns.size()); }
};

[[noreturn]] void fail(const Recording& recording, const std::string& text) {
  throw InputError(recording.input->name + ": smoother: " + text);
}

RunResult run(const Recording& recording, RunSetup& setup, const RunHooks& hooks) {
  RunResult result = run_filter(setup, collect(setup), hooks);
  if (result.status == RunStatus::kOk && result.pieces.size() == 1) return result;
  fail(recording, std::string("the filter ends as '") + name(result.status) + "'" +
                      (result.cause.empty() ? "" : ": " + result.cause));
}

RunSetup set_up(const Recording& recording, PluginRegistry& plugins) {
  RunSetup setup = read_run(recording.run, plugins);
  if (!setup.filter) fail(recording, "the run needs a section 'updates'");
  setup.filter->restart = Restart::kNever;
  return setup;
}

/// Noises that were found become those of the configuration: what is left when a whole recording is
/// fitted says less about them.
void hold_noises(const RunResult& result, const Node& resolved, Node& run) {
  for (const NoiseFound& noise : result.noises) {
    const std::size_t dot = noise.name.rfind('.');
    std::string update = noise.name.substr(0, dot);
    // Of several wheel sets each has an instance, SET.UPDATE.
    update = update.substr(update.rfind('.') + 1);
    const std::string path = "updates." + update + ".", parameter = noise.name.substr(dot + 1);
    if (resolved.find("updates")->find(update)->find(parameter) == nullptr) continue;
    config::set_path(run, path + parameter, Node::scalar_of(significant(noise.found, 17)));
    config::set_path(run, path + "find_noise", Node::scalar_of("false"));
  }
}

/// Whose passes are about linearising again: factors are those of the path that it gives.
void linearise_at_the_path(const Node& resolved, Node& run) {
  for (const Node::Entry& update : resolved.find("updates")->entries()) {
    if (update.value.find("linearise_twice") == nullptr) continue;
    config::set_path(run, "updates." + update.key + ".linearise_twice", Node::scalar_of("false"));
  }
}

/// The filter as it is configured: where the smoother begins.
void run_filter_of(Recording& recording, PluginRegistry& plugins) {
  RunSetup setup = set_up(recording, plugins);
  RunHooks hooks;
  hooks.on_start = [&](const Estimator& estimator) { return &recording.filter.emplace(estimator); };
  recording.result = run(recording, setup, hooks);
  hold_noises(recording.result, setup.resolved, recording.run);
  linearise_at_the_path(setup.resolved, recording.run);
  recording.start = recording.filter->start().state;
  recording.path = std::make_shared<GivenPath>(recording.filter->path());
  recording.blocks = recording.filter->blocks();
}

bool moves(const BlockSpec& spec) {
  return spec.process != Process::kConstant &&
         std::any_of(spec.entries.begin(), spec.entries.end(),
                     [](const BlockEntry& entry) { return entry.process_sigma > 0.; });
}

/// Which unknown each column of blocks is. Blocks that are not of cameras and wheels (where the
/// Earth is) are the recording's own.
std::vector<std::string> number_columns(Recording& recording, Shared* shared) {
  std::vector<std::string> names;
  const BlockPrior& prior = recording.filter->prior();
  BlockColumns& columns = recording.columns;
  columns.unknown.assign(static_cast<std::size_t>(prior.P.rows()), kInRoom);
  for (std::size_t b = 0; b < prior.specs.size(); ++b) {
    const BlockSpec& spec = prior.specs[b];
    if (prior.first[b] < 0) continue;
    if (moves(spec) && spec.rotations > 0) fail(recording, "'" + spec.name + "' turns");
    for (std::size_t i = 0; i < spec.entries.size(); ++i) {
      const auto column = static_cast<std::size_t>(prior.first[b]) + i;
      const auto at = static_cast<Eigen::Index>(column);
      columns.unknown[column] = kHeld;
      if (!(prior.P(at, at) > 0.)) continue;
      if (moves(spec)) {
        const bool settles = spec.process == Process::kGaussMarkov;
        columns.moving.push_back({static_cast<int>(column), spec.entries[i].process_sigma,
                                  settles ? spec.time_constant_s : 0.});
      } else if (is_of_the_rig(spec.name)) {
        columns.unknown[column] = smoother::shared(static_cast<int>(names.size()));
        names.push_back(spec.entries[i].name);
        if (shared != nullptr) shared->columns.push_back(at);
      } else {
        columns.unknown[column] = columns.own++;
      }
    }
  }
  return names;
}

Shared number_columns(std::vector<Recording>& recordings) {
  Shared shared;
  for (Recording& recording : recordings) {
    const bool is_first = &recording == &recordings.front();
    const std::vector<std::string> names = number_columns(recording, is_first ? &shared : nullptr);
    if (is_first) shared.names = names;
    if (names != shared.names) fail(recording, "it estimates other parameters than the first one");
  }
  const MatrixXd P = recordings.front().filter->prior().P(shared.columns, shared.columns);
  shared.Lambda = P.llt().solve(MatrixXd::Identity(P.rows(), P.cols()));
  return shared;
}

/// Cameras and wheels begin where the filter of the first recording has them.
void take_shared_blocks(const Recording& first, Recording& recording) {
  const std::vector<BlockSpec>& of_first = first.filter->prior().specs;
  const std::vector<BlockSpec>& specs = recording.filter->prior().specs;
  for (std::size_t b = 0; b < specs.size(); ++b) {
    if (!is_of_the_rig(specs[b].name)) continue;
    const auto same = std::ranges::find(of_first, specs[b].name, &BlockSpec::name);
    if (same == of_first.end()) fail(recording, "the first one has no '" + specs[b].name + "'");
    recording.blocks[b] = first.blocks[static_cast<std::size_t>(same - of_first.begin())];
  }
}

/// By how much the blocks are off their prior, by columns.
VectorXd off_prior(const Recording& recording) {
  const BlockPrior& prior = recording.filter->prior();
  VectorXd off = VectorXd::Zero(prior.P.rows());
  for (std::size_t b = 0; b < prior.specs.size(); ++b) {
    if (prior.first[b] < 0) continue;
    const BlockSpec& spec = prior.specs[b];
    const VectorXd dx = difference(spec, recording.blocks[b], spec.value);
    off.segment(prior.first[b], dx.size()) = dx;
  }
  return off;
}

/// The priors of blocks that only this recording has.
void add_own_priors(Recording& recording) {
  const BlockPrior& prior = recording.filter->prior();
  const VectorXd off = off_prior(recording);
  const int behind = kImuSize * (static_cast<int>(recording.path->epochs.size()) + 1);
  for (std::size_t column = 0; column < recording.columns.unknown.size(); ++column) {
    const int own = recording.columns.unknown[column];
    if (own < 0) continue;
    const auto at = static_cast<Eigen::Index>(column);
    const int unknown = behind + own;
    const MatrixXd Lambda = MatrixXd::Constant(1, 1, 1. / prior.P(at, at));
    recording.factors->system().add({&unknown, 1}, Lambda, -Lambda * off.segment<1>(at));
  }
}

/// Along the path, with the blocks as they are now (SM-1).
void collect_factors(Recording& recording, int n_shared, PluginRegistry& plugins) {
  RunSetup setup = set_up(recording, plugins);
  EstimatorOptions& options = setup.filter->options;
  options.runner.frozen = options.runner.no_crowds = true;
  options.monitor.enabled = false;
  options.along = recording.path;
  const BlockPrior& prior = recording.filter->prior();
  for (std::size_t b = 0; b < prior.specs.size(); ++b) {
    if (moves(prior.specs[b])) continue;  // linear: taken at what was declared
    options.continuation.blocks.emplace_back(prior.specs[b].name, recording.blocks[b]);
  }
  setup.filter->start.given = recording.filter->start();
  setup.filter->start.given->state = recording.start;
  recording.factors.emplace(*recording.filter, recording.start, recording.path->epochs.size(),
                            recording.columns, n_shared);
  add_own_priors(recording);
  RunHooks hooks;
  hooks.on_start = [&](const Estimator&) { return &*recording.factors; };
  recording.result = run(recording, setup, hooks);
  if (recording.factors->path().epochs.size() != recording.path->epochs.size()) {
    fail(recording, "its epochs change with the clocks");
  }
  if (!recording.factors->system().eliminate()) fail(recording, "the motion is not determined");
}

/// What all recordings and the prior say of the shared unknowns.
struct Normal {
  MatrixXd Lambda;
  VectorXd eta;
};

Normal sum(std::vector<Recording>& recordings, const Shared& shared) {
  Normal sum{shared.Lambda, VectorXd()};
  sum.eta = -shared.Lambda * off_prior(recordings.front())(shared.columns);
  for (Recording& recording : recordings) {
    sum.Lambda += recording.factors->system().Lambda();
    sum.eta += recording.factors->system().eta();
  }
  return sum;
}

/// The part of each step that is taken (SM-7): where the next step leads back, the last one was too
/// long.
class StepLength {
 public:
  double of(const VectorXd& dx, const MatrixXd& Lambda) {
    constexpr double kLeast = 0.3;
    if (last_.size() > 0) {
      const VectorXd change = last_ - dx;
      const double length = part_ * last_.dot(Lambda * change) / change.dot(Lambda * change);
      part_ = length > kLeast ? std::min(length, 1.) : kLeast;
    }
    last_ = dx;
    return part_;
  }

 private:
  double part_ = 1.;
  VectorXd last_;
};

/// Moves the estimate of a recording by a part of a step.
void move(Recording& recording, const VectorXd& dx_shared, double part) {
  const VectorXd own = part * recording.factors->system().own(dx_shared);
  retract(own.head<kImuSize>(), recording.start);
  auto path = std::make_shared<GivenPath>(recording.factors->path());
  for (std::size_t k = 0; k < path->epochs.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(kImuSize * (k + 1));
    retract(own.segment<kImuSize>(at), path->epochs[k].state);
  }
  const auto behind = static_cast<Eigen::Index>(kImuSize * (path->epochs.size() + 1));
  recording.path = std::move(path);
  const BlockPrior& prior = recording.filter->prior();
  for (std::size_t b = 0; b < prior.specs.size(); ++b) {
    if (prior.first[b] < 0 || moves(prior.specs[b])) continue;
    VectorXd dx = VectorXd::Zero(static_cast<Eigen::Index>(prior.specs[b].entries.size()));
    for (Eigen::Index i = 0; i < dx.size(); ++i) {
      const int unknown = recording.columns.unknown[static_cast<std::size_t>(prior.first[b] + i)];
      if (unknown == kHeld) continue;
      dx[i] = unknown < 0 ? part * dx_shared[~unknown] : own[behind + unknown];
    }
    retract(prior.specs[b], dx, recording.blocks[b]);
  }
}

/// The values of all blocks as they were declared, and how they hung together.
CalibrationFile known_before(const Recording& first, const RunSetup& setup) {
  FilterOptions options;
  options.correlations = setup.filter->options.filter.correlations;
  return calibration_file_of(Filter(options, first.filter->prior().specs));
}

/// The values of all blocks with the covariance of the shared ones, as a filter has them that
/// begins with what was found.
CalibrationFile calibration_of(const Recording& first, const Shared& shared,
                               const MatrixXd& covariance, const RunSetup& setup) {
  const BlockPrior& prior = first.filter->prior();
  FilterOptions options;
  std::vector<BlockSpec> specs = prior.specs;
  Eigen::VectorXd sigma = covariance.diagonal().cwiseSqrt();
  std::vector<BlockEntry*> entries(static_cast<std::size_t>(prior.P.rows()), nullptr);
  for (std::size_t b = 0; b < specs.size(); ++b) {
    specs[b].value = first.blocks[b];
    for (std::size_t i = 0; i < specs[b].entries.size(); ++i) {
      if (prior.first[b] >= 0) {
        entries[static_cast<std::size_t>(prior.first[b]) + i] = &specs[b].entries[i];
      }
    }
  }
  for (int k = 0; k < shared.size(); ++k) {
    BlockEntry& entry =
        *entries[static_cast<std::size_t>(shared.columns[static_cast<std::size_t>(k)])];
    entry.sigma = sigma[k];
    options.correlations.entries.push_back(entry.name);
  }
  options.correlations.matrix =
      sigma.cwiseInverse().asDiagonal() * covariance * sigma.cwiseInverse().asDiagonal();
  CalibrationFile file = calibration_file_of(Filter(options, std::move(specs)));
  const CalibrationFile nominal = known_before(first, setup);
  for (auto section : {&CalibrationFile::intrinsics, &CalibrationFile::mount,
                       &CalibrationFile::clock, &CalibrationFile::cameras}) {
    for (std::size_t i = 0; i < (file.*section).size(); ++i) {
      (file.*section)[i].nominal = (nominal.*section)[i].nominal;
    }
  }
  describe_rig(setup, file);
  return file;
}

}  // namespace

Smoothed smooth(std::span<const Input> inputs, PluginRegistry& plugins, WorkProgress& progress) {
  std::vector<Recording> recordings(inputs.size());
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    recordings[i].input = &inputs[i];
    recordings[i].run = inputs[i].run;
  }
  const auto for_each = [&](auto&& work) {
    parallel_for(recordings.size(), [&](std::size_t i) { work(recordings[i]); });
  };
  for_each([&](Recording& recording) { run_filter_of(recording, plugins); });
  progress.note("smoother: the filter has gone before");
  const Shared shared = number_columns(recordings);
  for (Recording& recording : recordings) take_shared_blocks(recordings.front(), recording);
  Smoothed out;
  MatrixXd covariance;
  StepLength length;
  while (!out.converged && out.iterations < kMostPasses) {
    for_each([&](Recording& recording) { collect_factors(recording, shared.size(), plugins); });
    const Normal normal = sum(recordings, shared);
    const Eigen::LLT<MatrixXd> llt(normal.Lambda);
    if (llt.info() != Eigen::Success) fail(recordings.front(), "the calibration is not determined");
    covariance = llt.solve(MatrixXd::Identity(shared.size(), shared.size()));
    const VectorXd dx = llt.solve(normal.eta);
    out.left = normal.eta.dot(dx);
    const double part = length.of(dx, normal.Lambda);
    for (Recording& recording : recordings) move(recording, dx, part);
    ++out.iterations;
    out.converged = out.left < kConverged;
    progress.note("smoother, pass " + std::to_string(out.iterations) +
                  ": the calibration moves by " + significant(std::sqrt(out.left), 3) +
                  " of its sigmas");
  }
  for (Recording& recording : recordings) {
    for (const auto* texts : {&recording.result.doubts, &recording.result.warnings}) {
      for (const std::string& text : *texts) {
        out.warnings.push_back(recording.input->name + ": " + text);
      }
    }
    out.runs.push_back(std::move(recording.result));
    out.residuals += recording.factors->rows();
    out.weighed_down += recording.factors->weighed_down();
  }
  const RunSetup setup = set_up(recordings.front(), plugins);
  out.calibration = calibration_of(recordings.front(), shared, covariance, setup);
  out.before = known_before(recordings.front(), setup);
  return out;
}

}  // namespace viwo::smoother

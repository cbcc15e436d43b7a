// Cost of one epoch of the filter (propagate, clone, update, marginalise) on one thread, and the
// same as a ratio to a matrix product of this run, which can be compared between machines.
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "filter_runs.hpp"
#include "ratio_reporter.hpp"

namespace viwo {
namespace {

const char* const kPerEpoch = "time_per_epoch";
const std::string kReference = "reference: 512 x 512 matrix product";
constexpr std::int64_t kWarmUpEpochs = 100;  // until the window is full: it grows slowly

/// What of the simulated robot is used.
struct Variant {
  const char* name;
  int features;  ///< points of an image
  int cameras;
  int max_features;  ///< tracks that are used in one epoch
  bool wheels;
  bool calibrates = false;  ///< the cameras
  int clones = 11;
};
// Few long tracks, as in an indoor scene; and images with more tracks that end than are used.
constexpr Variant kVariants[] = {{"mono, about 23 features", 230, 1, 100, false},
                                 {"mono, 100 features", 1400, 1, 100, false},
                                 {"stereo, 100 features", 1400, 2, 100, false},
                                 {"stereo, 100 features, wheels", 1400, 2, 100, true},
                                 {"mono, cameras calibrated", 230, 1, 100, false, true},
                                 {"stereo, cameras calibrated", 230, 2, 100, false, true},
                                 {"stereo, about 23 features", 230, 2, 100, false},
                                 {"mono, 30 clones", 230, 1, 100, false, false, 30},
                                 {"stereo, 30 clones", 230, 2, 100, false, false, 30}};

/// A minute of measurements, and estimators that run over them.
class Runs {
 public:
  explicit Runs(const Variant& variant) {
    const auto number = [](int n) { return std::to_string(n); };
    assignments_ = {"sensors.simulator0.features=" + number(variant.features),
                    "sensors.simulator0.n_cameras=" + number(variant.cameras),
                    "cameras.use=" + number(variant.cameras),
                    std::string("cameras.calibrate=") + (variant.calibrates ? "true" : "false"),
                    "estimator.clones=" + number(variant.clones),
                    "updates.visual_features.max_features=" + number(variant.max_features)};
    if (!variant.wheels) {
      assignments_.emplace_back("updates.wheel_odometry.enabled=false");
      assignments_.emplace_back("updates.wheel_parity.enabled=false");
    }
    restart();
    data_ = collect(*setup_);
    start_ = data_.states().front();
    measurements_ = testing::in_time_order(data_);
    next_ = measurements_.size();
  }

  /// Runs one epoch of the steady state and returns its time in seconds.
  double epoch() {
    for (;;) {
      if (next_ == measurements_.size()) {
        restart();
        estimator_ = std::make_unique<Estimator>(testing::make_estimator(*setup_, start_));
        next_ = 0;
      }
      while (!estimator_->step() && next_ < measurements_.size()) {
        testing::add(*estimator_, *setup_, measurements_[next_++]);
      }
      if (!estimator_->failure().empty()) return 0.;
      if (next_ == measurements_.size() || estimator_->epochs() < kWarmUpEpochs) continue;
      const auto stages = estimator_->stage_ms();
      return 1e-3 * std::accumulate(stages.begin(), stages.end(), 0.);
    }
  }

  const Estimator& estimator() const { return *estimator_; }

 private:
  /// Updates are started once: new ones for a new estimator.
  void restart() { setup_.emplace(testing::run_setup("runs/viwo_swerve.yaml", assignments_)); }

  std::vector<std::string> assignments_;
  std::optional<RunSetup> setup_;
  StateSample start_;
  RunData data_;
  std::vector<testing::Given> measurements_;
  std::size_t next_ = 0;
  std::unique_ptr<Estimator> estimator_;
};

void epochs(benchmark::State& state, const Variant& variant) {
  Runs runs(variant);
  for (auto _ : state) state.SetIterationTime(runs.epoch());
  const Estimator& estimator = runs.estimator();
  if (!estimator.failure().empty()) state.SkipWithError(estimator.failure().c_str());
  const UpdateCounts& features = estimator.counts().front();
  state.counters["features_per_epoch"] = static_cast<double>(features.applied + features.rejected) /
                                         static_cast<double>(estimator.epochs());
  // The inverse of a rate: a time, printed with its unit.
  state.counters[kPerEpoch] =
      benchmark::Counter(static_cast<double>(state.iterations()),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void register_all() {
  benchmark::RegisterBenchmark(kReference.c_str(), testing::matrix_product, 512)
      ->Unit(benchmark::kMillisecond);
  for (const Variant& variant : kVariants) {
    benchmark::RegisterBenchmark(variant.name, epochs, variant)
        ->UseManualTime()
        ->Iterations(1000)
        ->Repetitions(3)
        ->Unit(benchmark::kMillisecond);
  }
}

}  // namespace
}  // namespace viwo

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  viwo::register_all();
  viwo::testing::RatioReporter reporter(viwo::kReference, viwo::kPerEpoch);
  benchmark::RunSpecifiedBenchmarks(&reporter);
  reporter.print_ratios();
  return 0;
}

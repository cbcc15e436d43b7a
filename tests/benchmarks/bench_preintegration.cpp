// Cost of preintegration per encoder sample, for every model, plain and noise-weighted, and the
// same as a ratio to a matrix product of this run, which can be compared between machines.
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "ratio_reporter.hpp"
#include "viwo/wheel/preintegration.hpp"
#include "wheel_fixture.hpp"

namespace viwo {
namespace {

constexpr std::int64_t kSamples = 1000;
constexpr double kRate_hz = 100.;
constexpr std::int64_t kPeriod_ns = 10'000'000;
const char* const kPerSample = "time_per_sample";
const std::string kReference = "reference: 64 x 64 matrix product";

/// What of a sample is used.
struct Variant {
  const char* name;
  bool parity;
  double gate_probability;
};
constexpr Variant kVariants[] = {
    {"pose", false, 0.}, {"pose and parity", true, 0.}, {"pose, parity and gate", true, 1e-6}};

/// Noisy samples of a drive that every model can follow: no gate rejects, no row fits exactly.
std::vector<EncoderSample> noisy_drive(const WheelModel& model) {
  const bool can_crab = model.description().n_steer > 0;
  const auto motion = [&](double t) {
    return Twist(0.4 + 0.1 * std::sin(0.7 * t), can_crab ? 0.2 * std::sin(1.3 * t) : 0.,
                 0.6 * std::sin(0.8 * t));
  };
  auto samples =
      testing::sample_motion(model, motion, static_cast<double>(kSamples) / kRate_hz, kRate_hz);
  std::mt19937_64 rng(2024);
  for (EncoderSample& sample : samples) {
    sample = testing::with_noise(model, motion(1e-9 * static_cast<double>(sample.t_ns)), sample, 1.,
                                 rng);
  }
  return samples;
}

PreintegrationOptions options_of(const Variant& variant, bool weighted) {
  return {.twist = {.noise_weighted = weighted},
          .parity_gate_probability = variant.gate_probability,
          .parity = variant.parity};
}

void report_samples(benchmark::State& state, std::int64_t per_iteration) {
  const std::int64_t total = state.iterations() * per_iteration;
  state.SetItemsProcessed(total);
  // The inverse of a rate: a time, printed with its unit.
  state.counters[kPerSample] = benchmark::Counter(
      static_cast<double>(total), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

/// All samples in one interval: the cost of a sample alone.
void preintegrate(benchmark::State& state, const std::string& yaml,
                  const PreintegrationOptions& options) {
  const auto model = testing::load_model(yaml);
  const auto samples = noisy_drive(*model);
  Preintegrator preintegrator(model, options);
  PreintegratedPose pose;
  for (auto _ : state) {
    preintegrator.integrate(samples, 0, kSamples * kPeriod_ns, pose);
    benchmark::DoNotOptimize(pose);
  }
  if (pose.samples != kSamples || pose.gated + pose.rejected != 0) state.SkipWithError("bridged");
  report_samples(state, kSamples);
}

/// As a filter at 10 Hz does it: intervals of ten samples that cut the samples at their ends, each
/// with new intrinsics.
void preintegrate_intervals(benchmark::State& state, const std::string& yaml,
                            const PreintegrationOptions& options) {
  constexpr std::int64_t kPerInterval = 10;
  constexpr std::int64_t kIntervals = kSamples / kPerInterval - 1;
  constexpr std::int64_t kOffset_ns = kPeriod_ns / 3;
  const auto model = testing::load_model(yaml);
  const auto samples = noisy_drive(*model);
  Preintegrator preintegrator(model, options);
  PreintegratedPose pose;
  for (auto _ : state) {
    for (std::int64_t k = 0; k < kIntervals; ++k) {
      preintegrator.set_intrinsics(model->nominal());
      const std::int64_t begin_ns = k * kPerInterval * kPeriod_ns + kOffset_ns;
      preintegrator.integrate(samples, begin_ns, begin_ns + kPerInterval * kPeriod_ns, pose);
      benchmark::DoNotOptimize(pose);
    }
  }
  report_samples(state, kIntervals * kPerInterval);
}

void register_all() {
  benchmark::RegisterBenchmark(kReference.c_str(), testing::matrix_product, 64);
  const std::pair<const char*, std::string> models[] = {
      {"four_wis_wid", testing::swerve("four_wis_wid")},
      {"four_wis_wid_drive_only", testing::swerve("four_wis_wid_drive_only")},
      {"differential", testing::differential()}};
  for (const auto& [name, yaml] : models) {
    for (const bool weighted : {false, true}) {
      for (const Variant& variant : kVariants) {
        const std::string label =
            name + std::string(weighted ? ", weighted: " : ", plain: ") + variant.name;
        benchmark::RegisterBenchmark(label.c_str(), preintegrate, yaml,
                                     options_of(variant, weighted));
      }
    }
  }
  for (const Variant& variant : kVariants) {
    const std::string label = "four_wis_wid, plain, intervals of 10: " + std::string(variant.name);
    benchmark::RegisterBenchmark(label.c_str(), preintegrate_intervals, models[0].second,
                                 options_of(variant, false));
  }
}

}  // namespace
}  // namespace viwo

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  viwo::register_all();
  viwo::testing::RatioReporter reporter(viwo::kReference, viwo::kPerSample);
  benchmark::RunSpecifiedBenchmarks(&reporter);
  reporter.print_ratios();
  return 0;
}

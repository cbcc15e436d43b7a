// Prints benchmarks as usual, then the least time of each as a ratio to a reference of the same
// run, which can be compared between machines.
#pragma once

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <benchmark/benchmark.h>

namespace viwo::testing {

/// The reference: of matrices with `n` rows and columns.
inline void matrix_product(benchmark::State& state, Eigen::Index n) {
  std::srand(1);  // Eigen's Random
  const Eigen::MatrixXd a = Eigen::MatrixXd::Random(n, n);
  const Eigen::MatrixXd b = Eigen::MatrixXd::Random(n, n);
  Eigen::MatrixXd c(n, n);
  for (auto _ : state) {
    c.noalias() = a * b;
    benchmark::DoNotOptimize(c.data());
  }
}

/// Of both spellings that the library has had.
template <class Run>
bool failed(const Run& run) {
  if constexpr (requires { run.error_occurred; }) {
    return run.error_occurred;
  } else {
    return static_cast<bool>(run.skipped);
  }
}

/// The least time of each benchmark counts: disturbances only add.
class RatioReporter final : public benchmark::ConsoleReporter {
 public:
  /// `time_counter`: a counter in seconds that stands for the time of a benchmark that has it.
  RatioReporter(std::string reference, std::string time_counter)
      : reference_(std::move(reference)), time_counter_(std::move(time_counter)) {}

  void ReportRuns(const std::vector<Run>& runs) override {
    ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration || failed(run)) continue;
      const auto counter = run.counters.find(time_counter_);
      const double seconds = counter != run.counters.end()
                                 ? counter->second.value
                                 : run.cpu_accumulated_time / static_cast<double>(run.iterations);
      const double ns = 1e9 * seconds;
      auto [entry, is_new] = least_ns_.emplace(run.run_name.function_name, ns);
      if (is_new) order_.push_back(entry->first);
      entry->second = std::min(entry->second, ns);
    }
  }

  void print_ratios() const {
    const auto reference = least_ns_.find(reference_);
    if (reference == least_ns_.end()) return;
    std::printf("\n%-60s %10s %12s\n", "least time", "ns", "/ reference");
    for (const std::string& name : order_) {
      const double ns = least_ns_.at(name);
      std::printf("%-60s %10.1f %12.5f\n", name.c_str(), ns, ns / reference->second);
    }
  }

 private:
  std::string reference_, time_counter_;
  std::map<std::string, double> least_ns_;
  std::vector<std::string> order_;
};

}  // namespace viwo::testing

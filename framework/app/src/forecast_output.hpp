// `viwo run --plan`: which piece of motion is missing, said while it runs and at its end.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "viwo/plan/forecast.hpp"
#include "viwo/run/run.hpp"

namespace viwo::app {

class ForecastOutput {
 public:
  /// InputError for a plan of another base, and for a run without a filter.
  ForecastOutput(const std::filesystem::path& plan, const RunSetup& setup, PluginRegistry& plugins);

  /// Watches a run; `live`: says what changes while it runs.
  void watch(RunHooks& hooks, bool live);

  /// At the end of the run.
  const std::string& text() const { return text_; }

 private:
  void look(double t_s, const Filter& filter);

  plan::Forecaster forecaster_;
  const std::vector<CalibrationTrack>* calibration_ = nullptr;  ///< of the run that goes on
  bool live_ = false;
  double next_s_ = 0.;
  std::string said_;  ///< parameter and piece
  std::string text_ = "there was no epoch";
};

}  // namespace viwo::app

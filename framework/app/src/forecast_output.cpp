#include "forecast_output.hpp"

#include <iostream>
#include <limits>

#include "viwo/math/significant.hpp"
#include "viwo/run/calibration_track.hpp"
#include "viwo/setup/calibration_values.hpp"

namespace viwo::app {
namespace {

constexpr double kEvery_s = 10.;

}  // namespace

ForecastOutput::ForecastOutput(const std::filesystem::path& plan, const RunSetup& setup,
                               PluginRegistry& plugins)
    : forecaster_(plan::read_plan_setup(plan, {}, plugins)) {
  if (!setup.filter || !setup.model) {
    throw InputError("--plan needs a run of the filter with wheels (a section 'updates')");
  }
  for (const IntrinsicSpec& spec : setup.model->description().intrinsics) {
    forecaster_.require(spec.name);
  }
}

void ForecastOutput::watch(RunHooks& hooks, bool live) {
  live_ = live;
  hooks.on_epoch = [this, then = hooks.on_epoch](const RunResult& result) {
    if (then) then(result);
    calibration_ = &result.calibration;
  };
  hooks.on_estimate = [this](double t_s, const Filter& filter) {
    if (t_s < next_s_) return;
    next_s_ = t_s + kEvery_s;
    try {
      look(t_s, filter);
    } catch (const InputError& nothing_to_forecast) {
      text_ = nothing_to_forecast.what();
      next_s_ = std::numeric_limits<double>::infinity();
    }
  };
}

void ForecastOutput::look(double t_s, const Filter& filter) {
  CalibrationFile file = calibration_file_of(filter);
  widen(file, *calibration_);  // one that is surer than it ought to be would call too little enough
  std::vector<std::string> names;
  std::vector<double> sigmas;
  for (const CalibrationEntry& entry : file.intrinsics) {
    if (entry.name.find('.') != std::string::npos) continue;  // of a further wheel set
    if (!(entry.sigma > 0.)) continue;
    names.push_back(entry.name);
    sigmas.push_back(entry.sigma);
  }
  if (names.empty()) throw InputError("the run estimates no intrinsics of wheels");
  const Eigen::Map<const Eigen::VectorXd> sigma(sigmas.data(),
                                                static_cast<Eigen::Index>(sigmas.size()));
  const plan::Forecast forecast = forecaster_.of(
      names, sigma.asDiagonal() * file.correlations.among(names) * sigma.asDiagonal());
  text_ = text_of(forecast);
  const std::string what = forecast.is_enough() ? "enough" : forecast.parameter + forecast.piece;
  if (live_ && what != said_) {
    std::cerr << "at " << significant(t_s, 6) << " s: " << text_ << std::endl;
  }
  said_ = what;
}

}  // namespace viwo::app

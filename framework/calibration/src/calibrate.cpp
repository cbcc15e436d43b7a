#include "viwo/calibration/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "by_smoother.hpp"
#include "joint_search.hpp"
#include "judgement.hpp"
#include "segment_choice.hpp"
#include "viwo/run/parallel_for.hpp"
#include "wheel_wander.hpp"

namespace viwo::calibration {

std::vector<std::size_t> all_of(const CalibrationSetup& setup) {
  std::vector<std::size_t> all(setup.recordings.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

FitStart start_of(const CalibrationSetup& setup, const JointSearch& search) {
  constexpr double kFoundZero_rad = 0.1;
  const WheelModel& model = *setup.recordings.front().setup.model;
  FitStart start{model.nominal(), model.nominal()};
  for (int i = 0; i < start.sigma.size(); ++i) {
    start.sigma[i] = model.description().intrinsics[static_cast<std::size_t>(i)].prior_sigma;
  }
  for (const int zero : search.zeros) {
    start.x_WI[zero] = search.x_WI[zero];
    start.sigma[zero] = kFoundZero_rad;
  }
  return start;
}

RunResult dead_reckon(const CalibrationRecording& recording, const CalibrationEstimate& estimate) {
  RunSetup calibrated = recording.setup;
  calibrated.x_WI = estimate.x_WI;
  calibrated.sigma = estimate.sigma;
  calibrated.extrinsics = estimate.extrinsics;
  return run_odometry(calibrated, recording.data);
}

namespace {

ValidationRun validate(const CalibrationSetup& setup, std::size_t index,
                       const CalibrationEstimate& estimate) {
  const CalibrationRecording& recording = setup.recordings[index];
  RunSetup nominal = recording.setup;
  nominal.x_WI = nominal.model->nominal();
  nominal.extrinsics = setup.options.extrinsics_x_m_y_m_yaw_rad;
  return {index, run_odometry(nominal, recording.data), dead_reckon(recording, estimate)};
}

/// A fit without the recordings that have one value of a label; with an empty label of all.
struct FitOf {
  std::string label, value;
  CalibrationEstimate estimate = {};
  std::string failed = {};  ///< why there is no estimate

  bool leaves_out(const CalibrationRecording& recording) const {
    return !label.empty() && recording.label.labels.at(label) == value;
  }
};

/// That of all, then those of each label.
std::vector<FitOf> fits_of(const CalibrationSetup& setup) {
  std::vector<FitOf> fits(1);
  for (const std::string& label : setup.leave_out_by) {
    std::set<std::string> values;
    for (const auto& recording : setup.recordings) {
      values.insert(recording.label.labels.at(label));
    }
    if (values.size() < 2) {
      throw InputError("all recordings have the same '" + label +
                       "': nothing is left to fit when it is left out");
    }
    for (const std::string& value : values) fits.push_back({label, value});
  }
  return fits;
}

/// What is to be found before a fit; drives that turn backwards are put right in the recordings.
JointSearch find_joints(CalibrationSetup& setup, WorkProgress& progress) {
  if (!setup.options.find_steering_zeros && !setup.options.find_drive_signs) return {};
  progress.begin("search", 1);
  JointSearch search = search_joints(setup, all_of(setup));
  progress.done("joints of the wheels");
  reverse_drives(setup, search.drive_signs);
  return search;
}

/// Makes one of them. What nobody has asked for may have no solution.
void make_fit(FitOf& one, const CalibrationSetup& setup, const CalibrationOptions& options,
              const FitStart& start, CalibrationResult& result, WorkProgress& progress) {
  std::vector<std::size_t> used;
  for (std::size_t i = 0; i < setup.recordings.size(); ++i) {
    if (!one.leaves_out(setup.recordings[i])) used.push_back(i);
  }
  const bool is_of_all = one.label.empty();
  try {
    if (options.reference != ReferenceKind::kSmoother) {
      one.estimate = fit(setup, used, options, start);
      return;
    }
    smoother::Smoothed smoothed = smooth(setup, used, is_of_all ? progress : no_progress());
    one.estimate = estimate_of(smoothed, setup);
    if (is_of_all) result.smoothed = std::move(smoothed);
  } catch (const NoSolution& error) {
    if (is_of_all || setup.leave_out_is_asked) throw;
    one.failed = error.what();
  }
}

std::string text_of(const FitOf& one) {
  const std::string what =
      one.label.empty() ? "all recordings" : "without " + one.label + " " + one.value;
  return what + ": " +
         (one.failed.empty() ? std::to_string(one.estimate.iterations) + " iterations"
                             : "not to be fitted");
}

/// The jackknife over the values of a label (CAL-8).
Intrinsics spread_of(const std::string& label, const std::vector<FitOf>& fits) {
  std::vector<const Intrinsics*> without;
  for (const FitOf& one : fits) {
    if (one.label == label && one.failed.empty()) without.push_back(&one.estimate.x_WI);
  }
  const auto n = static_cast<double>(without.size());
  Intrinsics mean = Intrinsics::Zero(fits.front().estimate.x_WI.size()), squares = mean;
  for (const Intrinsics* x : without) mean += *x / n;
  for (const Intrinsics* x : without) squares += (*x - mean).cwiseAbs2();
  return without.empty() ? mean : Intrinsics(((n - 1.) / n * squares).cwiseSqrt());
}

/// What fits without the values of a label say of that of all, `fitted` to all recordings.
LeftOut leave_out(const std::string& label, const CalibrationSetup& setup,
                  const std::vector<FitOf>& fits, const std::vector<ValidationRun>& fitted) {
  LeftOut out{label, spread_of(label, fits), {}, {}};
  for (const FitOf& one : fits) {
    if (one.label == label && !one.failed.empty()) {
      out.failed.push_back(one.value + ": " + one.failed);
    }
  }
  for (std::size_t i = 0; i < setup.recordings.size(); ++i) {
    for (const FitOf& one : fits) {
      const bool is_it = one.label == label && one.failed.empty();
      if (!is_it || !one.leaves_out(setup.recordings[i])) continue;
      out.runs.push_back({i, fitted[i].nominal, dead_reckon(setup.recordings[i], one.estimate)});
    }
  }
  return out;
}

}  // namespace

void TurnAgreement::add(double wheels_rad, double reference_rad) {
  ++segments;
  wheels_rad2 += wheels_rad * wheels_rad;
  reference_rad2 += reference_rad * reference_rad;
  product_rad2 += wheels_rad * reference_rad;
}

double TurnAgreement::correlation() const {
  const double size = std::sqrt(wheels_rad2 * reference_rad2);
  return size > 0. ? product_rad2 / size : 0.;
}

double TurnAgreement::sigmas() const {
  // By chance atanh of the correlation of n segments is normal, of sigma 1/sqrt(n - 3).
  const double size = std::min(std::abs(correlation()), 1. - 1e-12);
  return std::atanh(size) * std::sqrt(std::max(0., static_cast<double>(segments - 3)));
}

double TurnAgreement::ratio() const {
  return wheels_rad2 > 0. ? std::sqrt(reference_rad2 / wheels_rad2) : 0.;
}

CalibrationResult calibrate(CalibrationSetup& setup, WorkProgress& progress) {
  std::vector<FitOf> fits = fits_of(setup);
  CalibrationResult result;
  result.search = find_joints(setup, progress);
  const FitStart start = start_of(setup, result.search);
  const CalibrationOptions options = setup.options.reference == ReferenceKind::kSmoother
                                         ? setup.options
                                         : choose_segments(setup, start, result, progress);
  progress.begin("fits", static_cast<int>(fits.size()));
  parallel_for(fits.size(), [&](std::size_t f) {
    make_fit(fits[f], setup, options, start, result, progress);
    progress.done(text_of(fits[f]));
  });
  result.setup = &setup;
  result.all = fits.front().estimate;
  result.wander = find_wander(setup, result.all.x_WI);
  result.sigma_of_fit = result.all.sigma;
  for (std::size_t i = 0; i < setup.recordings.size(); ++i) {
    result.fitted.push_back(validate(setup, i, result.all));
  }
  for (const std::string& label : setup.leave_out_by) {
    result.left_out.push_back(leave_out(label, setup, fits, result.fitted));
    if (!setup.leave_out_is_asked) continue;
    // What is held has no sigma, whatever is left out.
    result.all.sigma = (result.all.sigma.array() > 0.)
                           .select(result.all.sigma.cwiseMax(result.left_out.back().spread), 0.);
  }
  judge(result);
  return result;
}

}  // namespace viwo::calibration

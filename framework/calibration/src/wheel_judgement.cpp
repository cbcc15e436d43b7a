// What the wheels of a calibration say of themselves.
#include <algorithm>
#include <cmath>

#include "judgement.hpp"
#include "recording_name.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/wheel/contradicted_channels.hpp"
#include "viwo/wheel/drive_ranges.hpp"
#include "viwo/wheel/twist_solver.hpp"

namespace viwo::calibration {
namespace {

/// Sigmas of the model that the wheels may contradict each other by.
constexpr double kQuiet = 3.;
/// What the worst bases have of them is two thirds of that; a drive that is off by 2 % has twice
/// it.
constexpr double kNoNoise = 100.;
/// Encoders that are read by themselves are never so much better than the model says.
constexpr double kCopies = 0.05;

/// How much of their motion the wheels contradict each other by, at the estimate.
double contradiction(const CalibrationResult& result) {
  double left = 0., moved = 0.;
  TwistSolution solution;
  for (const CalibrationRecording& recording : result.setup->recordings) {
    TwistSolver solver(recording.setup.model, {});
    solver.set_intrinsics(result.all.x_WI);
    for (const EncoderSample& sample : recording.data.wheels()) {
      if (solver.solve(sample, solution) != Status::kOk) continue;
      // As if a metre from O: of a spin it is too much, so that no doubt is raised without reason.
      moved += solution.xi.squaredNorm();
      left += solution.e.squaredNorm() /
              static_cast<double>(std::max<Eigen::Index>(1, solution.e.size()));
    }
  }
  return moved > 0. ? std::sqrt(left / moved) : 0.;
}

/// Wheels that could contradict each other, and do by `part` of their speed: not at all.
bool are_setpoints(const CalibrationResult& result, double part) {
  const auto is_one = [](const CalibrationRecording& recording) {
    const ModelDescription& model = recording.setup.model->description();
    return model.n_rows > 3 && !has_copies(recording.data.wheels(), model.n_drive);
  };
  const auto& recordings = result.setup->recordings;
  return std::all_of(recordings.begin(), recordings.end(), is_one) && part < kExactly;
}

/// A drive that gives one number all the time while another turns.
void judge_channels(CalibrationResult& result) {
  constexpr double kTurns_rad_per_s = 0.1;
  const auto& recordings = result.setup->recordings;
  DriveRanges ranges(recordings.front().setup.model->description().n_drive);
  for (const CalibrationRecording& recording : recordings) {
    for (const EncoderSample& sample : recording.data.wheels()) ranges.add(sample);
  }
  if (!(ranges.largest_change() > kTurns_rad_per_s)) return;
  for (const auto& [drive, value] : ranges.stuck()) {
    result.doubts.push_back("drive_" + std::to_string(drive + 1) + " reads " +
                            significant(value, 3) +
                            " rad/s all the time, while another turns: not connected, or not read");
  }
}

/// Covariance of the intrinsics at the estimate.
IntrinsicMatrix covariance_of(const CalibrationEstimate& estimate) {
  const auto sigma = estimate.sigma.asDiagonal();
  return sigma * estimate.correlations * sigma;
}

/// A channel that the others contradict is in the fit all the same.
void judge_contradicted(CalibrationResult& result) {
  constexpr double kMost = 0.02;
  const IntrinsicMatrix P = covariance_of(result.all);
  for (const CalibrationRecording& recording : result.setup->recordings) {
    const auto& wheels = recording.data.wheels();
    for (const ContradictedChannel& channel :
         contradicted_channels(wheels, recording.setup.model, result.all.x_WI, P)) {
      auto& lines = channel.share > kMost ? result.doubts : result.warnings;
      lines.push_back(name_of(recording.label) + ": " + text_of(channel, wheels.front().begin_ns));
    }
  }
}

/// What they contradict each other by.
void judge_parity(CalibrationResult& result) {
  constexpr double kPart = 0.3;
  const double part = contradiction(result);
  if (part > kPart) {
    result.doubts.push_back(
        "calibrated, the wheels still contradict each other by " + significant(100. * part, 2) +
        " % of their speed: drives or steerings that are exchanged or reversed, units, gears, or "
        "wheels that are elsewhere");
    return;
  }
  if (are_setpoints(result, part)) {
    result.doubts.push_back(std::string("the wheels agree ") + kSetpoints);
    return;
  }
  const double scale = result.all.noise.parity_scale;
  const std::string by = significant(scale, 2) + " times what the model's sigmas say";
  if (scale > kNoNoise) {
    result.doubts.push_back("calibrated, the wheels still contradict each other by " + by +
                            ", and no noise is like that: a gear, radius or unit of one of them, "
                            "zeros of the steering, or a prior that is too narrow for what is "
                            "wrong");
  } else if (scale > kQuiet) {
    result.warnings.push_back("the wheels contradict each other by " + by +
                              ": slip, play, or sigmas that are too small for this base");
  } else if (scale < kCopies) {
    result.warnings.push_back("the wheels contradict each other by no more than " + by +
                              ": channels that are copies of each other tell nothing of their "
                              "noise (leave wheel_noise_scale of a plan at 1)");
  }
}

}  // namespace

void judge_wheels(CalibrationResult& result) {
  judge_channels(result);
  judge_contradicted(result);
  judge_parity(result);
}

}  // namespace viwo::calibration

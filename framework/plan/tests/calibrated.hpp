// What a calibration makes of a drive that is simulated with noise.
#pragma once

#include <string>

#include "plan_files.hpp"
#include "viwo/calibration/calibrate.hpp"
#include "viwo/wheel/held_gauge.hpp"

namespace viwo::testing {

/// The drive in `motion_file` by a robot that is not as nominal, with IMU, ready to be fitted.
inline calibration::CalibrationSetup driven(const std::filesystem::path& motion_file,
                                            std::uint64_t seed, double duration_s) {
  return calibration::read_calibration_setup(
      configuration("plans/swerve_calibration.yaml"),
      {"placeholders.plan=" + motion_file.string(), "seed=" + std::to_string(seed),
       "sensors.simulator0.duration_s=" + std::to_string(duration_s)},
      registry());
}

inline calibration::CalibrationEstimate calibrated(calibration::CalibrationSetup& setup) {
  return calibrate(setup).all;
}

/// Errors of what has a goal, in units of the goals.
inline Eigen::VectorXd errors_in_goals(const plan::PlanSetup& setup,
                                       const calibration::CalibrationSetup& drive,
                                       const calibration::CalibrationEstimate& estimate) {
  const WheelModel& model = *setup.model;
  WheelsView truth;
  truth.x_WI = model.nominal();
  for (int i = 0; i < model.n_intrinsics(); ++i) {
    const std::string& name = model.description().intrinsics[static_cast<std::size_t>(i)].name;
    truth.x_WI[i] = drive.recordings[0].data.calibration.at(name);
  }
  move_to_held_gauge(model, model.nominal(), truth);  // bases without a gauge stay as they are
  Eigen::VectorXd out(static_cast<Eigen::Index>(setup.goals.size()));
  for (std::size_t i = 0; i < setup.goals.size(); ++i) {
    const plan::Goal& goal = setup.goals[i];
    const double off = estimate.x_WI[goal.intrinsic] - truth.x_WI[goal.intrinsic];
    out[static_cast<Eigen::Index>(i)] = off / goal.sigma;
  }
  return out;
}

}  // namespace viwo::testing

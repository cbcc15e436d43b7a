// What is made of a table of wheels: dead reckoning, and a calibration by what was measured by hand
// (tests/fuzz/files/wheels.yaml, calibrate_wheels.yaml).
#include "target.hpp"
#include "viwo/api/status.hpp"
#include "viwo/calibration/calibrate.hpp"
#include "viwo/run/run.hpp"
#include "viwo/setup/run_setup.hpp"

namespace viwo::fuzz {
namespace {

void give(Bytes bytes) { write("wheels_alone/data.csv", bytes); }

void odometry(Bytes bytes) {
  give(bytes);
  RunSetup setup = read_run(configuration("wheels.yaml"), registry());
  require_well(run_odometry(setup, collect(setup)));
}

void calibrate_wheels(Bytes bytes) {
  give(bytes);
  auto setup =
      calibration::read_calibration_setup(folder() / "calibrate_wheels.yaml", {}, registry());
  try {
    const calibration::CalibrationResult result = calibration::calibrate(setup);
    require(!result.is_trusted() || (result.all.x_WI.allFinite() && result.all.sigma.allFinite()),
            "a calibration that is not finite, and is trusted");
  } catch (const calibration::NoSolution& none) {
    throw InputError(none.what());
  }
}

}  // namespace

std::vector<Target> wheel_targets() {
  constexpr const char* kWheels =
      "framework/wheel/src framework/plausibility/src plugins/kinematics/differential";
  return {
      {"odometry", odometry, std::string(kWheels) + " framework/run/src/run.cpp"},
      {"calibrate_wheels", calibrate_wheels, std::string(kWheels) + " framework/calibration/src"}};
}

}  // namespace viwo::fuzz

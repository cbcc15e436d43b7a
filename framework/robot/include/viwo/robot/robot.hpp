// A small simulated robot with a filter, in which updates run side by side.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "viwo/api/measurement.hpp"
#include "viwo/api/update.hpp"

namespace viwo::robot {

/// What a robot with IMU, a camera, four driven wheels, a pose reference and a satellite receiver
/// measures: samples of all kinds of viwo's.
struct Drive {
  StateSample start;
  std::vector<Measurement> measurements;  ///< in time order
};

/// A motion of sim::PlanarMotion. Without `noise` the measurements are those of the motion itself.
Drive simulate_drive(const char* motion, double duration_s, bool noise = true);

/// Whether the calibration of camera and wheels is estimated, or held: then their blocks have no
/// columns.
enum class Calibration { kEstimated, kHeld };

/// Camera and wheels of the robot.
std::shared_ptr<Rig> robot_rig(Calibration calibration);

/// The other update of the robot's filter: it declares the calibration of camera and wheels, ends
/// epochs with images, and has a block in a room of its own, so that ids do not begin with that of
/// the plugin.
std::shared_ptr<Update> make_neighbour();
inline constexpr const char* kNeighbour = "neighbour";

/// What an author wants to know whose update needs something else.
inline constexpr const char* kRobot =
    "the robot of these checks has an IMU, one camera, four driven wheels, a pose reference and a "
    "satellite receiver";

/// Runs updates side by side, epoch by epoch, each in a filter of its own over the same drive,
/// where it is called `name`. Throws what they throw at their start, and runtime_error when a
/// filter diverges.
void run_updates(std::span<const std::shared_ptr<Update>> updates, const std::string& name,
                 const Drive& drive, Calibration calibration);

}  // namespace viwo::robot

// The checks of wheels, by themselves and beside a gyro: as those of viwo/checks/checks.hpp.
#pragma once

#include "viwo/checks/finding.hpp"
#include "viwo/series/recording.hpp"

namespace viwo::inspect {

/// Drives and steerings that never change.
void check_still_channels(const series::Recording& recording, Findings& out);
/// Wheels that the others contradict, noises against the configuration.
void check_wheels(const series::Recording& recording, Findings& out);
/// Angles of drives that begin anew after a turn, rates that no wheel has, zeros in their place.
void check_turns(const series::Recording& recording, Findings& out);
/// Signs, gears and order of the channels: by what the wheels contradict each other, and by the
/// gyro's rate.
void check_order(const series::Recording& recording, Findings& out);
/// Times in which the wheels turn otherwise than the gyro, and else as it does.
void check_slip(const series::Recording& recording, Findings& out);
/// Constant offsets of steering angles that stop the wheels from contradicting each other.
void check_steer_offsets(const series::Recording& recording, Findings& out);
/// Steering angles that are of another time than the drives.
void check_steer_lag(const series::Recording& recording, Findings& out);

}  // namespace viwo::inspect

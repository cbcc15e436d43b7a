// From what encoders print to samples that stand for an interval of time (see EncoderSample).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "viwo/api/measurement.hpp"

namespace viwo::log {

/// One reading of encoders: as it stands in a log, or what JointMap makes of it.
struct EncoderReading {
  std::int64_t t_ns = 0;
  int n_drive = 0;
  int n_steer = 0;
  /// Rotation rates [rad/s] or multi-turn angles [rad], as the log has it.
  std::array<double, kMaxDrives> drive{};
  std::array<double, kMaxSteers> steer_rad{};
  bool is_start = false;  ///< what was before does not count on: no difference reaches over to it
};

/// Sets begin and end of samples that hold rates at their stamps, in time order: the mid-points
/// between stamps; the first cell begins and the last one ends at its own stamp. A spacing longer
/// than `max_gap_s` leaves a hole: the cells at its sides reach into it by half of the median
/// spacing, or to its middle if that is nearer.
void make_cells(std::vector<EncoderSample>& rates, double max_gap_s);

/// Samples from multi-turn drive angles at increasing stamps: the cell reaches from one stamp to
/// the next, the drive rate is the difference of the angles by its length, which is exact in the
/// mean, and the steering angle is the mean of both ends (the shorter way round).
///
/// With `stride` n >= 1 every n-th reading is used: longer cells, less noise from the resolution of
/// the angles. No cell reaches over a spacing longer than `max_gap_s`, or to a reading that starts
/// anew; counting starts again there, and readings before it that do not fill a cell are dropped,
/// as at the end.
std::vector<EncoderSample> cells_from_angles(std::span<const EncoderReading> angles,
                                             double max_gap_s, int stride = 1);

/// Samples from readings at increasing stamps: cells_from_angles(), or make_cells() of rates. Of
/// who writes what changes only, the readings that were not written while the wheels stood are put
/// in: in gaps longer than `max_gap_s` that begin with rates of zero and end with slow ones, or in
/// which no angle changes by more than half a radian. At the median spacing, at most 20 000 in a
/// gap.
std::vector<EncoderSample> samples_from(std::span<const EncoderReading> written,
                                        bool drive_is_angle, double max_gap_s, int stride);

/// Behind "too few readings for a rate": ": they are 0.8 s apart, and max_gap_s is 0.2", if they
/// are.
std::string spacing_text(std::span<const EncoderReading> readings, double max_gap_s);

}  // namespace viwo::log

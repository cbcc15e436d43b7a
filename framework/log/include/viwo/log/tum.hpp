// Trajectories in the TUM format: lines "t x y z qx qy qz qw", seconds and metres, Hamilton
// quaternion of the body in the world; comments begin with '#'.
#pragma once

#include <filesystem>

#include "viwo/files/text_writer.hpp"
#include "viwo/math/trajectory.hpp"

namespace viwo::log {

/// Reads a plain or gzipped file. Stamps are exact to the nanosecond. InputError "file:line  what"
/// for a wrong number of fields, what is not a number or not finite, a stamp that is not after the
/// previous one, a quaternion that is not of unit norm (to 1e-3; it is normalised), no pose at all.
Trajectory read_tum(const std::filesystem::path& file);

/// Writes a trajectory pose by pose. std::runtime_error when that fails.
class TumWriter {
 public:
  explicit TumWriter(const std::filesystem::path& file,
                     files::Appears appears = files::Appears::kWhole);
  /// Seconds with nine decimals and shortest numbers that read back to the same bits.
  void add(const StampedPose& pose);
  /// What was added is in the file.
  void flush() { out_.flush(); }
  /// To be called at the end.
  void close() { out_.close(); }

 private:
  files::TextWriter out_;
};

/// All of it.
void write_tum(const std::filesystem::path& file, const Trajectory& trajectory);

}  // namespace viwo::log

// The results of a run that may end at any time, on disk as they come.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "viwo/files/text_writer.hpp"
#include "viwo/log/tum.hpp"
#include "viwo/run/run.hpp"

namespace viwo {

/// Rows of calibration.csv and timing.csv.
void write_calibration_head(files::TextWriter& out);
/// The k-th epoch of the result.
void write_calibration_rows(files::TextWriter& out, const RunResult& result, std::size_t k);
void write_timing_head(files::TextWriter& out);
void write_timing_row(files::TextWriter& out, const RunResult& result, std::size_t k);

/// The trajectory of piece `k` (0, ...) of a run that has several, beside trajectory.tum.
std::filesystem::path piece_file(const std::filesystem::path& folder, std::size_t k);
bool is_piece_file(const std::filesystem::path& file);
/// Those of a former run.
void remove_piece_files(const std::filesystem::path& folder);

/// Writes trajectory.tum, calibration.csv and timing.csv of a live run epoch by epoch: what has
/// been written stays when the process is killed. Once there are several pieces each has a
/// trajectory of its own, too, and trajectory.tum leaves out what is not later than the pose before
/// (a clock that was set back).
class RunStream {
 public:
  /// Into `folder`, which must exist. std::runtime_error when that cannot be written to.
  explicit RunStream(const std::filesystem::path& folder);

  /// The newest epoch of `result`. A disk that is full does not end the run: see failure().
  void epoch(const RunResult& result);
  /// What could not be written up to now; "" for nothing.
  const std::string& failure() const { return failure_; }
  /// Ends the files. What could not be written; "" for nothing.
  std::string finish();

 private:
  void write(const RunResult& result);

  std::filesystem::path folder_;
  log::TumWriter trajectory_;
  files::TextWriter calibration_, timing_;
  std::optional<log::TumWriter> piece_;  ///< the present one, if it is not the first
  std::size_t pieces_ = 1;
  std::optional<std::int64_t> last_ns_;
  std::string failure_;
};

}  // namespace viwo

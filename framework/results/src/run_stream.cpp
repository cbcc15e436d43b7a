#include "viwo/results/run_stream.hpp"

#include <cmath>
#include <exception>
#include <string>
#include <string_view>

namespace viwo {

void write_calibration_head(files::TextWriter& out) { out << "time_s,name,estimate,sigma,truth\n"; }

void write_calibration_rows(files::TextWriter& out, const RunResult& result, std::size_t k) {
  for (const CalibrationTrack& track : result.calibration) {
    out << result.epoch_t_s[k] << "," << track.name << "," << track.estimate[k] << ","
        << track.sigma[k] << ",";
    if (std::isfinite(track.truth)) out << track.truth;
    out << "\n";
  }
}

void write_timing_head(files::TextWriter& out) { out << "time_s,epoch_ms\n"; }

void write_timing_row(files::TextWriter& out, const RunResult& result, std::size_t k) {
  out << result.epoch_ms[k].first << "," << result.epoch_ms[k].second << "\n";
}

std::filesystem::path piece_file(const std::filesystem::path& folder, std::size_t k) {
  return folder / ("trajectory_" + std::to_string(k + 1) + ".tum");
}

bool is_piece_file(const std::filesystem::path& file) {
  constexpr std::string_view kBegin = "trajectory_";
  const std::string name = file.stem().string();
  return file.extension() == ".tum" && name.starts_with(kBegin) && name.size() > kBegin.size() &&
         name.find_first_not_of("0123456789", kBegin.size()) == std::string::npos;
}

void remove_piece_files(const std::filesystem::path& folder) {
  for (std::size_t k = 0; std::filesystem::remove(piece_file(folder, k)); ++k) {
  }
}

RunStream::RunStream(const std::filesystem::path& folder)
    : folder_(folder),
      trajectory_(folder / "trajectory.tum", files::Appears::kAtOnce),
      calibration_(folder / "calibration.csv", files::Appears::kAtOnce),
      timing_(folder / "timing.csv", files::Appears::kAtOnce) {
  remove_piece_files(folder);
  write_calibration_head(calibration_);
  write_timing_head(timing_);
}

void RunStream::epoch(const RunResult& result) {
  if (!failure_.empty()) return;
  try {
    write(result);
  } catch (const std::exception& error) {
    failure_ = error.what();
  }
}

void RunStream::write(const RunResult& result) {
  if (result.pieces.size() > pieces_) {
    // Up to now that was the first one.
    if (pieces_ == 1) {
      std::filesystem::copy_file(folder_ / "trajectory.tum", piece_file(folder_, 0),
                                 std::filesystem::copy_options::overwrite_existing);
    }
    if (piece_) piece_->close();
    pieces_ = result.pieces.size();
    piece_.emplace(piece_file(folder_, pieces_ - 1), files::Appears::kAtOnce);
  }
  const StampedPose& pose = result.estimate.back();
  if (!last_ns_ || pose.t_ns > *last_ns_) {
    trajectory_.add(pose);
    last_ns_ = pose.t_ns;
  }
  trajectory_.flush();
  if (piece_) {
    piece_->add(pose);
    piece_->flush();
  }
  const std::size_t newest = result.epoch_t_s.size() - 1;
  write_calibration_rows(calibration_, result, newest);
  calibration_.flush();
  write_timing_row(timing_, result, newest);
  timing_.flush();
}

std::string RunStream::finish() {
  if (!failure_.empty()) return failure_;
  try {
    trajectory_.close();
    if (piece_) piece_->close();
    calibration_.close();
    timing_.close();
  } catch (const std::exception& error) {
    failure_ = error.what();
  }
  return failure_;
}

}  // namespace viwo

// Collects what a run of the filter reports while it goes on.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "calibration_scatter.hpp"
#include "viwo/feed/stage_time.hpp"
#include "viwo/run/run.hpp"

namespace viwo {

class Recorder {
 public:
  /// Series of a live run are thinned while it goes on, so that it can go on for ever; their newest
  /// point is always that of the newest epoch.
  Recorder(const RunSetup& setup, const RunData& data, const Filter& filter, RunResult& result);

  /// An epoch is done.
  void record(const Estimator& estimator);
  /// The estimator is not going to be asked any more; `failure` says why, if it had to be given up.
  void end_piece(const Estimator& estimator, const std::string& failure);
  /// All pieces have ended.
  void finish(const Estimator& estimator);

 private:
  void bound_series();
  void add_piece(std::int64_t t_ns);
  void add_error(const Filter& filter, double t_s);
  void add_end_sigma(const Filter& filter);
  void add_relative_error(const Filter& filter, const StampedPose& truth);
  void add_counts(const Estimator& estimator);
  void add_calibration(const Filter& filter);

  const FilterSetup& setup_;
  std::map<std::string, double> calibration_;  ///< true values
  RunResult& result_;
  bool is_live_;
  Trajectory truth_;
  std::int64_t begin_ns_ = 0;
  std::int64_t last_ns_ = 0;
  CalibrationScatter scatter_;
  std::optional<double> start_m2_;  ///< variance of the position, of this piece
  std::vector<TimeStatistics> stage_ms_;
  TimeStatistics total_ms_;
  double sum_pose_ = 0., sum_position_ = 0., sum_orientation_ = 0.;
  int n_nees_ = 0;
  double sum_relative_ = 0.;
  int n_relative_ = 0;
  std::int64_t stride_ = 1;  ///< every so many-th epoch stays in the series of a live run
  bool in_piece_ = false;
  // Of the pieces that have ended.
  std::vector<UpdateTrack> ended_;
  Rejections rejections_;
  std::int64_t loosened_ = 0;
  std::int64_t first_loosened_ns_ = 0;
};

}  // namespace viwo

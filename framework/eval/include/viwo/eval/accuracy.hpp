// Accuracy of an estimated trajectory against a reference: absolute (ATE), relative over segments
// of path (RPE), and the error at the end.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "viwo/eval/alignment.hpp"
#include "viwo/math/trajectory.hpp"

namespace viwo::eval {

struct Options {
  Alignment alignment = Alignment::kYawPosition;  ///< for ATE; the RPE needs none
  std::vector<double> segment_lengths_m;          ///< none: two that the path has several of
  int segment_stride = 1;            ///< a segment starts at every pose, every second, ...
  double max_reference_gap_s = 0.5;  ///< no interpolation between reference poses further apart
};

/// Relative pose error over all segments of one length; NaN when the path has none.
struct SegmentErrors {
  double length_m = 0.;
  std::int64_t count = 0;
  double mean_m = 0.;
  double rmse_m = 0.;
  double mean_deg = 0.;
  double rmse_deg = 0.;
};

/// One entry per common pose; the worlds are those of the end error.
struct ErrorSeries {
  std::vector<double> t_s;            ///< since the first common pose
  std::vector<double> path_length_m;  ///< of the reference
  std::vector<double> position_error_m;
  std::vector<double> yaw_error_deg;  ///< estimate minus reference, continued over +-180
};

struct Accuracy {
  Alignment alignment = Alignment::kYawPosition;
  std::int64_t n_poses = 0;    ///< common poses, all numbers are over these
  std::int64_t n_outside = 0;  ///< poses of the estimate outside of the reference's time
  std::int64_t n_in_gap = 0;   ///< poses of the estimate in gaps of the reference
  double duration_s = 0.;
  double path_length_m = 0.;  ///< of the reference, along its poses at the stamps of the estimate
  double ate_m = 0.;          ///< root mean square position error
  double ate_deg = 0.;        ///< root mean square angle of the orientation error
  std::vector<SegmentErrors> rpe;  ///< in the order of Options::segment_lengths_m
  /// Of the last pose, where the first poses coincide as far as `alignment` leaves the two worlds
  /// open: in position and yaw where both know gravity, not at all where the worlds are the same.
  double end_m = 0.;
  double end_deg = 0.;      ///< angle of the whole orientation error, 0 .. 180
  double end_yaw_deg = 0.;  ///< signed, estimate minus reference, continued over +-180
  ErrorSeries series;
};

/// Compares `estimate` with `reference`; both are poses of the same body, each in its own world.
///
/// A segment of length L starts at a pose of the estimate and ends at the first pose where the
/// reference has come at least L further; its error is the difference of the two poses as seen from
/// the start of the segment. Without lengths they are the two longest of 1, 2.5 and 5 times powers
/// of ten (m) that the path of the reference has at least three of. Throws InputError for
/// trajectories that cannot be compared (association.hpp, alignment.hpp) and for options out of
/// range.
/// A reference that has the same orientation all the time while the estimate turns by half a radian
/// and more, and that agrees with its positions (to 5 % of their extent), has positions alone: they
/// are compared as the estimate's orientations have them, aligned by yaw and position where `start`
/// is asked for, and errors of the orientation are NaN.
Accuracy evaluate(const Trajectory& reference, const Trajectory& estimate,
                  const Options& options = {});

/// The estimate in the world of the reference, as the ate has it; as it is where the two have no
/// time in common.
Trajectory aligned(const Trajectory& reference, Trajectory estimate, Alignment alignment);

/// What results call a segment length: "10", "2.5", the shortest text that reads back to it.
std::string length_text(double length_m);

/// The "accuracy" entry of summary.json; numbers that do not exist are null. Without the series.
nlohmann::json to_json(const Accuracy& accuracy);

}  // namespace viwo::eval

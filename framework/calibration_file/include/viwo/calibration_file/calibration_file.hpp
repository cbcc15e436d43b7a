// calibration.yaml: what `viwo calibrate` and runs of the filter leave, and a run starts from.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "viwo/api/rig.hpp"
#include "viwo/config/errors.hpp"
#include "viwo/filter/state_blocks.hpp"

namespace viwo {

/// One number of a calibration.
struct CalibrationEntry {
  std::string name;  ///< of docs/conventions.md: "r_1", "theta_ItoO_x", "back.r_1", "cam0.fx"
  double estimate = 0.;
  double sigma = 0.;    ///< 0: it was held
  double nominal = 0.;  ///< where its estimate began
  std::string unit = {};
  config::Mark mark = {}, key_mark = {};  ///< where estimate and name are written
};

/// What of a camera is not estimated.
struct CalibratedCamera {
  CameraDistortion distortion = CameraDistortion::kRadtan;
  int width_px = 0;
  int height_px = 0;
  double line_delay_s = 0.;
  config::Mark mark = {};  ///< where it is written
};

struct CalibrationFile {
  enum class Status { kOk, kDoubtful, kDiverged, kFailed };
  using Entries = std::vector<CalibrationEntry>;

  Status status = Status::kOk;
  std::vector<std::string> reasons;  ///< why it is not ok
  std::string model;                 ///< type of the kinematic model; "": no wheels
  std::string twist;                 ///< odometry.twist that the estimates belong to
  /// Of `drive_scale`, where they were searched: 1 or -1 for each drive. Empty: they were not.
  std::vector<int> drive_signs;
  std::map<std::string, std::string> wheel_sets;  ///< further ones: name, type of the model
  Entries intrinsics;                             ///< of the wheels
  Entries mount;                                  ///< R_ItoO, p_IinO
  Entries clock;                                  ///< t_OtoI
  Entries reference;                              ///< pose of O and the wheels' clock, in B's
  Entries cameras;
  std::vector<CalibratedCamera> camera_models;
  PriorCorrelations correlations;  ///< of entries with a sigma
  std::filesystem::path path = {};
  config::Mark model_mark = {}, intrinsics_mark = {};
};

/// The entry of that name; nullptr if there is none.
const CalibrationEntry* find(const CalibrationFile::Entries& entries, std::string_view name);

/// Throws InputError with all that is wrong in the file, and for one that is not to be used: of a
/// run that has diverged, of a calibration that has failed.
CalibrationFile read_calibration(const std::filesystem::path& file);

/// Its YAML text; `written_by` is for the first line.
std::string calibration_text(const CalibrationFile& calibration, const std::string& written_by);

/// "calibration.yaml is doubtful: reasons"; "" for one that is not.
std::string doubts_of(const CalibrationFile& calibration);

}  // namespace viwo

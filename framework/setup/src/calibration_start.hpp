// What a run starts from: a calibration.yaml, put in the place of what is configured.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "viwo/calibration_file/calibration_file.hpp"
#include "viwo/setup/run_setup.hpp"

namespace viwo {

/// The configuration says what is estimated and what is held; the file says the values and, of what
/// it has a sigma for, how well they are known. What is wrong goes to the Errors.
class CalibrationStart {
 public:
  /// `only_wheels`: what belongs to the wheels without a name.
  CalibrationStart(CalibrationFile file, bool only_wheels)
      : file_(std::move(file)), only_wheels_(only_wheels) {}

  const CalibrationFile& file() const { return file_; }
  /// Whether it has anything of a wheel set; its model must be `model_name`.
  bool has_wheels(const std::string& set, const std::string& model_name) const;
  void take_intrinsics(const std::string& set, const WheelModel& model,
                       const std::string& model_name, Intrinsics& x_WI, Intrinsics& sigma,
                       config::Errors& errors);
  void take_mount_and_clock(WheelsPrior& prior, config::Errors& errors);
  void take_camera(std::size_t index, CameraPrior& prior, config::Errors& errors);
  /// Of what was taken.
  PriorCorrelations correlations() const;
  bool took_anything() const { return !taken_.empty(); }
  /// Whether an entry was taken and the file says how well it is known.
  bool knows(const std::string& entry) const { return known_.contains(entry); }
  bool has_cameras() const { return !only_wheels_ && !file_.camera_models.empty(); }
  bool took_cameras() const { return taken_.contains("cam0.fx"); }

 private:
  bool take(const CalibrationFile::Entries& section, const BlockSpec& block,
            Eigen::Ref<Eigen::VectorXd> value, Eigen::Ref<Eigen::VectorXd> sigma,
            config::Errors& errors);

  CalibrationFile file_;
  bool only_wheels_;
  std::set<std::string> taken_, known_;
};

/// The calibration.yaml that a run configuration names at its top level or in `kinematics`; nothing
/// if it names none. `of_run`: the key of the top level.
std::optional<CalibrationStart> read_calibration_start(const config::Node& run,
                                                       const std::filesystem::path& of_run,
                                                       config::Errors& errors);

/// kinematics.calibration as an absolute path; empty without that key.
std::filesystem::path kinematics_calibration(const config::Node& kinematics);

}  // namespace viwo

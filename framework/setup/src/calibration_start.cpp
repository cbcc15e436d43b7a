#include "calibration_start.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "viwo/config/file_kind.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/log/text.hpp"
#include "viwo/math/number_text.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

using config::Errors;
using config::Node;

std::string prefix_of(const std::string& set) { return set.empty() ? "" : set + "."; }

bool belongs_to(const CalibrationEntry& entry, const std::string& prefix) {
  return prefix.empty() ? entry.name.find('.') == std::string::npos
                        : entry.name.starts_with(prefix);
}

/// A pose as a block lays it out: rotation vector, position.
Eigen::VectorXd pose_of(const Eigen::Matrix3d& R, const Eigen::Vector3d& p) {
  Eigen::VectorXd value(6);
  value << log_so3(R), p;
  return value;
}

}  // namespace

bool CalibrationStart::take(const CalibrationFile::Entries& section, const BlockSpec& block,
                            Eigen::Ref<Eigen::VectorXd> value, Eigen::Ref<Eigen::VectorXd> sigma,
                            Errors& errors) {
  std::vector<std::string> missing;
  const CalibrationEntry* known = nullptr;
  for (std::size_t i = 0; i < block.entries.size(); ++i) {
    const BlockEntry& wanted = block.entries[i];
    const CalibrationEntry* const entry = find(section, wanted.name);
    if (entry == nullptr) {
      missing.push_back(wanted.name);
      continue;
    }
    known = entry;
    if (!entry->unit.empty() && entry->unit != wanted.unit) {
      errors.add(entry->mark,
                 entry->name + ": its unit is '" + entry->unit + "', not '" + wanted.unit + "'");
    }
    const auto k = static_cast<Eigen::Index>(i);
    value[k] = entry->estimate;
    // What was held tells nothing about itself; what is to be held stays held.
    if (sigma[k] > 0. && entry->sigma > 0.) sigma[k] = entry->sigma;
    taken_.insert(entry->name);
    if (entry->sigma > 0.) known_.insert(entry->name);
  }
  if (known == nullptr) return false;
  for (const std::string& name : missing) {
    errors.add(known->mark, "'" + name + "' is missing, which belongs to '" + known->name + "'");
  }
  return missing.empty();
}

bool CalibrationStart::has_wheels(const std::string& set, const std::string& model_name) const {
  if (only_wheels_ && !set.empty()) return false;
  std::string model = file_.model;
  if (!set.empty()) {
    const auto known = file_.wheel_sets.find(set);
    model = known != file_.wheel_sets.end() ? known->second : "";
  }
  if (model.empty() && !only_wheels_) return false;
  if (model == model_name) return true;
  config::fail(file_.model_mark, model.empty()
                                     ? "this calibration has nothing of wheels"
                                     : "this calibration is for the model '" + model + "', " +
                                           (set.empty() ? "the run" : "wheel set '" + set + "'") +
                                           " has '" + model_name + "'");
}

void CalibrationStart::take_intrinsics(const std::string& set, const WheelModel& model,
                                       const std::string& model_name, Intrinsics& x_WI,
                                       Intrinsics& sigma, Errors& errors) {
  const std::string prefix = prefix_of(set);
  std::vector<std::string> names;
  for (const IntrinsicSpec& spec : model.description().intrinsics) {
    names.push_back(prefix + spec.name);
  }
  for (const CalibrationEntry& entry : file_.intrinsics) {
    if (!belongs_to(entry, prefix)) continue;
    if (std::find(names.begin(), names.end(), entry.name) != names.end()) continue;
    errors.add(entry.key_mark, "the model '" + model_name + "' has no intrinsic '" + entry.name +
                                   "'" + config::did_you_mean(entry.name, names));
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    const IntrinsicSpec& spec = model.description().intrinsics[i];
    const CalibrationEntry* const entry = find(file_.intrinsics, names[i]);
    if (entry == nullptr) {
      errors.add(file_.intrinsics_mark, "intrinsic '" + names[i] + "' is missing");
      continue;
    }
    if (!entry->unit.empty() && entry->unit != spec.unit) {
      errors.add(entry->mark,
                 entry->name + ": its unit is '" + entry->unit + "', not '" + spec.unit + "'");
    }
    if (!(entry->estimate >= spec.lowest && entry->estimate <= spec.highest)) {
      errors.add(entry->mark, entry->name + ": " + number_text(entry->estimate) +
                                  " is beyond what the model '" + model_name + "' takes, " +
                                  number_text(spec.lowest) + " to " + number_text(spec.highest) +
                                  " " + spec.unit);
    }
    const auto k = static_cast<Eigen::Index>(i);
    x_WI[k] = entry->estimate;
    if (entry->sigma > 0.) sigma[k] = entry->sigma;
    taken_.insert(entry->name);
    if (entry->sigma > 0.) known_.insert(entry->name);
  }
}

void CalibrationStart::take_mount_and_clock(WheelsPrior& prior, Errors& errors) {
  if (only_wheels_ && !prior.name.empty()) return;
  const auto [mount, clock, intrinsics] = wheels_blocks(prior);
  Eigen::VectorXd pose = pose_of(prior.wheels.R_ItoO, prior.wheels.p_IinO);
  if (take(file_.mount, mount, pose, prior.sigma_extrinsics, errors)) {
    prior.wheels.R_ItoO = exp_so3(Eigen::Vector3d(pose.head<3>()));
    prior.wheels.p_IinO = pose.tail<3>();
  }
  Eigen::VectorXd t(1), sigma(1);
  t[0] = prior.wheels.t_OtoI_s;
  sigma[0] = prior.sigma_time_offset_s;
  if (take(file_.clock, clock, t, sigma, errors)) {
    prior.wheels.t_OtoI_s = t[0];
    prior.sigma_time_offset_s = sigma[0];
  }
}

void CalibrationStart::take_camera(std::size_t index, CameraPrior& prior, Errors& errors) {
  if (only_wheels_ || index >= file_.camera_models.size()) return;
  CameraView& camera = prior.camera;
  const CalibratedCamera& model = file_.camera_models[index];
  const bool same_shutter = std::abs(model.line_delay_s - camera.line_delay_s) < 1e-9;
  if (model.distortion != camera.distortion || model.width_px != camera.width_px ||
      model.height_px != camera.height_px || !same_shutter) {
    errors.add(model.mark,
               "cam" + std::to_string(index) +
                   ": distortion_model, resolution or line_delay_nanoseconds is another "
                   "than in cameras.kalibr of the run: is it the same camera?");
    return;
  }
  const auto [extrinsics, numbers, clock] = camera_blocks(index, prior);
  Eigen::VectorXd pose = pose_of(camera.R_ItoC, camera.p_IinC);
  if (take(file_.cameras, extrinsics, pose, prior.sigma_extrinsics, errors)) {
    camera.R_ItoC = exp_so3(Eigen::Vector3d(pose.head<3>()));
    camera.p_IinC = pose.tail<3>();
  }
  take(file_.cameras, numbers, camera.intrinsics, prior.sigma_intrinsics, errors);
  for (const std::size_t f : {0u, 1u}) {
    const CalibrationEntry* const entry = find(file_.cameras, numbers.entries[f].name);
    if (entry != nullptr && !(entry->estimate > 0.)) {
      errors.add(entry->mark, entry->name + ": a focal length must be above 0");
    }
  }
  Eigen::VectorXd t(1), sigma(1);
  t[0] = camera.t_CtoI_s;
  sigma[0] = prior.sigma_clock_s;
  if (take(file_.cameras, clock, t, sigma, errors)) {
    camera.t_CtoI_s = t[0];
    prior.sigma_clock_s = sigma[0];
  }
}

PriorCorrelations CalibrationStart::correlations() const {
  PriorCorrelations out;
  std::ranges::copy_if(file_.correlations.entries, std::back_inserter(out.entries),
                       [&](const std::string& entry) { return taken_.contains(entry); });
  out.matrix = file_.correlations.among(out.entries);
  return out;
}

std::filesystem::path kinematics_calibration(const Node& kinematics) {
  const Node* const file = kinematics.find("calibration");
  if (file == nullptr) return {};
  if (!file->is_scalar()) {
    config::fail(file->mark(), "kinematics.calibration must be the path of a calibration.yaml");
  }
  const std::filesystem::path from = file->mark().line > 0 ? file->mark().file : "";
  return std::filesystem::absolute(from.parent_path() / file->scalar()).lexically_normal();
}

std::optional<CalibrationStart> read_calibration_start(const Node& run,
                                                       const std::filesystem::path& of_run,
                                                       Errors& errors) {
  const Node* const kinematics = run.find("kinematics");
  const auto of_wheels =
      kinematics != nullptr ? kinematics_calibration(*kinematics) : std::filesystem::path();
  if (!of_run.empty() && !of_wheels.empty()) {
    errors.add(kinematics->find("calibration")->mark(),
               "kinematics.calibration: the run has a key 'calibration', too, which the wheels "
               "start from - write either");
    return std::nullopt;
  }
  if (of_run.empty() && of_wheels.empty()) return std::nullopt;
  const bool only_wheels = of_run.empty();
  const std::string key = only_wheels ? "kinematics.calibration" : "calibration";
  const std::filesystem::path& file = only_wheels ? of_wheels : of_run;
  config::require_file_of_key(key, *run.at_path(key), file);
  return CalibrationStart(read_calibration(file), only_wheels);
}

}  // namespace viwo

// What a filter knows of its calibration, by name, and as a calibration.yaml.
#include "viwo/setup/calibration_values.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "viwo/math/so3.hpp"
#include "viwo/setup/filter_setup.hpp"
#include "viwo/setup/run_setup.hpp"

namespace viwo {
namespace {

bool is_camera(std::string_view block) {
  return block.size() > 3 && block.starts_with("cam") &&
         std::isdigit(static_cast<unsigned char>(block[3])) != 0;
}

/// The section that the entries of a block belong to.
CalibrationFile::Entries& section_of(const std::string& block, CalibrationFile& file) {
  if (is_camera(block)) return file.cameras;
  if (block.ends_with(".extrinsics")) return file.mount;
  return block.ends_with(".clock") ? file.clock : file.intrinsics;
}

/// What an entry of a block was declared with.
double declared(const BlockSpec& spec, std::size_t entry) {
  const std::size_t rotation = entry / 3;
  if (rotation >= static_cast<std::size_t>(spec.rotations)) {
    return spec.value[entry + 6 * static_cast<std::size_t>(spec.rotations)];
  }
  const Eigen::Map<const Eigen::Matrix3d> R(spec.value.data() + 9 * rotation);
  return log_so3(R)[static_cast<Eigen::Index>(entry % 3)];
}

/// Correlations of the errors at these columns.
Eigen::MatrixXd correlations_at(const std::vector<int>& columns, const Eigen::MatrixXd& P) {
  Eigen::MatrixXd out = P(columns, columns);
  const Eigen::VectorXd sigma = out.diagonal().cwiseSqrt();
  for (Eigen::Index i = 0; i < out.rows(); ++i) {
    for (Eigen::Index k = 0; k < i; ++k) {
      // Rounding may leave a little more than what can be.
      out(i, k) = out(k, i) = std::clamp(out(i, k) / (sigma[i] * sigma[k]), -1., 1.);
    }
    out(i, i) = 1.;
  }
  return out;
}

}  // namespace

std::vector<std::string> calibration_names(const Filter& filter) {
  std::vector<std::string> names;
  for (const BlockSpec& block : filter.blocks().specs()) {
    for (const BlockEntry& entry : block.entries) names.push_back(entry.name);
  }
  return names;
}

std::vector<BlockEstimate> calibration_of(const Filter& filter) {
  std::vector<BlockEstimate> estimates;
  for (std::size_t i = 0; i < filter.blocks().specs().size(); ++i) {
    filter.estimates({static_cast<int>(i)}, estimates);
  }
  return estimates;
}

bool is_of_the_rig(std::string_view block) {
  return is_camera(block) || block.starts_with("wheels.");
}

CalibrationFile calibration_file_of(const Filter& filter) {
  CalibrationFile file;
  std::vector<int> columns;
  for (std::size_t b = 0; b < filter.blocks().specs().size(); ++b) {
    const BlockSpec& spec = filter.blocks().specs()[b];
    if (!is_of_the_rig(spec.name) || spec.process == Process::kGaussMarkov) continue;
    const BlockId id{static_cast<int>(b)};
    std::vector<BlockEstimate> estimates;
    filter.estimates(id, estimates);
    for (std::size_t i = 0; i < spec.entries.size(); ++i) {
      const BlockEntry& entry = spec.entries[i];
      section_of(spec.name, file)
          .push_back(
              {entry.name, estimates[i].value, estimates[i].sigma, declared(spec, i), entry.unit});
      if (!(estimates[i].sigma > 0.)) continue;
      file.correlations.entries.push_back(entry.name);
      columns.push_back(filter.blocks().view(id).column() + static_cast<int>(i));
    }
  }
  file.correlations.matrix = correlations_at(columns, filter.covariance());
  return file;
}

void describe_rig(const RunSetup& setup, CalibrationFile& file) {
  if (!setup.filter) return;
  file.twist = setup.preintegration.twist.noise_weighted ? "noise_weighted" : "plain";
  for (const WheelSet& set : setup.filter->wheels) {
    if (file.intrinsics.empty()) break;  // no update has declared any wheels
    if (set.prior.name.empty()) {
      file.model = set.info.name;
    } else {
      file.wheel_sets[set.prior.name] = set.info.name;
    }
  }
  const auto& cameras = setup.filter->cameras;
  for (std::size_t i = 0; i < cameras.size() && !file.cameras.empty(); ++i) {
    const CameraView& camera = cameras[i].camera;
    file.camera_models.push_back(
        {camera.distortion, camera.width_px, camera.height_px, camera.line_delay_s});
    const CalibrationEntry* const clock = find(file.cameras, "cam0.t_CtoI");
    if (i == 0 || !cameras[i].shares_clock || clock == nullptr) continue;
    CalibrationEntry own = *clock;
    own.name = "cam" + std::to_string(i) + ".t_CtoI";
    own.estimate += camera.t_CtoI_s - cameras.front().camera.t_CtoI_s;
    own.nominal += camera.t_CtoI_s - cameras.front().camera.t_CtoI_s;
    file.cameras.push_back(own);
  }
}

}  // namespace viwo

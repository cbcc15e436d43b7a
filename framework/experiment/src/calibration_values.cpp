// What a filter knows of the calibration of a wheel set, by name.
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "viwo/experiment/filter_setup.hpp"
#include "viwo/math/so3.hpp"

namespace viwo::experiment {

std::vector<std::string> calibration_names(const WheelSet& wheels) {
  return viwo::calibration_names(wheels.name, wheels.model->description().intrinsics);
}

std::vector<CalibrationValue> calibration_of(const Filter& filter, std::size_t wheels) {
  const WheelsView& view = filter.wheels()[wheels];
  std::vector<CalibrationValue> out;
  const auto add = [&](double value, int first, int i) {
    const int column = first + i;
    out.push_back({value, first < 0 ? 0. : std::sqrt(filter.covariance()(column, column))});
  };
  const Eigen::Vector3d theta_ItoO = log_so3(view.R_ItoO);
  for (int i = 0; i < 3; ++i) add(theta_ItoO[i], view.extrinsics_column, i);
  for (int i = 0; i < 3; ++i) {
    add(view.p_IinO[i], view.extrinsics_column < 0 ? -1 : view.extrinsics_column + 3, i);
  }
  add(view.t_OtoI_s, view.time_offset_column, 0);
  for (int i = 0; i < view.x_WI.size(); ++i) add(view.x_WI[i], view.intrinsics_column, i);
  return out;
}

}  // namespace viwo::experiment

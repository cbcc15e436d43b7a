#include "true_calibration.hpp"

#include <algorithm>

#include "viwo/math/so3.hpp"
#include "viwo/wheel/held_gauge.hpp"

namespace viwo {
namespace {

using Truth = std::map<std::string, double>;

/// The values of entries `first` .. `first + count - 1`; nothing if one is not known.
std::optional<Eigen::VectorXd> values_of(const Truth& truth, const BlockSpec& block, int first,
                                         int count) {
  Eigen::VectorXd values(count);
  for (int i = 0; i < count; ++i) {
    const auto known = truth.find(block.entries[static_cast<std::size_t>(first + i)].name);
    if (known == truth.end()) return std::nullopt;
    values[i] = known->second;
  }
  return values;
}

void write(const BlockSpec& block, int first, const Eigen::VectorXd& values, Truth& truth) {
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    truth[block.entries[static_cast<std::size_t>(first + i)].name] = values[i];
  }
}

void hold_gauge(const WheelSet& set, Truth& truth) {
  for (std::size_t i = 0; i < set.model->description().intrinsics.size(); ++i) {
    const bool is_of_gauge = set.model->description().intrinsics[i].gauge_fixed;
    if (is_of_gauge && set.prior.sigma_intrinsics[static_cast<Eigen::Index>(i)] > 0.) return;
  }
  const auto [pose, clock, numbers] = wheels_blocks(set.prior);
  const auto theta = values_of(truth, pose, 0, 3), p = values_of(truth, pose, 3, 3);
  const auto x_WI = values_of(truth, numbers, 0, static_cast<int>(numbers.entries.size()));
  if (!theta || !p || !x_WI) return;
  WheelsView view = set.prior.wheels;
  view.R_ItoO = exp_so3(*theta);
  view.p_IinO = *p;
  view.x_WI = *x_WI;
  if (!move_to_held_gauge(*set.model, set.prior.wheels.x_WI, view)) return;
  write(pose, 0, log_so3(view.R_ItoO), truth);
  write(pose, 3, view.p_IinO, truth);
  write(numbers, 0, view.x_WI, truth);
}

}  // namespace

Truth true_calibration(const FilterSetup& setup, const Truth& given) {
  Truth truth = given;
  truth.insert(setup.drawn_from.begin(), setup.drawn_from.end());
  for (const WheelSet& set : setup.wheels) hold_gauge(set, truth);
  return truth;
}

void compare_calibration(const Truth& truth, const Filter& filter,
                         std::vector<CalibrationTrack>& tracks) {
  auto track = tracks.begin();
  for (std::size_t b = 0; b < filter.blocks().specs().size(); ++b) {
    const BlockSpec& block = filter.blocks().specs()[b];
    const BlockView& view = filter.blocks().views()[b];
    const int size = static_cast<int>(block.entries.size());
    const int rotations = block.rotations;
    for (int i = 0; i < size;) {
      const bool turns = i < 3 * rotations;
      const int count = turns ? 3 : 1;
      if (const auto true_value = values_of(truth, block, i, count)) {
        const Eigen::VectorXd error =
            turns
                ? Eigen::VectorXd(log_so3(exp_so3(*true_value) * view.rotation(i / 3).transpose()))
                : Eigen::VectorXd(view.numbers().segment(i - 3 * rotations, 1) - *true_value);
        for (int k = 0; k < count; ++k) {
          (track + i + k)->truth = (*true_value)[k];
          (track + i + k)->final_error = error[k];
        }
      }
      i += count;
    }
    track += size;
  }
}

}  // namespace viwo

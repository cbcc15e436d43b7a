// How blocks are put together, and the calibration of cameras and wheel sets laid out.
#include <stdexcept>

#include "viwo/api/status.hpp"
#include "viwo/api/update.hpp"

namespace viwo {
namespace {

std::array<std::string, 3> axes(const std::string& stem) {
  return {stem + "_x", stem + "_y", stem + "_z"};
}

void add_pose(BlockSpec& block, const std::string& theta, const Eigen::Matrix3d& R,
              const std::string& position, const Eigen::Vector3d& p,
              const Eigen::Matrix<double, 6, 1>& sigma) {
  block.add_rotation(axes(theta), R, sigma.head<3>());
  for (int i = 0; i < 3; ++i) {
    block.add(axes(position)[static_cast<std::size_t>(i)], "m", p[i], sigma[3 + i]);
  }
}

/// In front of the parameters of a wheel set, and of the names of its blocks.
struct WheelNames {
  std::string prefix, group;
};
WheelNames names_of(const WheelsPrior& prior) {
  if (prior.name.empty()) return {"", "wheels"};
  return {prior.name + ".", "wheels." + prior.name};
}

/// Empty without a model.
ModelDescription description_of(const WheelsPrior& prior) {
  ModelDescription description;
  if (prior.wheels.model != nullptr) prior.wheels.model->describe(description);
  return description;
}

/// Entries for all intrinsics of the model of `prior`, called as it calls them.
void add_intrinsics(BlockSpec& block, const std::string& prefix, const WheelsPrior& prior,
                    const Intrinsics& value, const Intrinsics& sigma) {
  const ModelDescription description = description_of(prior);
  for (Eigen::Index i = 0; i < value.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const bool named = k < description.intrinsics.size();
    block.add(
        prefix + (named ? description.intrinsics[k].name : "intrinsic_" + std::to_string(i + 1)),
        named ? description.intrinsics[k].unit : "", value[i], sigma[i]);
  }
}

}  // namespace

BlockSpec& BlockSpec::add_rotation(const std::array<std::string, 3>& names,
                                   const Eigen::Matrix3d& R, const Eigen::Vector3d& sigma) {
  if (static_cast<int>(entries.size()) != 3 * rotations) {
    throw std::logic_error("block '" + name + "': rotations stand before all other entries");
  }
  ++rotations;
  for (int i = 0; i < 3; ++i) {
    entries.push_back({names[static_cast<std::size_t>(i)], "rad", sigma[i]});
  }
  value.insert(value.end(), R.data(), R.data() + 9);
  return *this;
}

BlockSpec& BlockSpec::add(std::string entry, std::string unit, double initial, double sigma,
                          Excitation needs) {
  entries.push_back({std::move(entry), std::move(unit), sigma, 0., needs});
  value.push_back(initial);
  return *this;
}

std::array<BlockSpec, 3> camera_blocks(std::size_t index, const CameraPrior& prior) {
  const std::string cam = "cam" + std::to_string(index) + ".";
  BlockSpec extrinsics{.name = cam + "extrinsics"};
  add_pose(extrinsics, cam + "theta_ItoC", prior.camera.R_ItoC, cam + "p_IinC", prior.camera.p_IinC,
           prior.sigma_extrinsics);
  BlockSpec intrinsics{.name = cam + "intrinsics"};
  constexpr const char* kNames[] = {"fx", "fy", "cx", "cy", "d1", "d2", "d3", "d4"};
  for (int i = 0; i < 8; ++i) {
    intrinsics.add(cam + kNames[i], i < 4 ? "px" : "", prior.camera.intrinsics[i],
                   prior.sigma_intrinsics[i]);
  }
  BlockSpec clock{.name = cam + "clock"};
  clock.add(cam + "t_CtoI", "s", prior.camera.t_CtoI_s, prior.sigma_clock_s, Excitation::kClock);
  return {extrinsics, intrinsics, clock};
}

CameraBlocks declare_camera(Declarations& host, int index) {
  const std::span<const CameraPrior> cameras = host.rig().cameras();
  const auto i = static_cast<std::size_t>(index);
  // One clock for cameras that are triggered together: it is called after the first of them.
  const std::size_t clocked = cameras[i].shares_clock ? 0 : i;
  const auto blocks = camera_blocks(i, cameras[i]);
  const BlockSpec clock = camera_blocks(clocked, cameras[clocked])[2];
  const double constant_s = cameras[i].camera.t_CtoI_s - cameras[clocked].camera.t_CtoI_s;
  return {host.block(blocks[0]), host.block(blocks[1]), host.block(clock), constant_s,
          constant_s + cameras[i].camera.middle_s()};
}

void CameraBlocks::read(const FilterView& filter, CameraView& camera) const {
  const BlockView& pose = filter.block(extrinsics);
  camera.R_ItoC = pose.rotation();
  camera.p_IinC = pose.numbers();
  camera.intrinsics = filter.block(intrinsics).numbers();
  camera.t_CtoI_s = filter.block(clock).numbers()[0] + clock_constant_s;
}

const WheelsPrior& Rig::wheels() {
  was_asked_for_wheels_ = true;
  if (!wheels_) throw InputError("needs wheels: there is no section 'kinematics'");
  return *wheels_;
}

std::array<BlockSpec, 3> wheels_blocks(const WheelsPrior& prior) {
  const auto [prefix, group] = names_of(prior);
  BlockSpec extrinsics{.name = group + ".extrinsics", .group = group};
  add_pose(extrinsics, prefix + "theta_ItoO", prior.wheels.R_ItoO, prefix + "p_IinO",
           prior.wheels.p_IinO, prior.sigma_extrinsics);
  // About x and y, and along z: only a base that rolls or pitches shows them.
  for (const std::size_t i : {0u, 1u, 5u}) extrinsics.entries[i].needs = Excitation::kTilt;
  BlockSpec clock{.name = group + ".clock", .group = group};
  clock.add(prefix + "t_OtoI", "s", prior.wheels.t_OtoI_s, prior.sigma_time_offset_s,
            Excitation::kClock);
  BlockSpec intrinsics{.name = group + ".intrinsics", .group = group};
  add_intrinsics(intrinsics, prefix, prior, prior.wheels.x_WI, prior.sigma_intrinsics);
  if (prior.intrinsics_walk > 0.) {
    intrinsics.process = Process::kRandomWalk;
    const ModelDescription description = description_of(prior);
    for (std::size_t i = 0; i < intrinsics.entries.size(); ++i) {
      BlockEntry& entry = intrinsics.entries[i];
      // Of the drawing, whatever is known of the entry since.
      const bool is_described = i < description.intrinsics.size();
      const double sigma = is_described ? description.intrinsics[i].prior_sigma : entry.sigma;
      if (entry.sigma > 0.) entry.process_sigma = prior.intrinsics_walk * sigma;
    }
  }
  return {extrinsics, clock, intrinsics};
}

WheelsBlocks declare_wheels(Declarations& host) {
  const WheelsPrior& prior = host.rig().wheels();
  const std::array<BlockSpec, 3> blocks = wheels_blocks(prior);
  WheelsBlocks out{
      prior.wheels.model, host.block(blocks[0]), host.block(blocks[1]), host.block(blocks[2]), {},
      prior.wander_time_s};
  if (prior.sigma_wander.size() == 0) return out;
  const auto [prefix, group] = names_of(prior);
  BlockSpec wander{.name = group + ".wander",
                   .process = Process::kGaussMarkov,
                   .time_constant_s = prior.wander_time_s};
  add_intrinsics(wander, prefix + "wander_", prior, Intrinsics::Zero(prior.sigma_wander.size()),
                 prior.sigma_wander);
  for (BlockEntry& entry : wander.entries) entry.process_sigma = entry.sigma;
  out.wander = host.block(wander);
  return out;
}

WheelsView WheelsBlocks::view(const FilterView& filter) const {
  const BlockView& pose = filter.block(extrinsics);
  const BlockView& offset = filter.block(clock);
  const BlockView& numbers = filter.block(intrinsics);
  WheelsView view;
  view.model = model;
  view.R_ItoO = pose.rotation();
  view.p_IinO = pose.numbers();
  view.t_OtoI_s = offset.numbers()[0];
  view.x_WI = numbers.numbers();
  view.extrinsics_column = pose.column();
  view.time_offset_column = offset.column();
  view.intrinsics_column = numbers.column();
  if (wander.index >= 0) {
    const BlockView& moving = filter.block(wander);
    view.x_WI += moving.numbers();
    view.wander_column = moving.column();
    view.wander_time_s = wander_time_s;
  }
  return view;
}

IntrinsicMatrix WheelsView::covariance(
    const Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>& P) const {
  const Eigen::Index n = x_WI.size();
  IntrinsicMatrix sum = IntrinsicMatrix::Zero(n, n);
  for (const int row : {intrinsics_column, wander_column}) {
    for (const int column : {intrinsics_column, wander_column}) {
      if (row >= 0 && column >= 0) sum += P.block(row, column, n, n);
    }
  }
  return sum;
}

}  // namespace viwo

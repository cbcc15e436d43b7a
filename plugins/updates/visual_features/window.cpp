#include "window.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "viwo/math/so3.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo::visual {
namespace {

/// Stamps are whole nanoseconds: below, an image is at the time of its clone.
constexpr double kStampResolutionS = 1e-9;

}  // namespace

WorldTurn world_turn_of(const CloneState& clone) {
  WorldTurn turn;
  turn << clone.R_GtoI_fej.col(2), world_turn_of_point(clone.p_IinG_fej);
  return turn;
}

void Window::start(int max_clones, std::span<const CameraPrior> cameras,
                   std::span<const CameraBlocks> blocks) {
  const auto clones = static_cast<std::size_t>(max_clones);
  blocks_.assign(blocks.begin(), blocks.end());
  clones_.reserve(clones);
  order_.reserve(clones);
  index_of_slot_.assign(clones, -1);
  cameras_.assign(cameras.size(), {});
  for (std::size_t i = 0; i < cameras.size(); ++i) cameras_[i].view = cameras[i].camera;
  stamps_.assign(clones * cameras.size(), {});
  poses_.assign(clones * cameras.size(), {});
  way_variance_.reserve(clones);
  const int columns = kPoseSize * max_clones + kCalibrationSize * n_cameras();
  state_columns_.reserve(static_cast<std::size_t>(columns));
  covariance_.setZero(columns, columns);
}

void Window::set(const FilterView& filter) {
  filter_ = filter;
  has_covariance_ = false;
  way_variance_.clear();
  set_clones();
  set_cameras();
  set_columns();
}

void Window::set_clones() {
  const int n_slots = static_cast<int>(index_of_slot_.size());
  std::fill(index_of_slot_.begin(), index_of_slot_.end(), -1);
  order_.clear();
  for (int i = 0; i < static_cast<int>(filter_.clones.size()); ++i) {
    const CloneState& clone = filter_.clones[static_cast<std::size_t>(i)];
    if (clone.column < 0 || clone.slot < 0 || clone.slot >= n_slots) continue;
    int& index = index_of_slot_[static_cast<std::size_t>(clone.slot)];
    if (index >= 0) continue;
    index = i;
    order_.push_back(i);
  }
  std::sort(order_.begin(), order_.end(), [&](int a, int b) {
    return filter_.clones[static_cast<std::size_t>(a)].column <
           filter_.clones[static_cast<std::size_t>(b)].column;
  });
  clones_.clear();
  for (const int i : order_) {
    const CloneState& from = filter_.clones[static_cast<std::size_t>(i)];
    index_of_slot_[static_cast<std::size_t>(from.slot)] = n_clones();
    WindowClone& clone = clones_.emplace_back();
    clone.t_ns = from.t_ns;
    clone.slot = from.slot;
    clone.column = kPoseSize * (n_clones() - 1);
    clone.R_GtoI = from.R_GtoI;
    clone.p_IinG = from.p_IinG;
    clone.w_IinI = from.w_IinI;
    clone.v_IinG = from.R_GtoI.transpose() * (from.R_GtoI_fej * from.v_IinG);
    clone.p_IinG_fej = from.p_IinG_fej;
    clone.world_turn = world_turn_of(from);
  }
}

void Window::set_cameras() {
  const FilterView::Covariance P = filter_.P();
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    WindowCamera& camera = cameras_[i];
    const CameraBlocks& blocks = blocks_[i];
    blocks.read(filter_, camera.view);
    // First the columns of the state, without those that are held.
    const auto place = [&](BlockId id, int entry, bool& has) {
      const BlockView& block = filter_.block(id);
      has = false;
      for (int k = 0; k < block.size(); ++k) {
        const int column = block.column() + k;
        const bool free = block.column() >= 0 && P(column, column) > 0.;
        camera.column[static_cast<std::size_t>(entry + k)] = free ? column : -1;
        has = has || free;
      }
    };
    place(blocks.extrinsics, 0, camera.has_extrinsics);
    place(blocks.intrinsics, kIntrinsicsEntry, camera.has_intrinsics);
    place(blocks.clock, kClockEntry, camera.has_clock);
  }
}

void Window::set_columns() {
  state_columns_.clear();
  for (const int i : order_) {
    for (int k = 0; k < kPoseSize; ++k) {
      state_columns_.push_back(filter_.clones[static_cast<std::size_t>(i)].column + k);
    }
  }
  const auto calibration = static_cast<std::ptrdiff_t>(state_columns_.size());
  for (const WindowCamera& camera : cameras_) {
    for (const int column : camera.column) {
      if (column >= 0) state_columns_.push_back(column);
    }
  }
  const auto begin = state_columns_.begin() + calibration;
  std::sort(begin, state_columns_.end());  // cameras may share a clock
  state_columns_.erase(std::unique(begin, state_columns_.end()), state_columns_.end());
  for (WindowCamera& camera : cameras_) {
    for (int& column : camera.column) {
      if (column < 0) continue;
      const auto at = std::lower_bound(begin, state_columns_.end(), column);
      column = static_cast<int>(at - state_columns_.begin());
    }
  }
  // What lies side by side in the error state is one block.
  columns_.clear();
  for (std::size_t first = 0; first < state_columns_.size();) {
    std::size_t last = first + 1;
    while (last < state_columns_.size() && state_columns_[last] == state_columns_[last - 1] + 1) {
      ++last;
    }
    columns_.add(state_columns_[first], static_cast<int>(last - first));
    first = last;
  }
}

std::optional<int> Window::take_image(int camera, std::int64_t stamp_ns) {
  const CameraView& view = cameras_[static_cast<std::size_t>(camera)].view;
  const double offset_s = view.image_offset_s();
  if (!std::isfinite(offset_s)) return std::nullopt;
  const std::int64_t t_ns = stamp_ns + to_ns(offset_s);
  const WindowClone* nearest = nullptr;
  for (const WindowClone& clone : clones_) {
    if (nearest == nullptr || std::abs(clone.t_ns - t_ns) < std::abs(nearest->t_ns - t_ns)) {
      nearest = &clone;
    }
  }
  if (nearest == nullptr || std::abs(nearest->t_ns - t_ns) > kSameInstantNs) return std::nullopt;
  ImageStamp& stamp = stamps_[image_index(nearest->slot, camera)];
  if (stamp.clone_ns == nearest->t_ns && stamp.stamp_ns != stamp_ns) return std::nullopt;
  stamp = {nearest->t_ns, stamp_ns};
  return nearest->slot;
}

double Window::seconds_to_image(int clone, int camera) const {
  const WindowClone& at = this->clone(clone);
  const ImageStamp& stamp = stamps_[image_index(at.slot, camera)];
  if (stamp.clone_ns != at.t_ns) return 0.;
  const double dt_s =
      seconds_between(at.t_ns, stamp.stamp_ns) + this->camera(camera).view.image_offset_s();
  return std::abs(dt_s) < kStampResolutionS ? 0. : dt_s;
}

CameraPose Window::make_pose(int clone, int camera, double dt_s) const {
  const WindowClone& at = this->clone(clone);
  const CameraView& view = this->camera(camera).view;
  Eigen::Matrix3d R_GtoI = at.R_GtoI;
  CameraPose pose;
  pose.p_IinG = at.p_IinG;
  if (dt_s != 0.) {  // (VF-14)
    pose.p_IinG += at.v_IinG * dt_s;
    R_GtoI = exp_so3(-dt_s * at.w_IinI) * R_GtoI;
  }
  const Eigen::Vector3d p_CinI = -view.R_ItoC.transpose() * view.p_IinC;
  pose.R_GtoC = view.R_ItoC * R_GtoI;
  pose.p_CinG = pose.p_IinG + R_GtoI.transpose() * p_CinI;
  return pose;
}

void Window::set_poses() {
  for (int i = 0; i < n_clones(); ++i) {
    for (int j = 0; j < n_cameras(); ++j) {
      poses_[image_index(i, j)] = make_pose(i, j, seconds_to_image(i, j));
    }
  }
}

double Window::way_variance(int clone) {
  if (way_variance_.empty()) set_way_variances();
  return way_variance_[static_cast<std::size_t>(clone)];
}

bool Window::knows_way() {
  if (way_variance_.empty()) set_way_variances();
  return knows_way_;
}

void Window::set_way_variances() {
  constexpr double kKnown = 0.1;
  const FilterView::Covariance P = filter_.P();
  const WindowClone& from = *std::ranges::max_element(clones_, {}, &WindowClone::t_ns);
  double longest_m2 = 0.;
  knows_way_ = false;
  for (const WindowClone& to : clones_) {
    // By dtheta and dp of the one, dp of the other.
    Eigen::Matrix<double, 3, 9> J;
    J << skew(from.R_GtoI * (to.p_IinG - from.p_IinG)), -from.R_GtoI, from.R_GtoI;
    Eigen::Matrix<double, 9, 9> P_of;
    const auto column = [&](int i) {
      return state_column(i < kPoseSize ? from.column + i : to.column + i - 3);
    };
    for (int i = 0; i < 9; ++i) {
      for (int k = 0; k <= i; ++k) {
        P_of(i, k) = P(std::max(column(i), column(k)), std::min(column(i), column(k)));
        P_of(k, i) = P_of(i, k);
      }
    }
    const double trace = (J * P_of * J.transpose()).trace();
    way_variance_.push_back(&to == &from ? 0. : std::max(0., trace / 3.));
    const double way_m2 = (to.p_IinG - from.p_IinG).squaredNorm();
    if (way_m2 <= longest_m2) continue;
    longest_m2 = way_m2;
    knows_way_ = way_variance_.back() < kKnown * kKnown * way_m2;
  }
}

const Eigen::MatrixXd& Window::covariance() {
  if (has_covariance_) return covariance_;
  has_covariance_ = true;
  const FilterView::Covariance P = filter_.P();
  int row = 0;
  for (const ColumnRange& a : columns_.blocks()) {
    int column = 0;
    for (const ColumnRange& b : columns_.blocks()) {
      if (column > row) break;
      auto block = covariance_.block(row, column, a.count, b.count);
      if (a.first == b.first) {
        block = P.block(a.first, a.first, a.count, a.count).selfadjointView<Eigen::Lower>();
      } else if (a.first > b.first) {
        block = P.block(a.first, b.first, a.count, b.count);
      } else {
        block = P.block(b.first, a.first, b.count, a.count).transpose();
      }
      if (a.first != b.first) {
        covariance_.block(column, row, b.count, a.count) = block.transpose();
      }
      column += b.count;
    }
    row += a.count;
  }
  return covariance_;
}

}  // namespace viwo::visual

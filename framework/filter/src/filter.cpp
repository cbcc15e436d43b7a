#include "viwo/filter/filter.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "viwo/api/status.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

/// What may be off in a filter that has lost contact with all that is measured (F-28).
constexpr double kLostThetaRad = 0.1;
constexpr double kLostPositionM = 0.3;
constexpr double kLostVelocityMPerS = 1.;

int clone_columns(const FilterOptions& options) {
  if (options.clones < 2 || options.clones > 100) {
    throw std::invalid_argument("the number of clones must be within 2 .. 100");
  }
  return kPoseSize * (options.clones + 1);
}

StateBlocks checked(std::vector<BlockSpec> blocks, std::vector<RoomSpec> rooms, int first_column) {
  for (const BlockSpec& block : blocks) {
    const std::string fault = fault_of(block);
    if (!fault.empty()) throw InputError("block '" + block.name + "': " + fault);
  }
  for (const RoomSpec& room : rooms) {
    const std::string fault = fault_of(room);
    if (!fault.empty()) throw InputError("room '" + room.name + "': " + fault);
  }
  return {std::move(blocks), std::move(rooms), first_column};
}

int room_columns(const StateBlocks& blocks) {
  int columns = 0;
  for (const RoomSpec& room : blocks.rooms()) columns += room.blocks * room.entries;
  return columns;
}

/// R <- Exp(-dtheta) R; exactly R for no correction.
void turn(Eigen::Matrix3d& R, const Eigen::Vector3d& dtheta) {
  if (!dtheta.isZero(0.)) R = normalized_rotation(exp_so3(-dtheta) * R);
}

}  // namespace

Filter::Filter(const FilterOptions& options, std::vector<BlockSpec> blocks,
               std::vector<RoomSpec> rooms)
    : options_(options),
      slots_(static_cast<std::size_t>(std::max(options.clones, 0)) + 1, false),
      blocks_(checked(std::move(blocks), std::move(rooms), kImuSize + clone_columns(options))),
      covariance_(blocks_.first_column() + blocks_.columns(), room_columns(blocks_)),
      held_(blocks_.first_watched(),
            blocks_.first_column() + blocks_.columns() - blocks_.first_watched()),
      dx_(Eigen::VectorXd::Zero(covariance_.size())) {
  clones_.reserve(slots_.size());
  moves_.reserve(slots_.size() + 1);
  new_columns_.reserve(static_cast<std::size_t>(room_columns(blocks_)));
  blocks_.set_prior(covariance_, options_.correlations);
}

void Filter::initialize(const ImuPrior& prior) {
  t_ns_ = prior.t_ns;
  has_moved_ = false;
  set_imu(prior.state);
  clones_.clear();
  std::fill(slots_.begin(), slots_.end(), false);
  ImuMatrix P = prior.P;
  shared_position_.take_from(P.block<3, 3>(kPositionColumn, kPositionColumn));
  covariance_.set_block(0, P);
}

void Filter::set_imu(const ImuState& state) {
  rebase();
  imu_ = state;
  imu_.R_GtoI_fej = imu_.R_GtoI;
  imu_.p_IinG_fej = imu_.p_IinG;
  imu_.v_IinG_fej = imu_.v_IinG;
}

void Filter::rebase() {
  if (!std::exchange(has_moved_, false) || options_.consistency == Consistency::kFirstEstimates) {
    return;
  }
  if (options_.consistency == Consistency::kTransform) {  // (F-45)
    moves_.clear();
    const Eigen::Vector3d shift = imu_.p_IinG - imu_.p_IinG_fej;
    const auto move = [&](int column, const auto& pose) -> ErrorMove& {
      const Eigen::Matrix3d R_ItoG = pose.R_GtoI_fej.transpose();
      return moves_.emplace_back(ErrorMove{column, pose.R_GtoI * R_ItoG,
                                           -skew(pose.p_IinG - pose.p_IinG_fej - shift) * R_ItoG});
    };
    move(kThetaColumn, imu_).velocity_by_theta =
        -skew(imu_.v_IinG - imu_.v_IinG_fej) * imu_.R_GtoI_fej.transpose();
    for (const CloneState& clone : clones_) move(clone.column, clone);
    covariance_.move(moves_);
  }
  imu_.R_GtoI_fej = imu_.R_GtoI;
  imu_.p_IinG_fej = imu_.p_IinG;
  imu_.v_IinG_fej = imu_.v_IinG;
  for (CloneState& clone : clones_) {
    // Of a clone it is the velocity in I that is held.
    clone.v_IinG = clone.R_GtoI.transpose() * (clone.R_GtoI_fej * clone.v_IinG);
    clone.R_GtoI_fej = clone.R_GtoI;
    clone.p_IinG_fej = clone.p_IinG;
  }
}

ImuMatrix Filter::imu_covariance() const {
  ImuMatrix P = covariance_.matrix().topLeftCorner<kImuSize, kImuSize>();
  P.block<3, 3>(kPositionColumn, kPositionColumn) += shared_position_.covariance();
  return P;
}

ImuTransition Filter::propagate(std::span<const ImuSample> samples,
                                std::span<const double> gaps_s) {
  if (samples.empty()) return {ImuMatrix::Identity(), ImuMatrix::Zero()};
  rebase();
  ImuTransition transition =
      viwo::propagate(samples, options_.imu_noise, options_.gravity_m_per_s2, imu_, gaps_s);
  covariance_.propagate(transition);
  blocks_.propagate(seconds_between(samples.front().t_ns, samples.back().t_ns), covariance_);
  t_ns_ = samples.back().t_ns;
  return transition;
}

void Filter::loosen(double times) {
  rebase();
  ImuTransition unknown{ImuMatrix::Identity(), ImuMatrix::Zero()};
  const auto add = [&](int column, double sigma) {
    unknown.Q.diagonal().segment<3>(column).setConstant(times * times * sigma * sigma);
  };
  add(kThetaColumn, kLostThetaRad);
  add(kPositionColumn, kLostPositionM);
  add(kVelocityColumn, kLostVelocityMPerS);
  covariance_.propagate(unknown);
}

void Filter::clone(const ImuSample& sample) {
  rebase();
  const auto free = std::find(slots_.begin(), slots_.end(), false);
  if (free == slots_.end()) throw std::logic_error("no room for another clone");
  *free = true;
  CloneState clone;
  clone.t_ns = t_ns_;
  clone.slot = static_cast<int>(free - slots_.begin());
  clone.column = kImuSize + kPoseSize * clone.slot;
  clone.R_GtoI = clone.R_GtoI_fej = imu_.R_GtoI;
  clone.p_IinG = clone.p_IinG_fej = imu_.p_IinG;
  clone.w_IinI = to_vector(sample.gyro_rad_per_s) - imu_.gyro_bias;
  clone.v_IinG = imu_.v_IinG;
  clones_.push_back(clone);
  covariance_.clone_pose(clone.column);
}

void Filter::drop_oldest_clone() {
  rebase();
  if (clones_.empty()) return;
  const CloneState& oldest = clones_.front();
  slots_[static_cast<std::size_t>(oldest.slot)] = false;
  covariance_.clear_block(oldest.column, kPoseSize);
  clones_.erase(clones_.begin());
}

/// What tells where all of it is needs to know how little that was known (F-41).
template <class Factor>
void Filter::see_position(const Factor& factor) {
  if (shared_position_.is_zero() || !shared_position_.is_seen_by(factor, clones_)) return;
  shared_position_.return_to(covariance_, clones_);
}

template <class Factor>
FactorResult Filter::apply_factor(const Factor& factor) {
  see_position(factor);
  const FactorResult result = covariance_.apply(factor, held_, dx_);
  if (is_applied(result)) correct();
  return result;
}

FactorResult Filter::apply(const ResidualFactor& factor) { return apply_factor(factor); }

FactorResult Filter::apply(const InformationFactor& factor) {
  const FactorResult result = apply_factor(factor);
  if (result == FactorResult::kFailed) covariance_failed_ = true;
  return result;
}

FactorResult Filter::apply(InformationFactor& factor, std::span<const AddedBlock> added) {
  if (added.empty()) return apply(std::as_const(factor));
  new_columns_.clear();
  for (const AddedBlock& block : added) {
    const BlockView& view = blocks_.view(block.id);
    for (int i = 0; i < view.size(); ++i) new_columns_.push_back(view.column() + i);
  }
  dx_.setZero();
  see_position(factor);
  if (!covariance_.split(new_columns_, factor)) return FactorResult::kRejected;
  if (covariance_.ties_known_columns()) {
    const FactorResult result = covariance_.apply(factor, held_, dx_);
    if (result == FactorResult::kFailed) covariance_failed_ = true;
    if (result != FactorResult::kApplied) return result;
  }
  covariance_.initialise(dx_);
  for (const AddedBlock& block : added) blocks_.add(block);
  correct();
  return FactorResult::kApplied;
}

void Filter::drop(BlockId id) {
  const BlockView& view = blocks_.view(id);
  covariance_.clear_block(view.column(), view.size());
  blocks_.drop(id);
}

void Filter::rewrite(const BlockRewrite& block) {
  rebase();
  covariance_.rewrite(blocks_.view(block.id).column(), block.columns, block.J);
  blocks_.rewrite(block);
}

void Filter::correct() {
  if (dx_.isZero(0.)) return;
  has_moved_ = true;
  turn(imu_.R_GtoI, dx_.segment<3>(kThetaColumn));
  imu_.p_IinG += dx_.segment<3>(kPositionColumn);
  imu_.v_IinG += dx_.segment<3>(kVelocityColumn);
  imu_.gyro_bias += dx_.segment<3>(kGyroBiasColumn);
  imu_.accel_bias += dx_.segment<3>(kAccelBiasColumn);
  for (CloneState& clone : clones_) {
    turn(clone.R_GtoI, dx_.segment<3>(clone.column));
    clone.p_IinG += dx_.segment<3>(clone.column + 3);
  }
  // What its own epoch tells of how the latest clone moves.
  if (!clones_.empty() && clones_.back().t_ns == t_ns_) {
    CloneState& now = clones_.back();
    now.w_IinI -= dx_.segment<3>(kGyroBiasColumn);
    now.v_IinG = now.R_GtoI_fej.transpose() * (imu_.R_GtoI * imu_.v_IinG);
  }
  blocks_.correct(dx_, options_.consistency != Consistency::kNone);
}

FilterView Filter::view() const {
  if (has_moved_) throw std::logic_error("errors are not those of the estimate");
  FilterView view;
  view.imu = imu_;
  view.clones = clones_;
  view.blocks = blocks_.views();
  view.imu_noise = options_.imu_noise;
  view.gravity_m_per_s2 = options_.gravity_m_per_s2;
  view.oldest_leaves = window_full();
  view.size = covariance_.size();
  view.covariance_data = covariance_.matrix().data();
  view.covariance_stride = covariance_.size();
  return view;
}

}  // namespace viwo

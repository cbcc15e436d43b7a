#include "viwo/estimator/excitation_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "viwo/math/arrays.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr double kMaxBins = 1000.;
/// Epochs do not come to the nanosecond: a period may end a little early.
constexpr double kSlackS = 1e-3;
/// A parameter is named when this part of its prior variance lies in directions that are not
/// excited. A wheel that turns at constant steering has four parameters in two such directions.
constexpr double kNamedPart = 0.3;

std::size_t bins_of(const MonitorOptions& options) {
  const double bins = std::ceil(options.window_s / options.period_s - 1e-9);
  if (!(options.window_s > 0.) || !(options.period_s > 0.) || !(bins <= kMaxBins)) {
    throw std::invalid_argument("the monitor's window must be 1 to 1000 of its periods");
  }
  return static_cast<std::size_t>(std::max(bins, 1.));
}

int first_column(const StateBlocks& blocks, const BlockGroup& group) {
  for (const BlockId id : group.blocks) {
    if (blocks.view(id).column() >= 0) return blocks.view(id).column();
  }
  return blocks.first_watched();
}

/// Prior sigmas of the blocks that have columns, as they stand in the state.
Eigen::VectorXd sigmas(const StateBlocks& blocks, const BlockGroup& group) {
  std::vector<double> all;
  for (const BlockId id : group.blocks) {
    if (blocks.view(id).column() < 0) continue;
    for (const BlockEntry& entry : blocks.specs()[static_cast<std::size_t>(id.index)].entries) {
      all.push_back(entry.sigma);
    }
  }
  return Eigen::VectorXd::Map(all.data(), static_cast<Index>(all.size()));
}

}  // namespace

ExcitationMonitor::ExcitationMonitor(const MonitorOptions& options, const StateBlocks& blocks,
                                     const BlockGroup& group)
    : options_(options),
      information_(first_column(blocks, group), sigmas(blocks, group), bins_of(options)),
      motion_(bins_of(options)),
      mount_(group.mount),
      n_bins_(bins_of(options)) {
  if (mount_.index < 0) {
    throw std::invalid_argument("the group '" + group.name + "' has no block that is a pose");
  }
  for (const BlockId id : group.blocks) {
    if (blocks.view(id).column() < 0) continue;
    for (const BlockEntry& entry : blocks.specs()[static_cast<std::size_t>(id.index)].entries) {
      if (!(entry.sigma > 0.)) continue;
      names_.push_back(entry.name);
      needs_.push_back(entry.needs);
    }
  }
  sigma_ratio_.reserve(names_.size());
}

void ExcitationMonitor::add_motion(const Filter& filter, std::span<const ImuSample> imu) {
  const BlockView& mount = filter.blocks().view(mount_);
  const auto R_ItoO = mount.rotation();
  // The rate is a mean over the epoch: single readings shake.
  Vector3d w_IinI = Vector3d::Zero();
  for (const ImuSample& sample : imu) w_IinI += to_vector(sample.gyro_rad_per_s);
  w_IinI = w_IinI / static_cast<double>(imu.size()) - filter.imu().gyro_bias;
  const Vector3d w_OinO = R_ItoO * w_IinI;
  const Vector3d v_IinO = R_ItoO * (filter.imu().R_GtoI * filter.imu().v_IinG);
  const double span_s = seconds_between(imu.front().t_ns, imu.back().t_ns);
  const double noise = filter.options().imu_noise.gyro_rad_per_s_sqrt_hz;
  const double sigma_w = span_s > 0. ? noise / std::sqrt(span_s) : 0.;
  motion_.add(v_IinO - w_OinO.cross(Vector3d(mount.numbers())), w_OinO, sigma_w);
}

bool ExcitationMonitor::epoch(const Filter& filter, std::span<const ImuSample> imu) {
  measured_ = false;
  has_news_ = false;
  if (imu.empty()) return false;
  if (!bin_begin_ns_) bin_begin_ns_ = imu.front().t_ns;
  add_motion(filter, imu);
  if (seconds_between(*bin_begin_ns_, filter.t_ns()) < options_.period_s - kSlackS) return false;
  bin_begin_ns_ = filter.t_ns();
  evaluate();
  has_news_ = ++bins_done_ >= n_bins_;
  if (has_news_) warn(filter.t_ns());
  information_.next_bin();
  motion_.next_bin();
  return true;
}

double ExcitationMonitor::unexcited_part(Index parameter) const {
  return information_.directions().row(parameter).head(unexcited_).squaredNorm();
}

void ExcitationMonitor::evaluate() {
  const auto motion = motion_.classify();
  // A standstill, and tilts that are noise, are counted as motion by the Jacobians (F-21).
  const bool still = motion[static_cast<std::size_t>(Degeneracy::kStandstill)];
  InformationWindow::Vector believed(information_.sigma().size());
  for (std::size_t i = 0; i < needs_.size(); ++i) {
    const double part = needs_[i] == Excitation::kTilt ? motion_.tilt_signal() : 1.;
    believed[static_cast<Index>(i)] = still ? 0. : part;
  }
  information_.decompose(believed);
  const auto& values = information_.information();
  unexcited_ = 0;
  while (unexcited_ < values.size() &&
         !(std::max(values[unexcited_], 0.) >= options_.min_information)) {
    ++unexcited_;
  }
  sigma_ratio_.resize(names_.size());
  for (std::size_t i = 0; i < names_.size(); ++i) {
    sigma_ratio_[i] = information_.sigma_ratio(static_cast<Index>(i));
  }
}

void ExcitationMonitor::hold(HeldDirections& held) const {  // (F-20)
  for (int i = 0; i < unexcited_; ++i) {
    held.add(information_.columns(), information_.directions().col(i), information_.sigma());
  }
}

void ExcitationMonitor::warn(std::int64_t t_ns) {
  const auto motion = motion_.classify();
  for (std::size_t kind = 0; kind < kDegeneracies; ++kind) {
    if (motion[kind] && !warned_[kind]) warn(t_ns, static_cast<Degeneracy>(kind));
  }
}

void ExcitationMonitor::warn(std::int64_t t_ns, Degeneracy kind) {
  struct Words {
    const char* motion;
    const char* missing;
    const char* advice;
  };
  constexpr std::array<Words, kDegeneracies> kWords{{
      {"standing still", "cannot be learned", "drive"},
      {"no yaw rate", "cannot be learned", "turn"},
      {"constant steering or radius of turn", "cannot be told apart", "change it while turning"},
      {"constant speed and turn rate", "cannot be learned", "speed up, slow down or steer"},
      {"flat ground", "cannot be learned", "drive over slopes or hold them"},
  }};
  ExcitationWarning warning;
  warning.t_ns = t_ns;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    const bool concerned =
        kind == Degeneracy::kStandstill ||
        (kind == Degeneracy::kSteadyVelocity && needs_[i] == Excitation::kClock) ||
        (kind == Degeneracy::kFlatGround && needs_[i] == Excitation::kTilt) ||
        ((kind == Degeneracy::kNoYawRate || kind == Degeneracy::kConstantSteering) &&
         needs_[i] == Excitation::kPlanar);
    if (concerned && unexcited_part(static_cast<Index>(i)) > kNamedPart) {
      warning.parameters.push_back(names_[i]);
    }
  }
  if (warning.parameters.empty()) return;
  warned_[static_cast<std::size_t>(kind)] = true;
  const Words& words = kWords[static_cast<std::size_t>(kind)];
  std::array<char, 64> head{};
  std::snprintf(head.data(), head.size(), "%s for %g s: ", words.motion, options_.window_s);
  warning.text =
      head.data() + compressed(warning.parameters) + " " + words.missing + " - " + words.advice;
  constexpr std::size_t kMostWarnings = 1000;  // of a run that goes on for days, the latest
  if (warnings_.size() == kMostWarnings) warnings_.erase(warnings_.begin());
  warnings_.push_back(std::move(warning));
}

}  // namespace viwo

#include "viwo/filter/excitation_monitor.hpp"

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

int first_column(const WheelsView& wheels) {
  if (wheels.extrinsics_column >= 0) return wheels.extrinsics_column;
  if (wheels.time_offset_column >= 0) return wheels.time_offset_column;
  return wheels.intrinsics_column;
}

/// Prior sigmas of the blocks that have columns, as they stand in the state.
Eigen::VectorXd sigmas(const WheelsPrior& prior) {
  Eigen::VectorXd all(kPoseSize + 1 + prior.sigma_intrinsics.size());
  Index n = 0;
  const auto add = [&](int column, const auto& block) {
    if (column < 0) return;
    all.segment(n, block.size()) = block;
    n += block.size();
  };
  add(prior.wheels.extrinsics_column, prior.sigma_extrinsics);
  add(prior.wheels.time_offset_column, Eigen::VectorXd::Constant(1, prior.sigma_time_offset_s));
  add(prior.wheels.intrinsics_column, prior.sigma_intrinsics);
  return all.head(n);
}

}  // namespace

ExcitationMonitor::ExcitationMonitor(const MonitorOptions& options, const WheelsPrior& prior)
    : options_(options),
      information_(first_column(prior.wheels), sigmas(prior), bins_of(options)),
      motion_(bins_of(options)),
      n_bins_(bins_of(options)) {
  const WheelsView& wheels = prior.wheels;
  ModelDescription description;
  if (wheels.model != nullptr) wheels.model->describe(description);
  while (static_cast<Index>(description.intrinsics.size()) < wheels.x_WI.size()) {
    IntrinsicSpec& unnamed = description.intrinsics.emplace_back();
    unnamed.name = "intrinsic_" + std::to_string(description.intrinsics.size());
  }
  const auto names = calibration_names(prior.name, description.intrinsics);
  const auto place = [](int begin, int column, int size, int at) {
    return begin >= 0 && column >= begin && column < begin + size ? column - begin + at : -1;
  };
  for (const int column : information_.columns()) {
    int i = place(wheels.extrinsics_column, column, kPoseSize, 0);
    if (i < 0) i = place(wheels.time_offset_column, column, 1, kPoseSize);
    if (i < 0) i = column - wheels.intrinsics_column + kPoseSize + 1;
    names_.push_back(names[static_cast<std::size_t>(i)]);
    const bool tilt = i == 0 || i == 1 || i == kPoseSize - 1;  // about x and y, and along z
    needs_.push_back(tilt ? Need::kTilt : i == kPoseSize ? Need::kClock : Need::kPlanar);
  }
  sigma_ratio_.reserve(names_.size());
}

void ExcitationMonitor::add_motion(const Filter& filter, const WheelsView& wheels,
                                   std::span<const ImuSample> imu) {
  // The rate is a mean over the epoch: single readings shake.
  Vector3d w_IinI = Vector3d::Zero();
  for (const ImuSample& sample : imu) w_IinI += to_vector(sample.gyro_rad_per_s);
  w_IinI = w_IinI / static_cast<double>(imu.size()) - filter.imu().gyro_bias;
  const Vector3d w_OinO = wheels.R_ItoO * w_IinI;
  const Vector3d v_IinO = wheels.R_ItoO * (filter.imu().R_GtoI * filter.imu().v_IinG);
  const double span_s = seconds_between(imu.front().t_ns, imu.back().t_ns);
  const double noise = filter.options().imu_noise.gyro_rad_per_s_sqrt_hz;
  const double sigma_w = span_s > 0. ? noise / std::sqrt(span_s) : 0.;
  motion_.add(v_IinO - w_OinO.cross(wheels.p_IinO), w_OinO, sigma_w);
}

bool ExcitationMonitor::epoch(const Filter& filter, const WheelsView& wheels,
                              std::span<const ImuSample> imu) {
  measured_ = false;
  has_news_ = false;
  if (imu.empty()) return false;
  if (!bin_begin_ns_) bin_begin_ns_ = imu.front().t_ns;
  add_motion(filter, wheels, imu);
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
  // Wheels that stand, and tilts that are noise, are counted as motion by the Jacobians (F-21).
  const bool still = motion[static_cast<std::size_t>(Degeneracy::kStandstill)];
  InformationWindow::Vector believed(information_.sigma().size());
  for (std::size_t i = 0; i < needs_.size(); ++i) {
    const double part = needs_[i] == Need::kTilt ? motion_.tilt_signal() : 1.;
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
      {"constant steering", "cannot be told apart", "steer while turning"},
      {"constant speed and turn rate", "cannot be learned", "speed up, slow down or steer"},
      {"flat ground", "cannot be learned", "drive over slopes or hold them"},
  }};
  ExcitationWarning warning;
  warning.t_ns = t_ns;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    const bool concerned =
        kind == Degeneracy::kStandstill ||
        (kind == Degeneracy::kSteadyVelocity && needs_[i] == Need::kClock) ||
        (kind == Degeneracy::kFlatGround && needs_[i] == Need::kTilt) ||
        ((kind == Degeneracy::kNoYawRate || kind == Degeneracy::kConstantSteering) &&
         needs_[i] == Need::kPlanar);
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
  warnings_.push_back(std::move(warning));
}

}  // namespace viwo

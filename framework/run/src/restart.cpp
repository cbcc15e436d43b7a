#include "restart.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "viwo/math/so3.hpp"
#include "viwo/setup/calibration_values.hpp"

namespace viwo {
namespace {

constexpr double kEveryS = 1.;
/// Since it was loosened last: it has found contact again.
constexpr double kLostForS = 10.;
/// Contact is found to be lost so long afterwards at most.
constexpr std::int64_t kFoundLateNs = 5'000'000'000;
constexpr double kMostSigmas = 4.;

}  // namespace

HealthyState::HealthyState(const Filter& filter)
    : declared_(filter.blocks().specs().begin(), filter.blocks().specs().end()) {}

HealthyState::State HealthyState::state_of(const Filter& filter) const {
  const ImuState& imu = filter.imu();
  State state{filter.t_ns(), {imu.R_GtoI, imu.p_IinG, filter.t_ns(), imu.v_IinG.norm()}, {}};
  for (std::size_t i = 0; i < declared_.size(); ++i) {
    state.blocks.push_back(filter.blocks().value(i));
  }
  return state;
}

void HealthyState::epoch(const Estimator& estimator) {
  const Filter& filter = estimator.filter();
  newest_ns_ = filter.t_ns();
  if (!first_) first_ = state_of(filter);
  const std::int64_t before = std::exchange(loosened_, estimator.contact().loosened());
  if (loosened_ > before) {
    if (!lost_ns_) lost_ns_ = newest_ns_ - kFoundLateNs;
    last_lost_ns_ = newest_ns_;
  }
  if (last_lost_ns_ && seconds_between(*last_lost_ns_, newest_ns_) < kLostForS) return;
  lost_ns_.reset();
  last_lost_ns_.reset();
  if (!states_.empty() && seconds_between(states_.back().t_ns, newest_ns_) < kEveryS) return;
  states_.push_back(state_of(filter));
  while (seconds_between(states_.front().t_ns, newest_ns_) > 2. * kCalibrationAgeS) {
    states_.pop_front();
  }
}

bool HealthyState::is_kept(std::size_t block, const std::vector<double>& value) const {
  const BlockSpec& spec = declared_[block];
  // Other blocks may be tied to a world that the filter has lost. Where this settles is what was
  // declared.
  if (!is_of_the_rig(spec.name) || spec.process == Process::kGaussMarkov) return false;
  constexpr double kRounding = 1e-9;
  const auto is_near = [&](std::size_t entry, double off) {
    return std::abs(off) <= kMostSigmas * spec.entries[entry].sigma + kRounding;
  };
  const auto rotations = static_cast<std::size_t>(spec.rotations);
  for (std::size_t k = 0; k < rotations; ++k) {
    const Eigen::Map<const Eigen::Matrix3d> R(value.data() + 9 * k), R0(spec.value.data() + 9 * k);
    const Eigen::Vector3d off = log_so3(R * R0.transpose());
    for (std::size_t i = 0; i < 3; ++i) {
      if (!is_near(3 * k + i, off[static_cast<Eigen::Index>(i)])) return false;
    }
  }
  for (std::size_t i = 9 * rotations; i < value.size(); ++i) {
    if (!is_near(i - 6 * rotations, value[i] - spec.value[i])) return false;
  }
  return true;
}

Continuation HealthyState::after_failure() {
  const std::int64_t well_ns = lost_ns_.value_or(newest_ns_);
  const auto newest_before = [&](double age_s) -> const State* {
    const State* found = nullptr;
    for (const State& state : states_) {
      if (seconds_between(state.t_ns, well_ns) >= age_s) found = &state;
    }
    return found;
  };
  if (const State* state = newest_before(kCalibrationAgeS)) {
    last_.blocks.clear();
    // What is known of blocks of a group before hangs together: they are kept together.
    const auto is_kept_with_others = [&](std::size_t i) {
      for (std::size_t k = 0; k < declared_.size(); ++k) {
        const bool is_tied =
            k == i || (!declared_[i].group.empty() && declared_[k].group == declared_[i].group);
        if (is_tied && !is_kept(k, state->blocks[k])) return false;
      }
      return true;
    };
    for (std::size_t i = 0; i < declared_.size(); ++i) {
      if (is_kept_with_others(i)) last_.blocks.emplace_back(declared_[i].name, state->blocks[i]);
    }
  }
  if (const State* state = newest_before(kPlaceAgeS)) {
    last_.place = state->place;
  } else if (first_) {
    last_.place = first_->place;
  }
  states_.clear();
  first_.reset();
  lost_ns_.reset();
  last_lost_ns_.reset();
  loosened_ = 0;
  return last_;
}

std::optional<FilterSetup> again(const FilterSetup& setup, const Continuation& continuation) {
  FilterSetup next = setup;
  next.options.continuation = continuation;
  for (FilterSetup::Entry& entry : next.updates) {
    if (!entry.make_again) return std::nullopt;
    entry.update = entry.make_again();
    entry.rig = std::make_shared<Rig>(*entry.rig);
  }
  return next;
}

}  // namespace viwo

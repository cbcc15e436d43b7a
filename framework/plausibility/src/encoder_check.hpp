// Whether the encoders of a base fit each other: units of the steering angles, and signs and order
// of the channels, tried one change at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sensor_name.hpp"
#include "stuck_channel.hpp"
#include "viwo/plausibility/change_trial.hpp"
#include "viwo/plausibility/finding.hpp"
#include "viwo/plausibility/parity_watch.hpp"
#include "viwo/setup/filter_setup.hpp"
#include "viwo/wheel/twist_solver.hpp"

namespace viwo {

class EncoderCheck {
 public:
  EncoderCheck(const SensorName& wheels, const WheelSet& set);

  /// Samples in time order; the twist that they say, if they say one.
  std::optional<Twist> add(const EncoderSample& sample);
  /// By what each unit of the prior of the intrinsics, P = root root^T, changes the yaw rate of the
  /// sample last added.
  Intrinsics rate_by_prior() const {
    return prior_root_.transpose() * solution_.J_xi_WI.row(2).transpose();
  }
  /// Times in texts count from `zero_ns`.
  void findings(std::int64_t zero_ns, Findings& out) const;

 private:
  void add_by_prior(const EncoderSample& sample);
  void watch_steering(const EncoderSample& sample);
  void find_stuck(std::int64_t zero_ns, Findings& out) const;
  void find_jumps(std::int64_t zero_ns, Findings& out) const;
  void find_degrees(Findings& out) const;
  void find_change(Findings& out) const;
  void find_gross(std::int64_t zero_ns, Findings& out) const;

  std::string name_, sensor_;
  TwistSolver solver_;
  TwistSolution solution_;
  IntrinsicMatrix prior_root_;
  int n_steer_;
  ChangeTrial trial_;
  ParityWatch parity_;
  double by_prior_squares_ = 0., by_prior_count_ = 0.;  ///< at the ends of gross pieces
  std::vector<StuckChannel> drives_;
  std::int64_t samples_ = 0;
  std::optional<EncoderSample> last_;
  std::int64_t beyond_turn_ = 0, too_fast_ = 0;  ///< samples with such steering angles
  double largest_steer_ = 0.;
  std::int64_t impossible_ = 0, first_impossible_ns_ = 0;  ///< samples of impossible speeds
  double fastest_m_per_s_ = 0.;
};

}  // namespace viwo

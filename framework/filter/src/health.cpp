#include "viwo/filter/health.hpp"

#include <algorithm>
#include <cstdio>
#include <string>
#include <utility>

namespace viwo {
namespace {

constexpr double kPeriodS = 0.5;        ///< longer where there are few measurements ...
constexpr double kLongestPeriodS = 5.;  ///< ... but not for ever
constexpr std::int64_t kFewest = 5;     ///< measurements of a period that say something
constexpr int kMostPeriods = 8;         ///< lost, less those in touch

std::string beyond(const char* what, double value, double limit, const char* unit) {
  char text[160];
  std::snprintf(text, sizeof text, "%s is %.3g %s, more than %.3g", what, value, unit, limit);
  return text;
}

}  // namespace

std::string failure_of(const Filter& filter, const HealthLimits& limits) {
  if (filter.covariance_failed()) {
    return "the covariance of the clones is not positive definite any more";
  }
  const ImuState& imu = filter.imu();
  const Eigen::MatrixXd& P = filter.covariance();
  const bool finite = imu.R_GtoI.allFinite() && imu.p_IinG.allFinite() && imu.v_IinG.allFinite() &&
                      imu.gyro_bias.allFinite() && imu.accel_bias.allFinite() &&
                      P.diagonal().allFinite();
  if (!finite) return "the estimate or its covariance is not finite any more";
  if ((P.diagonal().array() < 0.).any()) return "a variance is negative";
  const std::string block = filter.blocks().not_finite();
  if (!block.empty()) return "the block '" + block + "' is not finite any more";
  const double speed = imu.v_IinG.norm(), gyro = imu.gyro_bias.norm(),
               accel = imu.accel_bias.norm();
  if (speed > limits.max_speed_m_per_s) {
    return beyond("the speed", speed, limits.max_speed_m_per_s,
                  "m/s (estimator.max_speed_m_per_s)");
  }
  if (gyro > limits.max_gyro_bias_rad_per_s) {
    return beyond("the gyro bias", gyro, limits.max_gyro_bias_rad_per_s, "rad/s");
  }
  if (accel > limits.max_accel_bias_m_per_s2) {
    return beyond("the accelerometer bias", accel, limits.max_accel_bias_m_per_s2, "m/s^2");
  }
  return "";
}

Contact::Verdict Contact::verdict(std::span<const UpdateCounts> counts) const {
  Verdict verdict = Verdict::kNone;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const std::int64_t applied = counts[i].applied - before_[i].applied;
    const std::int64_t rejected = counts[i].rejected - before_[i].rejected;
    if (applied + rejected < kFewest) continue;
    if (5 * applied > applied + rejected) return Verdict::kAgrees;
    verdict = Verdict::kContradicts;
  }
  return verdict;
}

std::string Contact::epoch(std::span<const UpdateCounts> counts, Filter& filter) {
  const std::int64_t t_ns = filter.t_ns();
  if (before_.empty()) {
    before_.assign(counts.begin(), counts.end());
    begin_ns_ = t_ns;
  }
  const double period_s = seconds_between(begin_ns_, t_ns);
  if (period_s < kPeriodS) return "";
  const Verdict says = verdict(counts);
  if (says == Verdict::kNone && period_s < kLongestPeriodS) return "";
  std::copy(counts.begin(), counts.end(), before_.begin());
  const std::int64_t begin_ns = std::exchange(begin_ns_, t_ns);
  if (says != Verdict::kContradicts) {
    lost_periods_ = 0;
    if (says == Verdict::kAgrees) balance_ = std::max(0, balance_ - 1);
    return "";
  }
  ++lost_periods_;
  if (balance_++ == 0) lost_since_ns_ = begin_ns;
  if (balance_ == kMostPeriods) {
    char text[24];
    std::snprintf(text, sizeof text, "%.1f s", seconds_between(lost_since_ns_, t_ns));
    return std::string("all updates have contradicted the estimate for ") + text +
           ": check units, axes and clock of the IMU, then calibration and noise of the other "
           "sensors";
  }
  if (loosened_++ == 0) first_ns_ = begin_ns;
  filter.loosen(lost_periods_);
  return "";
}

}  // namespace viwo

// What the sums of TwistCheck say.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>

#include "twist_check.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/plausibility/channel_change.hpp"
#include "viwo/plausibility/imu_axes.hpp"

namespace viwo {
namespace {

constexpr std::int64_t kFewestWindows = 40;  ///< 8 s
constexpr std::int64_t kFewestUpright = 15;  ///< of them, for a verdict on gravity
constexpr double kLeastRate = 0.05;          ///< rad/s, standard deviation about the mean
constexpr double kAlike = 0.9;               ///< correlation
constexpr double kVeryAlike = 0.98;
constexpr double kFactorTolerance = 0.15;

bool is_about(double value, double wanted) {
  return std::abs(value / wanted - 1.) < kFactorTolerance;
}

/// No base is said to be so much wider than it is.
bool is_beyond_scale(double slope) { return std::abs(slope) > 2. || std::abs(slope) < 0.5; }

/// The quarter or half turn that takes the axis next to `is` to z.
Eigen::Matrix3d upright(const Eigen::Vector3d& is) {
  int i = 0;
  is.cwiseAbs().maxCoeff(&i);
  if (i == 2 && is.z() < 0.) return Eigen::Vector3d(1., -1., -1.).asDiagonal();
  const Eigen::Vector3d axis = i == 2 ? is : std::copysign(1., is[i]) * Eigen::Vector3d::Unit(i);
  return Eigen::Quaterniond::FromTwoVectors(axis, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

}  // namespace

bool TwistCheck::finds_slip(std::int64_t zero_ns, Findings& out) const {
  if (!slip_ || !slip_->is_fault()) return false;
  out.push_back({wheels_ + " slip", wheels_ + ": " + slip_->text(imu_, zero_ns, "")});
  return true;
}

/// They have little in common, and it is no lag, no sign, no unit and no slip.
bool TwistCheck::finds_disagreement(Findings& out) const {
  if (!disagreement_) return false;
  // What the wheels may be off by, for all that is known of them before. Of those that can
  // contradict each other a filter leaves out the one that is wrong.
  const double by_prior = std::sqrt(prior_squares_ / std::max(1., static_cast<double>(rates_)));
  out.push_back({wheels_ + " yaw",
                 wheels_ + ": turn otherwise than " + imu_ + " for " +
                     significant(100. * disagreement_->part, 2) +
                     " % of the time that they move, by " +
                     significant(disagreement_->median_rad_per_s, 2) +
                     " rad/s (median): a drive with another gear or other counts than the others, "
                     "one that is not read, order or zeros of the channels, or the gyro",
                 false,
                 {},
                 !is_redundant_ && disagreement_->median_rad_per_s > 2. * by_prior});
  return true;
}

void TwistCheck::findings(const Eigen::Vector3d& up, std::int64_t zero_ns, Findings& out) const {
  const double n = static_cast<double>(std::max<std::int64_t>(windows_, 1));
  const Entries mean = sum_ / n;
  const Eigen::MatrixXd C = products_ / n - mean * mean.transpose();  // covariance
  const bool turns = windows_ >= kFewestUpright && C(kWheels, kWheels) > 0. &&
                     std::max(C(kGyro, kGyro), C(kWheels, kWheels)) > kLeastRate * kLeastRate;
  const double r =
      turns ? C(kGyro, kWheels) / std::sqrt(C(kGyro, kGyro) * C(kWheels, kWheels)) : 0.;
  // Both have noise: the ratio of what they scatter.
  const double slope = turns && std::abs(r) > kAlike
                           ? std::copysign(std::sqrt(C(kGyro, kGyro) / C(kWheels, kWheels)), r)
                           : 0.;
  if (gyro_is_ == Gyro::kMounted && finds_gravity(up, slope, out)) return;
  if (windows_ < kFewestWindows) return;
  const bool slips = finds_slip(zero_ns, out);
  if (slope != 0.) {
    if (find_factor(slope, r, C, out)) return;
    const bool lags = !slips && find_lag(C(kGyro, kGyro), out);  // which slip looks like
    if (!slips && !lags && finds_disagreement(out)) return;      // by more than a factor and a bias
    find_axes(C, out);
    return;
  }
  if (slips) return;
  // A lag of tenths of a second, and they are not alike any more.
  if (turns && r > 0. && find_lag(C(kGyro, kGyro), out)) return;
  // It turns by next to nothing of what the wheels do.
  constexpr double kStuck = 0.1, kRounding = 1e-6;
  const double gyro = std::sqrt(std::max(0., C(kGyro, kGyro))),
               wheels = std::sqrt(C(kWheels, kWheels));
  if (wheels > kLeastRate && gyro < kStuck * wheels) {
    out.push_back({imu_ + " rate",
                   imu_ + ": turns by " + significant(gyro, 2) +
                       " rad/s (standard deviation) where " + wheels_ + " turn by " +
                       significant(wheels, 2) +
                       ": it is stuck or not upright, or the wheels are wrong "
                       "(signs, order, zeros of the steering)",
                   false,
                   {},
                   gyro < kRounding * (1e-3 + std::abs(mean[kGyro]))});
    return;
  }
  if (finds_disagreement(out)) return;
  find_turned(C, out);
}

/// Whether the accelerometer feels what the velocity of the wheels tells, in size.
bool TwistCheck::accelerates_as_wheels(const Eigen::MatrixXd& C) const {
  if (gyro_is_ != Gyro::kMounted) return false;
  constexpr double kPart = 0.5;
  double covariance = 0., variance = 0.;
  for (int i = 0; i < 2; ++i) {
    Entries told = Entries::Zero();
    told[kChange + i] = told[kTurn + i] = 1.;
    covariance += C.row(kForce + i).dot(told);
    variance += told.dot(C * told);
  }
  return covariance > kPart * variance;
}

/// The rates are alike but for a factor.
bool TwistCheck::find_factor(double slope, double r, const Eigen::MatrixXd& C,
                             Findings& out) const {
  const std::string fast = significant(std::abs(slope), 3) + " times as fast as the wheels";
  const std::string slow = significant(1. / std::abs(slope), 3) + " times as fast as the gyro";
  constexpr double kDeg = 180. / std::numbers::pi;
  constexpr double kOpposite = 2.;  // a sign, and intrinsics that are to be found
  constexpr std::array<std::pair<double, const char*>, 3> kUnits{
      {{1. / kDeg, "deg/s"},
       {std::numbers::pi / 30., "revolutions per minute"},
       {2. * std::numbers::pi, "revolutions per second"}}};
  const auto unit = std::ranges::find_if(
      kUnits, [slope](const auto& one) { return is_about(std::abs(slope), one.first); });
  const std::string key = imu_ + " rate";
  if (is_about(std::abs(slope), kDeg)) {
    out.push_back({key,
                   imu_ + ": the gyro turns " + fast +
                       (gyro_is_ == Gyro::kHeading ? ": it is in degrees (yaw_unit: deg)"
                                                   : ": it is in deg/s"),
                   false,
                   {{gyro_unit_, "deg"}}});
  } else if (is_about(std::abs(slope), 1. / kDeg) && accelerates_as_wheels(C)) {
    out.push_back({key,
                   imu_ + ": turns " + significant(std::abs(slope), 3) +
                       " times as fast as the wheels, which accelerate as it does: its gyro is in "
                       "rad/s, not in deg/s",
                   false,
                   {{gyro_unit_, "rad"}}});
  } else if (unit != kUnits.end()) {
    out.push_back({key,
                   wheels_ + ": turn " + slow + ": drives are in " + unit->second,
                   false,
                   {drives_times(unit->first)}});
  } else if (slope < -1. / kOpposite && slope > -kOpposite) {
    find_reversed(C, out);
  } else if (std::abs(slope - 1.) > factor_tolerance() && std::abs(r) > kVeryAlike) {
    out.push_back({key,
                   imu_ + ": the gyro turns " + significant(slope, 3) +
                       " times as fast as the wheels (correlation " + significant(r, 3) +
                       "): unit or scale of the drives, radii and track of the kinematics, "
                       "or scale of the gyro",
                   false,
                   {},
                   gyro_is_ == Gyro::kLevel || is_beyond_scale(slope)});
  } else {
    return false;
  }
  return true;
}

/// By what part the two rates may differ: by more where the intrinsics are to be found first, such
/// as those of a base that skids.
double TwistCheck::factor_tolerance() const {
  const double sigma = rate_squares_ > 0. ? rate_products_.norm() / rate_squares_ : 0.;
  return std::max(kFactorTolerance, 3. * sigma);
}

Remedy TwistCheck::drives_times(double scale) const {
  const auto entry = [scale](std::size_t) { return significant(scale, 10); };
  return {drive_scale_, yaml_list(static_cast<std::size_t>(n_drive_), entry)};
}

/// The mounting with a turn of the IMU on the base.
Remedy TwistCheck::turned_by(const Eigen::Matrix3d& R) const {
  const Eigen::Matrix3d M = R * R_ItoO_;
  const double pitch = std::asin(std::clamp(-M(2, 0), -1., 1.));
  const bool is_singular = std::abs(M(2, 0)) > 1. - 1e-9;
  const double roll = is_singular ? 0. : std::atan2(M(2, 1), M(2, 2));
  const double yaw = is_singular ? std::atan2(-M(0, 1), M(1, 1)) : std::atan2(M(1, 0), M(0, 0));
  const auto text = [](double angle) {
    return significant(1e-6 * std::round(1e6 * angle) + 0., 8);
  };
  return {"wheels.rpy_ItoO_rad", "[" + text(roll) + ", " + text(pitch) + ", " + text(yaw) + "]"};
}

/// A base that drives on the ground is level on average, to the 30 deg of the worst ramp.
bool TwistCheck::finds_gravity(const Eigen::Vector3d& up, double slope, Findings& out) const {
  const Eigen::Vector3d is = R_ItoO_ * up;
  if (windows_ < kFewestUpright || up.norm() < 0.7 || is.z() > std::sqrt(0.75) * up.norm()) {
    return false;
  }
  std::string text = imu_ + ": gravity is on " + axis_of(up) +
                     " where wheels.rpy_ItoO_rad puts it on " + axis_of(R_ItoO_.row(2)) + ": ";
  Finding finding{imu_ + " up", ""};
  const bool is_opposite = is.z() < -std::sqrt(0.75) * up.norm();
  if (is_opposite && slope < 0.) {
    text += "the IMU is mounted upside down, or its axes are exchanged";
  } else if (is_opposite && slope > 0.) {
    text += "the gyro turns as the wheels do: sign of the accelerometer (at rest it reads upwards)";
  } else {
    text += "the IMU is mounted otherwise, its axes are exchanged or reversed";
  }
  finding.text = text;
  finding.is_doubt = true;
  if (!is_opposite || slope <= 0.) finding.remedies = {turned_by(upright(is))};
  out.push_back(std::move(finding));
  return true;
}

/// What may be wrong when the gyro turns opposite to the wheels. Both ends of a base with steered
/// wheels look the same.
std::string TwistCheck::opposite() const {
  std::string text = gyro_is_ == Gyro::kHeading ? "sign of the heading (heading_scale: -1)"
                                                : "sign of the gyro's z";
  if (gyro_is_ == Gyro::kLevel) text += ", of the accelerometer (at rest it reads upwards)";
  text += ", sign of all drives, or drives on the left and on the right exchanged";
  if (n_steer_ > 0) {
    text +=
        "; zeros of the steering that are all off by half a turn look the same, the sign of the "
        "gyro then says which end is the front";
  }
  return text;
}

/// The gyro turns opposite to the wheels: the accelerometer says which of them is right, by the
/// sign that the change of velocity, and its turning, need to have.
void TwistCheck::find_reversed(const Eigen::MatrixXd& C, Findings& out) const {
  const auto left = [&C](double change, double turn) {
    double variance = 0.;
    for (int i = 0; i < 2; ++i) {
      Entries h = Entries::Zero();
      h[kForce + i] = 1.;
      h[kChange + i] = -change;
      h[kTurn + i] = -turn;
      variance += h.dot(C * h);
    }
    return variance;
  };
  const std::array<double, 3> variances = {left(1., 1.), left(-1., 1.), left(1., -1.)};
  const std::array<std::string, 3> texts = {
      imu_ +
          ": the gyro turns opposite to the wheels, the accelerometer agrees with them: sign of "
          "the gyro's z",
      wheels_ + ": drives turn and accelerate opposite to the IMU: sign of all drives",
      wheels_ +
          ": turn opposite to the IMU, and accelerate with it: drives on the left and on the "
          "right are exchanged"};
  std::array<std::size_t, 3> order = {0, 1, 2};
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return variances[a] < variances[b]; });
  const double all = C(kForce, kForce) + C(kForce + 1, kForce + 1);
  const bool is_clear = gyro_is_ == Gyro::kMounted && all > kLeastForce * kLeastForce &&
                        variances[order[0]] < 0.7 * all &&
                        variances[order[1]] - variances[order[0]] > 0.1 * all;
  Finding finding{imu_ + " rate",
                  imu_ + ": the gyro turns opposite to " + wheels_ + ": " + opposite()};
  finding.is_doubt = gyro_is_ == Gyro::kLevel;
  if (is_clear) finding.text = texts[order[0]];
  if (is_clear && order[0] == 1) finding.remedies = {drives_times(-1.)};
  out.push_back(std::move(finding));
}

/// What is left of the squared differences, for each lag, `information` being what is known of the
/// parts of [1, twist] in them.
auto TwistCheck::left_by_lag(const Eigen::Vector4d& information) const
    -> std::array<double, kLags> {
  const Eigen::Matrix4d N = lag_products_ + Eigen::Matrix4d(information.asDiagonal());
  const Eigen::LDLT<Eigen::Matrix4d> solver(N);
  std::array<double, kLags> left{};
  for (std::size_t i = 0; i < left.size(); ++i) {
    left[i] = lags_[i].squares - lags_[i].products.dot(solver.solve(lags_[i].products));
    left[i] /= static_cast<double>(lag_count_);
  }
  return left;
}

/// By how much the wheels' rate is before the gyro's: where the two differ least, whatever the
/// bias, and whatever wheels that are not quite as configured make of the base's motion.
bool TwistCheck::find_lag(double rate_variance, Findings& out) const {
  constexpr double kCell_s = 1e-9 * CellMeans<6>::kCellNs;
  // What makes them differ, slopes of the ground or slip, lasts for half a second.
  constexpr double kSame = 0.5 / kCell_s;
  constexpr double kPart = 0.05;  // of the turn; rad/m of the velocity
  const double n = static_cast<double>(lag_count_);
  if (gyro_is_ != Gyro::kMounted) return false;  // there is no wheels.t_OtoI_s
  if (n * kCell_s < 10.) return false;
  std::array<double, kLags> left = left_by_lag(Eigen::Vector4d::Zero());
  const double noise = *std::min_element(left.begin(), left.end());
  Eigen::Vector4d information = Eigen::Vector4d::Constant(kSame * noise / (kPart * kPart));
  information[0] = 0.;
  left = left_by_lag(information);
  const auto least =
      static_cast<std::size_t>(std::min_element(left.begin(), left.end()) - left.begin());
  if (least == 0 || least + 1 == left.size()) return false;
  const double bend = left[least - 1] - 2. * left[least] + left[least + 1];  // per cell^2
  // Without the lag they are alike.
  if (!(bend > 0.) || left[kMostLag] < 1.5 * left[least] || left[least] > 0.2 * rate_variance) {
    return false;
  }
  const double lag_s = kCell_s * (static_cast<double>(least) - kMostLag +
                                  0.5 * (left[least - 1] - left[least + 1]) / bend);
  const double sigma_s = kCell_s * std::sqrt(2. * left[least] / (bend * n / kSame));
  constexpr double kLeastLag_s = 0.01;
  if (std::abs(lag_s) < kLeastLag_s + 3. * std::hypot(sigma_t_OtoI_s_, sigma_s)) return false;
  const auto ms = [](double seconds) { return std::to_string(std::lround(1e3 * seconds)) + " ms"; };
  std::string text = wheels_ + (lag_s < 0. ? ": lags behind " : ": is ahead of ") + imu_ + " by " +
                     ms(std::abs(lag_s)) + ", beside the " + ms(t_OtoI_s_) + " of t_OtoI_s";
  if (sigma_t_OtoI_s_ > 0.) text += " (+- " + ms(sigma_t_OtoI_s_) + ")";
  text += " - wheels.t_OtoI_s: ";
  const std::string t_OtoI_s = significant(1e-3 * std::round(1e3 * (t_OtoI_s_ + lag_s)), 6);
  out.push_back({wheels_ + " lag", text + t_OtoI_s, false, {{"wheels.t_OtoI_s", t_OtoI_s}}});
  return true;
}

}  // namespace viwo

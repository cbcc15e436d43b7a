#include "viwo/sim/planar_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "viwo/api/status.hpp"
#include "viwo/math/se2.hpp"

namespace viwo::sim {
namespace {

constexpr double kFirstZeroOfJ0 = 2.404825557695773;
// Frequencies without a common multiple within an experiment, so that no pattern repeats.
constexpr double kDirectionHz = 0.11;
constexpr double kYawRateHz = 0.07;
constexpr double kSpeedHz = 0.043;
constexpr double kDirectionSwing = 1.5;  // rad
constexpr double kSweepS = 20.;
constexpr double kStraightenS = 2.;

double wave(double hz, double t) { return std::sin(2. * M_PI * hz * t); }

Twist along(double speed, double direction, double omega) {
  return {speed * std::cos(direction), speed * std::sin(direction), omega};
}

/// The swings of an ICR sweep, each times `amplitude`.
Twist sweep(double t, const MotionOptions& o, double amplitude) {
  return along(o.speed_m_per_s * (1. + amplitude * 0.3 * wave(kSpeedHz, t)),
               amplitude * kDirectionSwing * wave(kDirectionHz, t),
               amplitude * o.yaw_rate_rad_per_s * wave(kYawRateHz, t));
}

/// What a base does all day, a piece after the other, with a smooth change at the beginning of
/// each.
Twist mixed(double t, const MotionOptions& o) {
  constexpr double kPieceS = 20., kChangeS = 2.;
  const double v = o.speed_m_per_s, w = o.yaw_rate_rad_per_s;
  const std::array<Twist, 6> pieces = {sweep(t, o, 1.),  Twist(v, 0., 0.),  Twist(v, 0., w),
                                       Twist(0., v, 0.), Twist(0., 0., 0.), Twist(-v, 0., -w)};
  const double number = std::floor(std::max(t, 0.) / kPieceS);
  const auto now = static_cast<std::size_t>(std::fmod(number, 6.));
  const Twist& before = pieces[number > 0. ? (now + 5) % 6 : now];
  return before + smooth_step((t - number * kPieceS) / kChangeS) * (pieces[now] - before);
}

}  // namespace

double smooth_step(double u) {
  u = std::clamp(u, 0., 1.);
  return u * u * u * (10. + u * (6. * u - 15.));
}

double smooth_step_integral(double u) {
  const double within = std::clamp(u, 0., 1.);
  return within * within * within * within * (2.5 + within * (within - 3.)) + std::max(u - 1., 0.);
}

struct PlanarMotion::Entry {
  const char* name;
  Profile profile;
};

const std::vector<PlanarMotion::Entry>& PlanarMotion::entries() {
  static const std::vector<Entry> kEntries = {
      {"icr_sweep", [](double t, const MotionOptions& o) { return sweep(t, o, 1.); }},
      {"straight", [](double, const MotionOptions& o) { return Twist(o.speed_m_per_s, 0., 0.); }},
      {"lateral", [](double, const MotionOptions& o) { return Twist(0., o.speed_m_per_s, 0.); }},
      {"circle",
       [](double, const MotionOptions& o) {
         return Twist(o.speed_m_per_s, 0., o.yaw_rate_rad_per_s);
       }},
      {"stationary", [](double, const MotionOptions&) { return Twist(0., 0., 0.); }},
      {"figure_eight",
       [](double t, const MotionOptions& o) {
         return Twist(o.speed_m_per_s, 0.,
                      o.yaw_rate_rad_per_s * wave(1. / figure_eight_period_s(o), t));
       }},
      {"crab_varying",
       [](double t, const MotionOptions& o) {
         return along(o.speed_m_per_s, kDirectionSwing * wave(kDirectionHz, t), 0.);
       }},
      {"spin", [](double, const MotionOptions& o) { return Twist(0., 0., o.yaw_rate_rad_per_s); }},
      {"constant_steering",
       [](double t, const MotionOptions& o) -> Twist {
         return (1. + 0.5 * wave(kDirectionHz, t)) *
                Twist(o.speed_m_per_s, 0., o.yaw_rate_rad_per_s);
       }},
      {"pivot",
       [](double t, const MotionOptions& o) -> Twist {
         return o.yaw_rate_rad_per_s * (1. + 0.5 * wave(kDirectionHz, t)) *
                Twist(o.pivot_m.y(), -o.pivot_m.x(), 1.);
       }},
      {"sweep_then_straight",
       [](double t, const MotionOptions& o) {
         return sweep(t, o, 1. - smooth_step((t - kSweepS) / kStraightenS));
       }},
      {"mixed", mixed},
  };
  return kEntries;
}

const std::vector<std::string>& PlanarMotion::names() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> out;
    for (const Entry& entry : entries()) out.emplace_back(entry.name);
    return out;
  }();
  return kNames;
}

PlanarMotion::PlanarMotion(std::string_view name, const MotionOptions& options)
    : name_(name), options_(options) {
  for (const Entry& entry : entries()) {
    if (name == entry.name) profile_ = entry.profile;
  }
  if (profile_ != nullptr) return;
  std::string text = "no motion '" + name_ + "' - there are:";
  for (const std::string& known : names()) text += (text.back() == ':' ? " " : ", ") + known;
  throw InputError(text);
}

PlanarMotion::PlanarMotion(std::string name, std::function<Twist(double t_s)> twist)
    : name_(std::move(name)), given_(std::move(twist)) {
  options_.ramp_s = 0.;
}

double PlanarMotion::progress(double t) const {
  if (options_.ramp_s <= 0.) return t;
  return options_.ramp_s * smooth_step_integral(t / options_.ramp_s);
}

Twist PlanarMotion::twist(double t) const {
  if (given_) return given_(t);
  double ramp = 1.;
  if (options_.ramp_s > 0.) {
    ramp = smooth_step(t / options_.ramp_s);
  }
  return ramp * profile_(progress(t), options_);
}

double figure_eight_period_s(const MotionOptions& options) {
  return 2. * M_PI * kFirstZeroOfJ0 / options.yaw_rate_rad_per_s;
}

PoseIntegrator::PoseIntegrator(const PlanarMotion& motion, double max_step_s, double start_s)
    : motion_(motion), max_step_s_(max_step_s), t_(start_s) {
  if (!(max_step_s > 0.)) throw std::logic_error("max_step_s must be positive");
}

void PoseIntegrator::step(double h) {
  static const double kGauss = std::sqrt(3.) / 6.;
  const Twist a = motion_.twist(t_ + (0.5 - kGauss) * h);
  const Twist b = motion_.twist(t_ + (0.5 + kGauss) * h);
  // Body twists act from the right, which gives the commutator [a, b] its positive sign.
  const Eigen::Vector2d commutator = J2() * (a[2] * b.head<2>() - b[2] * a.head<2>());
  const double theta = 0.5 * h * (a[2] + b[2]);
  const Eigen::Vector2d rho =
      0.5 * h * (a.head<2>() + b.head<2>()) + 0.5 * kGauss * h * h * commutator;
  Eigen::Vector3d arc;
  arc << theta, sinc(0.5 * theta).value * (R2(0.5 * theta) * rho);
  g_ = compose(g_, arc);
}

const Eigen::Vector3d& PoseIntegrator::advance_to(double t) {
  if (t < t_) throw std::logic_error("poses must be asked for in time order");
  const double from = t_;
  const double n = std::ceil((t - from) / max_step_s_);
  for (double i = 0.; i < n; i += 1.) {
    t_ = from + (t - from) * (i / n);
    step((t - from) / n);
  }
  t_ = t;
  return g_;
}

}  // namespace viwo::sim

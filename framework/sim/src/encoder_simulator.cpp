#include "viwo/sim/encoder_simulator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>

#include "viwo/api/status.hpp"
#include "viwo/log/cells.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/sim/random.hpp"

namespace viwo::sim {
namespace {

/// A wheel that hardly rolls would have to turn by more than this to slip sideways as drawn, rad.
constexpr double kMostSteeringBySlip = 0.2;

/// Draws what disturbs the samples, and keeps the streams apart.
class Disturbances {
 public:
  Disturbances(const ModelDescription& description, const EncoderSimulation& options,
               std::uint64_t seed)
      : description_(description),
        options_(options),
        drive_(seed, Stream::kDriveNoise),
        steer_(seed, Stream::kSteerNoise),
        slip_(seed, Stream::kSlip),
        outliers_(seed, Stream::kOutliers) {}

  /// One number per noise source of kind kSlip, zero for the others, times its sigma.
  Eigen::VectorXd draw_slip() {
    Eigen::VectorXd n =
        Eigen::VectorXd::Zero(static_cast<Eigen::Index>(description_.noises.size()));
    for (Eigen::Index i = 0; i < n.size(); ++i) {
      const NoiseSpec& spec = description_.noises[static_cast<std::size_t>(i)];
      if (spec.kind == NoiseKind::kSlip) n[i] = spec.sigma * slip_.gaussian();
    }
    return n;
  }

  /// What the encoders of a base read whose channels are `y` at time `t` of the motion.
  EncoderSample read(EncoderSample y, double t) {
    slip_wheel(t, y);
    if (options_.noise) add_noise(y);
    add_outlier(y);
    const double step = options_.drive_resolution_rad_per_s;
    if (step > 0.) {
      for (int i = 0; i < y.n_drive; ++i) {
        double& rate = y.drive_rad_per_s[static_cast<std::size_t>(i)];
        rate = step * std::round(rate / step);
      }
    }
    return y;
  }

 private:
  void slip_wheel(double t, EncoderSample& y) const {
    for (const double start : options_.slip.start_s) {
      if (t >= start && t < start + options_.slip.duration_s) {
        y.drive_rad_per_s[static_cast<std::size_t>(options_.slip.wheel)] *=
            1. + options_.slip.ratio;
        return;
      }
    }
  }

  void add_noise(EncoderSample& y) {
    for (const NoiseSpec& spec : description_.noises) {
      const auto channel = static_cast<std::size_t>(spec.channel);
      if (spec.kind == NoiseKind::kDrive) {
        y.drive_rad_per_s[channel] += spec.sigma * drive_.gaussian();
      } else if (spec.kind == NoiseKind::kSteer) {
        y.steer_rad[channel] += spec.sigma * steer_.gaussian();
      }
    }
  }

  void add_outlier(EncoderSample& y) {
    // Three draws per sample, whatever happens: another probability keeps the others' places.
    const double hit = outliers_.uniform();
    const double where = outliers_.uniform();
    const double sign = outliers_.uniform() < 0.5 ? -1. : 1.;
    if (hit >= options_.outlier_probability) return;
    const auto channel = static_cast<std::size_t>(where * y.n_drive);
    y.drive_rad_per_s[channel] += sign * options_.outlier_rad_per_s;
  }

  const ModelDescription& description_;
  const EncoderSimulation& options_;
  RandomStream drive_;
  RandomStream steer_;
  RandomStream slip_;
  RandomStream outliers_;
};

/// Intrinsics that wander about true ones.
class Wander {
 public:
  Wander(const Intrinsics& truth, const EncoderSimulation& options, std::uint64_t seed)
      : truth_(truth),
        sigma_(options.sigma_wander),
        off_(sigma_),
        x_WI_(truth),
        kept_(std::exp(-1. / (options.rate_hz * options.wander_time_s))),
        random_(seed, Stream::kWander) {
    if (sigma_.size() == 0) return;
    for (Eigen::Index i = 0; i < truth.size(); ++i) off_[i] = sigma_[i] * random_.gaussian();
    x_WI_ += off_;
  }

  void step() {
    if (sigma_.size() == 0) return;
    const double gained = std::sqrt(1. - kept_ * kept_);
    for (Eigen::Index i = 0; i < off_.size(); ++i) {
      off_[i] = kept_ * off_[i] + gained * sigma_[i] * random_.gaussian();
    }
    x_WI_ = truth_ + off_;
  }

  const Intrinsics& x_WI() const { return x_WI_; }

 private:
  Intrinsics truth_, sigma_, off_, x_WI_;
  double kept_;
  RandomStream random_;
};

/// The encoder channels of a base that moves as it should.
class Base {
 public:
  Base(const KinematicModel& model, const ModelDescription& description, const Intrinsics& x_WI)
      : model_(model), description_(description), x_WI_(x_WI) {
    rows_.A.setZero(description.n_rows, 3);
    rows_.b.setZero(description.n_rows);
    y_.n_drive = description.n_drive;
    y_.n_steer = description.n_steer;
  }

  /// Moves on to twist `xi` without slip; the result starts the next one. What is followed of a
  /// small v_y that the base cannot follow is written back.
  bool follow(Twist& xi, double sliding_m_per_s) {
    const RowVector no_slip = RowVector::Zero(description_.n_rows);
    if (invert(xi, no_slip, y_) == Status::kOk) return true;
    if (!(std::abs(xi.y()) <= sliding_m_per_s)) return false;
    xi.y() = 0.;
    return invert(xi, no_slip, y_) == Status::kOk;
  }

  /// The channels at the twist of the last follow(), with slip where the model can realise it.
  EncoderSample with_slip(const Twist& xi, const Eigen::VectorXd& n) {
    if (n.isZero(0.) || model_.rows(y_, x_WI_, false, rows_) != Status::kOk) return y_;
    const auto m = description_.n_rows;
    NoiseDerivatives by_noise;
    by_noise.J.setZero(m, n.size());
    by_noise.DtE.setZero(3, n.size());
    model_.noise_derivatives(y_, x_WI_, rows_, rows_.b, xi, RowVector::Zero(m), by_noise);
    RowVector slip = RowVector::Zero(m);
    for (Eigen::Index i = 0; i < n.size(); ++i) {
      if (n[i] == 0.) continue;
      slip += by_noise.J.col(i) * n[i];
    }
    EncoderSample slipping = y_;
    if (invert(xi, slip, slipping) != Status::kOk) return y_;
    for (int i = 0; i < y_.n_steer; ++i) {
      const auto channel = static_cast<std::size_t>(i);
      const double turn = slipping.steer_rad[channel] - y_.steer_rad[channel];
      if (std::abs(turn) > kMostSteeringBySlip) return y_;
    }
    return slipping;
  }

  const EncoderSample& channels() const { return y_; }

 private:
  Status invert(const Twist& xi, const RowVector& slip, EncoderSample& y) const {
    EncoderSample candidate = y;
    Status status = model_.inverse(xi, x_WI_, slip, candidate);
    if (status == Status::kUnsupported) {
      candidate = y;
      status = solve_inverse(model_, description_, xi, x_WI_, slip, candidate);
    }
    if (status == Status::kOk) y = candidate;
    return status;
  }

  const KinematicModel& model_;
  const ModelDescription& description_;
  const Intrinsics& x_WI_;
  RowSystem rows_;
  EncoderSample y_;
};

[[noreturn]] void cannot_follow(std::string_view motion, const Twist& xi, double t) {
  std::array<char, 160> numbers{};
  std::snprintf(numbers.data(), numbers.size(),
                "v = [%.3g, %.3g] m/s, omega = %.3g rad/s after %.3g s", xi[0], xi[1], xi[2], t);
  throw InputError("this base cannot follow motion '" + std::string(motion) + "' (" +
                   numbers.data() + ")");
}

}  // namespace

void EncoderSimulation::make_exact() {
  noise = false;
  slip = {};
  sigma_wander.resize(0);
  outlier_probability = 0.;
  drive_resolution_rad_per_s = 0.;
}

std::int64_t sample_time_ns(std::int64_t k, double rate_hz) {
  return std::llround(static_cast<double>(k) * 1e9 / rate_hz);
}

std::vector<EncoderSample> simulate_encoders(const KinematicModel& model, const Intrinsics& truth,
                                             const std::function<Twist(double t_s)>& twist,
                                             std::string_view motion_name,
                                             const EncoderSimulation& options, std::uint64_t seed) {
  ModelDescription description;
  model.describe(description);
  if (options.slip.wheel < 0 || options.slip.wheel >= description.n_drive) {
    throw std::invalid_argument("slip: no wheel " + std::to_string(options.slip.wheel));
  }
  Disturbances disturbances(description, options, seed);
  Wander wander(truth, options, seed);
  Base base(model, description, wander.x_WI());
  // Wheels stand in the direction of the motion when it starts.
  Twist at_start = twist(std::max(options.time_offset_s, 0.) + 0.05);
  base.follow(at_start, options.sliding_m_per_s);
  std::vector<EncoderSample> samples;
  const std::int64_t end_ns = to_ns(options.duration_s);
  for (std::int64_t k = 0, t_ns = 0; t_ns <= end_ns; t_ns = sample_time_ns(++k, options.rate_hz)) {
    const double t = static_cast<double>(t_ns) * 1e-9 + options.time_offset_s;
    Twist xi = twist(t);
    if (!base.follow(xi, options.sliding_m_per_s)) cannot_follow(motion_name, xi, t);
    const EncoderSample exact =
        options.noise ? base.with_slip(xi, disturbances.draw_slip()) : base.channels();
    EncoderSample sample = disturbances.read(exact, t);
    sample.t_ns = options.start_ns + t_ns;
    samples.push_back(sample);
    wander.step();
  }
  log::make_cells(samples, std::numeric_limits<double>::infinity());
  return samples;
}

std::vector<EncoderSample> simulate_encoders(const KinematicModel& model, const Intrinsics& truth,
                                             const PlanarMotion& motion,
                                             const EncoderSimulation& options, std::uint64_t seed) {
  return simulate_encoders(
      model, truth, [&motion](double t_s) { return motion.twist(t_s); }, motion.name(), options,
      seed);
}

Intrinsics wander_sigmas(const ModelDescription& description, double prior_sigmas,
                         const std::vector<std::string>& of) {
  const auto begins = [](const IntrinsicSpec& spec, const std::string& name) {
    return !name.empty() && std::string_view(spec.name).starts_with(name);
  };
  const auto& specs = description.intrinsics;
  for (const std::string& name : of) {
    if (std::any_of(specs.begin(), specs.end(), [&](const auto& s) { return begins(s, name); })) {
      continue;
    }
    std::string known;
    for (const IntrinsicSpec& spec : specs) known += (known.empty() ? "" : ", ") + spec.name;
    throw ParamError("intrinsics_wander_of",
                     "no intrinsic of the model begins with '" + name + "' - there are " + known);
  }
  Intrinsics sigma = Intrinsics::Zero(static_cast<Eigen::Index>(specs.size()));
  for (Eigen::Index i = 0; i < sigma.size(); ++i) {
    const IntrinsicSpec& spec = specs[static_cast<std::size_t>(i)];
    const bool wanders = of.empty() || std::any_of(of.begin(), of.end(), [&](const auto& name) {
                           return begins(spec, name);
                         });
    if (wanders) sigma[i] = prior_sigmas * spec.prior_sigma;
  }
  return sigma;
}

Intrinsics perturbed_intrinsics(const ModelDescription& description, double scale,
                                std::uint64_t seed) {
  RandomStream stream(seed, Stream::kIntrinsics);
  Intrinsics x = nominal_intrinsics(description);
  const auto held = std::ranges::count_if(description.intrinsics, &IntrinsicSpec::gauge_fixed);
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const IntrinsicSpec& spec = description.intrinsics[static_cast<std::size_t>(i)];
    const double draw = stream.gaussian();  // of all, so that each keeps its draw
    // Also where the gauge will hold an entry: a robot does not know of that. A base that cannot
    // turn O about itself does not move sideways, and then O is where it turns.
    constexpr std::ptrdiff_t kPlacesAll = 3;
    if (!spec.gauge_fixed || held == kPlacesAll) x[i] += scale * spec.prior_sigma * draw;
  }
  return x;
}

}  // namespace viwo::sim

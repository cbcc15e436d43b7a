#include "viwo/robot/bench.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include <Eigen/QR>

namespace viwo::robot {
namespace {

void require(bool condition, const std::string& text) {
  if (!condition) throw InputError("describe(): " + text);
}

/// An empty range stands for all rows.
void fill(RowRange& range, int n_rows, const std::string& what) {
  if (range.count == 0) range = {0, n_rows};
  require(range.first >= 0 && range.count > 0 && range.first + range.count <= n_rows,
          "rows [" + std::to_string(range.first) + ", " +
              std::to_string(range.first + range.count) + ") of " + what + " are not among its " +
              std::to_string(n_rows));
}

template <class Matrix>
bool same(const Matrix& a, const Matrix& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() && [&] {
    for (Eigen::Index j = 0; j < a.cols(); ++j) {
      for (Eigen::Index i = 0; i < a.rows(); ++i) {
        const auto bits = [](double value) { return std::bit_cast<std::uint64_t>(value); };
        if (bits(a(i, j)) != bits(b(i, j))) return false;
      }
    }
    return true;
  }();
}

struct Motion {
  const char* name;
  Twist xi;
};

const std::vector<Motion>& motion_list() {
  static const std::vector<Motion> motions = {
      {"rest", {0., 0., 0.}},           {"straight", {0.5, 0., 0.}},
      {"reverse", {-0.5, 0., 0.}},      {"spin", {0., 0., 0.8}},
      {"arc", {0.5, 0., 0.6}},          {"tight arc", {0.3, 0., -1.5}},
      {"reverse arc", {-0.4, 0., 0.5}}, {"crab", {0.3, 0.3, 0.}},
      {"sideways", {0., 0.4, 0.}},      {"turning crab", {0.3, -0.2, 0.7}}};
  return motions;
}

}  // namespace

Bench::Bench(std::shared_ptr<const KinematicModel> model) : model_(std::move(model)) {
  ModelDescription& d = description_;
  model_->describe(d);
  const auto limit = [](const char* what, std::size_t value, std::size_t least, std::size_t most) {
    require(value >= least && value <= most,
            std::string(what) + " is " + std::to_string(static_cast<long>(value)) +
                ", it must be from " + std::to_string(least) + " to " + std::to_string(most));
  };
  limit("n_drive", static_cast<std::size_t>(d.n_drive), 1, kMaxDrives);
  limit("n_steer", static_cast<std::size_t>(d.n_steer), 0, kMaxSteers);
  limit("n_rows", static_cast<std::size_t>(d.n_rows), 1, kMaxRows);
  limit("the number of intrinsics", d.intrinsics.size(), 0, kMaxIntrinsics);
  limit("the number of noise sources", d.noises.size(), 1, kMaxNoises);
  for (IntrinsicSpec& spec : d.intrinsics) fill(spec.rows, d.n_rows, "'" + spec.name + "'");
  for (std::size_t i = 0; i < d.noises.size(); ++i) {
    fill(d.noises[i].rows, d.n_rows, noise_name(d.noises[i], static_cast<int>(i)));
  }
}

Intrinsics Bench::nominal() const { return nominal_intrinsics(description_); }

Intrinsics Bench::unequal(std::mt19937_64& rng) const {
  std::uniform_real_distribution<double> uniform(-1., 1.);
  Intrinsics x = nominal();
  for (int k = 0; k < n_x(); ++k) {
    const double sigma = description_.intrinsics[static_cast<std::size_t>(k)].prior_sigma;
    const double away = std::max(std::min(5. * std::abs(sigma), 0.2), 0.05 * std::abs(x[k]));
    x[k] += away * uniform(rng);
  }
  return x;
}

EncoderSample Bench::zero_reading() const {
  EncoderSample y;
  y.end_ns = 10'000'000;
  y.t_ns = 5'000'000;
  y.n_drive = description_.n_drive;
  y.n_steer = description_.n_steer;
  return y;
}

Answer Bench::empty_answer() const {
  Answer out;
  const int m = description_.n_rows;
  out.rows.A.setZero(m, 3);
  out.rows.b.setZero(m);
  out.by_x.J.setZero(m, n_x());
  out.by_x.DtE.setZero(3, n_x());
  out.by_n.J.setZero(m, n_noises());
  out.by_n.DtE.setZero(3, n_noises());
  return out;
}

std::optional<RowSystem> Bench::rows(const EncoderSample& y, const Intrinsics& x_WI) const {
  RowSystem rows;
  rows.A.setZero(description_.n_rows, 3);
  rows.b.setZero(description_.n_rows);
  if (model_->rows(y, x_WI, false, rows) != Status::kOk) return std::nullopt;
  return rows;
}

std::optional<RowVector> Bench::residual(const EncoderSample& y, const Intrinsics& x_WI,
                                         const Twist& xi) const {
  const auto system = rows(y, x_WI);
  if (!system) return std::nullopt;
  return RowVector(system->b - system->A * xi);
}

void Bench::answer(const Probe& probe, Signal signal, Answer& out) const {
  out.status = model_->rows(probe.y, probe.x_WI, false, out.rows);
  if (out.status != Status::kOk) return;
  // The measured signal is rows.b itself, as a model may want to know.
  const RowVector fit = out.rows.A * probe.xi;
  const RowVector& b = signal == Signal::kFitted ? fit : out.rows.b;
  model_->intrinsic_derivatives(probe.y, probe.x_WI, out.rows, b, probe.xi, probe.e, out.by_x);
  model_->noise_derivatives(probe.y, probe.x_WI, out.rows, b, probe.xi, probe.e, out.by_n);
}

Answer Bench::answer(const Probe& probe, Signal signal) const {
  Answer out = empty_answer();
  answer(probe, signal, out);
  return out;
}

bool Bench::solve_rows(const Intrinsics& x_WI, bool v_y_is_free, Twist& xi,
                       EncoderSample& y) const {
  const int n_drive = description_.n_drive, n_steer = description_.n_steer;
  const int n = n_drive + n_steer + (v_y_is_free ? 1 : 0);
  const auto moved = [&](const Eigen::VectorXd& step, EncoderSample& at, Twist& twist) {
    for (int i = 0; i < n_drive; ++i) at.drive_rad_per_s[static_cast<std::size_t>(i)] += step[i];
    for (int i = 0; i < n_steer; ++i) {
      at.steer_rad[static_cast<std::size_t>(i)] += step[n_drive + i];
    }
    if (v_y_is_free) twist.y() += step[n - 1];
  };
  const auto residual_at = [&](const Eigen::VectorXd& step) -> Eigen::VectorXd {
    EncoderSample at = y;
    Twist twist = xi;
    moved(step, at, twist);
    const auto r = residual(at, x_WI, twist);
    return r && r->allFinite() ? Eigen::VectorXd(*r)
                               : Eigen::VectorXd::Constant(description_.n_rows, 1e9);
  };
  for (int iteration = 0; iteration < 60; ++iteration) {
    const Eigen::VectorXd r = residual_at(Eigen::VectorXd::Zero(n));
    if (r.lpNorm<Eigen::Infinity>() < 1e-11) return true;
    constexpr double kStep = 1e-6;
    Eigen::MatrixXd J(r.size(), n);
    for (int k = 0; k < n; ++k) {
      const Eigen::VectorXd h = kStep * Eigen::VectorXd::Unit(n, k);
      J.col(k) = (residual_at(h) - residual_at(-h)) / (2. * kStep);
    }
    const Eigen::VectorXd step = -J.completeOrthogonalDecomposition().solve(r);
    double length = 1.;
    while (length > 1e-4 && residual_at(length * step).norm() >= r.norm()) length *= 0.5;
    if (length <= 1e-4) return r.lpNorm<Eigen::Infinity>() < 1e-9;
    moved(length * step, y, xi);
  }
  return false;
}

bool Bench::follow(const Intrinsics& x_WI, Twist& xi, EncoderSample& y) const {
  EncoderSample told = y;
  const RowVector no_slip = RowVector::Zero(description_.n_rows);
  if (model_->inverse(xi, x_WI, no_slip, told) == Status::kOk) {
    const auto r = residual(told, x_WI, xi);
    if (r && r->lpNorm<Eigen::Infinity>() < 1e-9) {
      y = told;
      return true;
    }
  }
  for (const bool v_y_is_free : {false, true}) {
    for (const double turn : {0., 0.4, -0.4, 1.2, -1.2}) {
      EncoderSample at = y;
      Twist twist = xi;
      for (int i = 0; i < description_.n_steer; ++i) {
        at.steer_rad[static_cast<std::size_t>(i)] += turn;
      }
      if (!solve_rows(x_WI, v_y_is_free, twist, at)) continue;
      y = at;
      xi = twist;
      return true;
    }
  }
  return false;
}

std::vector<Probe> Bench::motions() const {
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> uniform(-1., 1.);
  std::vector<Probe> probes;
  for (const bool equal : {true, false}) {
    const Intrinsics x_WI = equal ? nominal() : unequal(rng);
    for (const Motion& motion : motion_list()) {
      Probe probe{std::string(motion.name) + (equal ? "" : ", unequal parameters"),
                  zero_reading(),
                  x_WI,
                  motion.xi,
                  RowVector::Zero(description_.n_rows),
                  true};
      for (double& value : probe.e) value = uniform(rng);
      if (follow(x_WI, probe.xi, probe.y)) probes.push_back(probe);
    }
  }
  return probes;
}

std::vector<Probe> Bench::random_motions(int count, const Intrinsics& x_WI) const {
  std::mt19937_64 rng(9);
  std::uniform_real_distribution<double> uniform(-1., 1.);
  std::vector<Probe> probes;
  for (int i = 0; i < count; ++i) {
    Probe probe;
    probe.xi = Twist(0.8 * uniform(rng), 0.5 * uniform(rng), 1.2 * uniform(rng));
    probe.y = zero_reading();
    probe.x_WI = x_WI;
    probe.e = RowVector::Zero(description_.n_rows);
    probe.follows = true;
    if (follow(x_WI, probe.xi, probe.y)) probes.push_back(probe);
  }
  return probes;
}

std::vector<Probe> Bench::probes() const {
  std::vector<Probe> probes = motions();
  std::mt19937_64 rng(7);
  std::uniform_real_distribution<double> uniform(-1., 1.);
  const auto add = [&](const std::string& name, const auto& steering) {
    Probe probe{
        name, zero_reading(), unequal(rng), Twist::Zero(), RowVector::Zero(description_.n_rows),
        false};
    for (int i = 0; i < description_.n_drive; ++i) {
      probe.y.drive_rad_per_s[static_cast<std::size_t>(i)] = 10. * uniform(rng);
    }
    for (int i = 0; i < description_.n_steer; ++i) {
      probe.y.steer_rad[static_cast<std::size_t>(i)] = steering(i);
    }
    for (double& value : probe.xi) value = uniform(rng);
    for (double& value : probe.e) value = uniform(rng);
    probes.push_back(probe);
  };
  if (description_.n_steer > 0) {
    add("steering near +pi/2", [](int) { return 1.5; });
    add("steering near -pi/2", [](int) { return -1.5; });
    add("steering to both sides", [](int i) { return i % 2 == 0 ? 0.6 : -0.6; });
    add("steering past a half turn", [](int) { return 3.3; });
  }
  for (int i = 1; i <= 4; ++i) {
    add("wheels that contradict each other, " + std::to_string(i),
        [&](int) { return 1.2 * uniform(rng); });
  }
  return probes;
}

std::string noise_name(const NoiseSpec& noise, int index) {
  const std::string channel = std::to_string(noise.channel);
  const std::string what = noise.kind == NoiseKind::kDrive   ? "drive " + channel
                           : noise.kind == NoiseKind::kSteer ? "steering " + channel
                                                             : "slip " + channel;
  return "noise source " + std::to_string(index) + " (" + what + ")";
}

bool same_bits(const Answer& a, const Answer& b) {
  if (a.status != b.status) return false;
  if (a.status != Status::kOk) return true;
  return same(a.rows.A, b.rows.A) && same(a.rows.b, b.rows.b) && same(a.by_x.J, b.by_x.J) &&
         same(a.by_x.DtE, b.by_x.DtE) && same(a.by_n.J, b.by_n.J) && same(a.by_n.DtE, b.by_n.DtE);
}

}  // namespace viwo::robot

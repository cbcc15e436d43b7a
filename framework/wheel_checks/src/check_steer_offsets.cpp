#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>

#include "viwo/math/se2.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/plausibility/channel_change.hpp"
#include "viwo/series/wheel_calibration.hpp"
#include "viwo/wheel/twist_solver.hpp"
#include "viwo/wheel_checks/wheel_checks.hpp"

namespace viwo::inspect {

using series::Calibration;
using series::Recording;
using series::Wheels;

namespace {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

/// The contradictions of the wheels as a function of constants that are added to their steering
/// angles, of any kinematic model: its rows alone are asked.
class Offsets {
 public:
  /// `unit`: what the angles are multiplied by.
  explicit Offsets(const Wheels& wheels, double unit = 1.)
      : solver_(wheels.model, {}), n_(wheels.model->description().n_steer) {
    solver_.set_intrinsics(wheels.prior.wheels.x_WI);
    constexpr std::size_t kMost = 1500;
    samples_ = moving_samples(wheels, kMost);
    for (EncoderSample& sample : samples_) {
      for (double& angle : sample.steer_rad) angle *= unit;
    }
  }

  void set_intrinsics(const Intrinsics& x_WI) { solver_.set_intrinsics(x_WI); }
  int n() const { return n_; }
  std::size_t size() const { return samples_.size(); }

  /// Sum of squared residuals of samples k with k % parts != without.
  double cost(const Vector& offsets, int without = -1) {
    double sum = 0.;
    for (std::size_t k = 0; k < samples_.size(); ++k) {
      if (part_of(k) == without) continue;
      sum += residual(k, offsets).squaredNorm();
    }
    return sum;
  }

  /// Levenberg-Marquardt from `offsets`; the normal matrix at the end.
  struct Fit {
    Vector offsets;
    Matrix N;
    double cost = 0.;
  };
  Fit fit(Vector offsets, int without = -1) {
    Fit fit{std::move(offsets), Matrix::Zero(n_, n_), 0.};
    fit.cost = cost(fit.offsets, without);
    double damping = 1e-3;
    constexpr int kMostSteps = 25;
    for (int step = 0; step < kMostSteps; ++step) {
      Vector h = Vector::Zero(n_);
      linearise(fit.offsets, without, fit.N, h);
      Matrix D = fit.N;
      D.diagonal().array() += damping * fit.N.diagonal().maxCoeff() + 1e-12;
      const Vector d = D.ldlt().solve(-h);
      const Vector tried = fit.offsets + d;
      const double now = cost(tried, without);
      if (now < fit.cost) {
        const bool is_done = fit.cost - now < 1e-9 * fit.cost;
        fit.offsets = tried;
        fit.cost = now;
        damping = std::max(1e-9, damping / 10.);
        if (is_done || d.norm() < 1e-9) break;
      } else {
        damping *= 10.;
        if (damping > 1e6) break;
      }
    }
    return fit;
  }

  static constexpr int kParts = 8;

 private:
  int part_of(std::size_t k) const {
    return static_cast<int>(k * kParts / std::max<std::size_t>(1, samples_.size()));
  }

  RowVector residual(std::size_t k, const Vector& offsets) {
    EncoderSample sample = samples_[k];
    for (int i = 0; i < n_; ++i) sample.steer_rad[static_cast<std::size_t>(i)] += offsets[i];
    if (solver_.solve(sample, solution_) != Status::kOk) return RowVector::Zero(1);
    return solution_.e;
  }

  void linearise(const Vector& offsets, int without, Matrix& N, Vector& h) {
    constexpr double kStep = 1e-5;
    N.setZero();
    for (std::size_t k = 0; k < samples_.size(); ++k) {
      if (part_of(k) == without) continue;
      const RowVector e = residual(k, offsets);
      Matrix J(e.size(), n_);
      for (int i = 0; i < n_; ++i) {
        Vector there = offsets;
        there[i] += kStep;
        const RowVector other = residual(k, there);
        if (other.size() != e.size()) return;
        J.col(i) = (other - e) / kStep;
      }
      N += J.transpose() * J;
      h += J.transpose() * e;
    }
  }

  TwistSolver solver_;
  TwistSolution solution_;
  int n_;
  std::vector<EncoderSample> samples_;
};

/// Offsets that have a direction free (all wheels turned alike are a base that is turned) are moved
/// along it to where most of them are none.
Vector sparsest(const Vector& offsets, const Vector& free) {
  Vector best = offsets;
  for (int i = 0; i < offsets.size(); ++i) {
    if (std::abs(free[i]) < 1e-3) continue;
    const Vector moved = offsets - offsets[i] / free[i] * free;
    if (moved.lpNorm<1>() < best.lpNorm<1>()) best = moved;
  }
  return best;
}

std::string list_of(const Vector& values) {
  return yaml_list(static_cast<std::size_t>(values.size()), [&](std::size_t i) {
    return significant(1e-4 * std::round(1e4 * values[static_cast<Eigen::Index>(i)]) + 0., 6);
  });
}

struct Found {
  Vector offsets, sigma;
  double cost_before = 0., cost = 0.;
};

/// From zero, and from each wheel alone off by an eighth and a quarter of a turn: angles have
/// several valleys.
Offsets::Fit best_fit(Offsets& problem, double cost_before) {
  Offsets::Fit best = problem.fit(Vector::Zero(problem.n()));
  for (int i = 0; i < problem.n(); ++i) {
    for (const double start : {-M_PI / 2., -M_PI / 4., M_PI / 4., M_PI / 2.}) {
      if (best.cost < 0.02 * cost_before) return best;
      Offsets::Fit other = problem.fit(start * Vector::Unit(problem.n(), i));
      if (other.cost < 0.5 * best.cost) best = std::move(other);
    }
  }
  return best;
}

/// Nothing where more is free than a turn of the whole base.
std::optional<Found> find_offsets(Offsets& problem) {
  Found found;
  found.cost_before = problem.cost(Vector::Zero(problem.n()));
  const Offsets::Fit best = best_fit(problem, found.cost_before);
  found.cost = best.cost;
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(best.N);
  const double largest = eigen.eigenvalues()[problem.n() - 1];
  constexpr double kFree = 1e-4;
  int n_free = 0;
  while (n_free < problem.n() && eigen.eigenvalues()[n_free] < kFree * largest) ++n_free;
  if (n_free > 1 || !(largest > 0.)) return {};
  const Vector free = eigen.eigenvectors().col(0);
  const auto settled = [&](const Vector& offsets) {
    Vector angles = n_free == 1 ? sparsest(offsets, free) : offsets;
    for (double& angle : angles) angle = wrap_angle(angle);
    return angles;
  };
  found.offsets = settled(best.offsets);
  // Jackknife over eighths of the time.
  Vector squares = Vector::Zero(problem.n());
  for (int p = 0; p < Offsets::kParts; ++p) {
    const Vector other = settled(problem.fit(best.offsets, p).offsets);
    squares += (other - found.offsets).cwiseAbs2() * (Offsets::kParts - 1.) / Offsets::kParts;
  }
  found.sigma = squares.cwiseSqrt();
  return found;
}

/// The largest of the angles that the model has.
double prior_of_angles(const Wheels& wheels) {
  double prior = 0.;
  const auto& intrinsics = wheels.model->description().intrinsics;
  for (std::size_t i = 0; i < intrinsics.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (intrinsics[i].unit != "rad" || k >= wheels.prior.sigma_intrinsics.size()) continue;
    prior = std::max(prior, wheels.prior.sigma_intrinsics[k]);
  }
  return prior;
}

/// Whether the angles go from one to the next while the base moves, as what is steered does, and
/// noise does not.
bool go_on(const Wheels& wheels) {
  double steps = 0., varies = 0.;
  for (std::size_t i = 0; i < static_cast<std::size_t>(wheels.model->description().n_steer); ++i) {
    double n = 0., sum = 0., squares = 0.;
    const EncoderSample* before = nullptr;
    for (const EncoderSample& sample : wheels.samples) {
      if (!series::moves(sample)) continue;
      const double angle = sample.steer_rad[i];
      n += 1.;
      sum += angle;
      squares += angle * angle;
      if (before != nullptr) steps += std::pow(angle - before->steer_rad[i], 2);
      before = &sample;
    }
    if (n > 0.) varies += squares - sum * sum / n;
  }
  constexpr double kWhite = 2., kPart = 0.1;
  return steps < kPart * kWhite * varies;
}

/// Angles that no constants make fit, and that fit when they are as small as they are in degrees.
/// Where the base drives nearly straight on, no angles at all fit as well: then the motion does not
/// tell the unit, only that these are wrong.
bool check_unit(const Recording& recording, const Wheels& wheels, Offsets& problem,
                const std::string& label, Findings& out) {
  const bool is_known =
      std::any_of(recording.implausible.begin(), recording.implausible.end(),
                  [&](const viwo::Finding& found) { return found.key == label + " steering"; }) ||
      is_fault(out, label, "order");
  if (is_known || !go_on(wheels)) return false;
  const double before = problem.cost(Vector::Zero(problem.n()));
  constexpr double kLeast_m_per_s = 0.01;
  const double rows = wheels.model->n_rows() * static_cast<double>(problem.size());
  if (before < rows * kLeast_m_per_s * kLeast_m_per_s) return false;
  constexpr double kDegree = std::numbers::pi / 180., kMost = 0.1;
  Offsets in_degrees(wheels, kDegree);
  const double left = in_degrees.fit(Vector::Zero(problem.n())).cost;
  if (left > kMost * std::min(before, best_fit(problem, before).cost)) return false;
  const auto mm = [&](double cost) { return significant(1e3 * std::sqrt(cost / rows), 2); };
  constexpr double kAsWell = 3.;
  const bool is_told = kAsWell * left < Offsets(wheels, 0.).fit(Vector::Zero(problem.n())).cost;
  out.push_back({label,
                 Severity::kFault,
                 "steering",
                 "the wheels contradict each other by " + mm(before) +
                     " mm/s, whatever constants are added to the steering angles, and by " +
                     mm(left) +
                     (is_told ? " mm/s if these are in degrees (steer_scale: 0.0174533), or are "
                                "taken before a gear, as at a steering wheel"
                              : " mm/s without any steering: its unit, order, signs, or that they "
                                "are of a joint before a gear"),
                 {{"residual as configured", std::sqrt(before / rows), "m/s"},
                  {"residual in degrees", std::sqrt(left / rows), "m/s"}}});
  return true;
}

/// Whether wheels within what the prior allows contradict each other hardly more than `cost`: a
/// motion that tells little takes radii for zeros.
bool is_within_prior(const Wheels& wheels, Offsets& problem, double cost) {
  constexpr double kMostSigmas = 4., kHardlyMore = 2.;
  const std::optional<Calibration> calibration = calibrated(wheels);
  if (!calibration) return false;
  constexpr double kRounding = 1e-9;  // of what the gauge holds
  const Intrinsics d = calibration->x_WI - wheels.prior.wheels.x_WI;
  const Intrinsics most = kMostSigmas * wheels.prior.sigma_intrinsics;
  if ((d.cwiseAbs().array() > most.array() + kRounding).any()) return false;
  problem.set_intrinsics(calibration->x_WI);
  return problem.cost(Vector::Zero(problem.n())) < kHardlyMore * cost;
}

void check_offsets(const Recording& recording, const Wheels& wheels, const std::string& label,
                   Findings& out) {
  Offsets problem(wheels);
  constexpr std::size_t kFewest = 100;
  if (problem.n() == 0 || wheels.model->n_rows() <= 3 || problem.size() < kFewest) return;
  if (check_unit(recording, wheels, problem, label, out)) return;
  Finding finding{label, Severity::kNote, "steer offsets",
                  "offsets of the steering cannot be told from this motion"};
  const std::optional<Found> found = find_offsets(problem);
  constexpr double kMostSigma = 0.05;
  if (!found || !(found->sigma.maxCoeff() < kMostSigma)) {
    out.push_back(finding);
    return;
  }
  const double rows = wheels.model->n_rows() * static_cast<double>(problem.size());
  const double before = std::sqrt(found->cost_before / rows), after = std::sqrt(found->cost / rows);
  const double prior = prior_of_angles(wheels);
  int worst = 0;
  const double largest = found->offsets.cwiseAbs().maxCoeff(&worst);
  finding.severity = Severity::kFits;
  finding.what = "steering offsets up to " + significant(largest, 2) + " rad";
  finding.figures = {{"residual as configured", before, "m/s"},
                     {"residual with offsets", after, "m/s"},
                     {"prior sigma", prior, "rad"}};
  // Beyond what the filter calibrates from its prior, and what the time shows of it.
  Vector written = Vector::Zero(problem.n());
  for (int i = 0; i < problem.n(); ++i) {
    const std::string steer = "steer_" + std::to_string(i + 1);
    finding.figures.push_back({"offset of " + steer, found->offsets[i], "rad"});
    finding.figures.push_back({"sigma of " + steer, found->sigma[i], "rad"});
    const double most = 4. * std::hypot(prior, found->sigma[i]);
    if (std::abs(found->offsets[i]) > most) written[i] = found->offsets[i];
  }
  // With less than half of the contradictions left.
  if (written.norm() > 0. && after < 0.5 * before &&
      !is_within_prior(wheels, problem, found->cost)) {
    finding.severity = Severity::kFault;
    finding.what = "the wheels contradict each other by " + significant(1e3 * before, 2) +
                   " mm/s, and by " + significant(1e3 * after, 2) +
                   " mm/s with constants added to the steering angles, steer_" +
                   std::to_string(worst + 1) + " most: " + significant(found->offsets[worst], 3) +
                   " +- " + significant(found->sigma[worst], 1) + " rad: its zero";
    finding.remedies = {{"sensors." + wheels.sensor + ".steer_shift_rad", list_of(written)}};
  }
  out.push_back(finding);
}

}  // namespace

void check_steer_offsets(const Recording& recording, Findings& out) {
  for (const Wheels& wheels : recording.wheels) {
    if (wheels.samples.empty() || !wheels.unusable.empty()) continue;
    const std::string label = recording.label<EncoderSample>(wheels.sensor);
    const std::size_t before = out.size();
    check_offsets(recording, wheels, label, out);
    // Zeros that make up for a channel that is not there are none of the robot.
    if (!is_fault(out, label, "channel")) continue;
    for (std::size_t i = before; i < out.size(); ++i) {
      out[i].severity = std::min(out[i].severity, Severity::kNote);
      out[i].remedies.clear();
    }
  }
}

}  // namespace viwo::inspect

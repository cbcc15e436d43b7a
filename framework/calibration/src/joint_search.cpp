#include "joint_search.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include <Eigen/Dense>
#include <ceres/tiny_solver.h>

#include "viwo/math/se2.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/run/parallel_for.hpp"

namespace viwo::calibration {
namespace {

/// Samples that are looked at, starts of the search, and tries on the circle for each zero.
constexpr int kSamples = 400, kStarts = 48, kTries = 12;
/// The turn of the reference is taken over this time about a sample.
constexpr double kTurn_s = 0.1;
/// Zeros that differ by more are another solution.
constexpr double kOther_rad = 0.2;

/// A sample, and how fast the base turned then.
struct TurningSample {
  EncoderSample y;
  double omega_rad_per_s = 0.;
};

std::optional<double> rate_at(const MotionReference& motion, std::int64_t t_ns) {
  const auto half_ns = static_cast<std::int64_t>(0.5e9 * kTurn_s);
  const std::int64_t at_ns = t_ns + to_ns(motion.offset_s);
  const auto before = interpolate(motion.poses, at_ns - half_ns, motion.max_gap_s);
  const auto after = interpolate(motion.poses, at_ns + half_ns, motion.max_gap_s);
  if (!before || !after) return std::nullopt;
  return wrap_angle(yaw(*after) - yaw(*before)) / kTurn_s;
}

/// Samples evenly spread over all recordings, those that move: at rest every zero is right.
std::vector<TurningSample> pick_samples(const CalibrationSetup& setup,
                                        const std::vector<std::size_t>& recordings) {
  std::vector<TurningSample> moving;
  for (const std::size_t index : recordings) {
    const CalibrationRecording& recording = setup.recordings[index];
    for (const EncoderSample& y : recording.data.wheels()) {
      const bool rests = std::all_of(y.drive_rad_per_s.begin(), y.drive_rad_per_s.end(),
                                     [](double rate) { return rate == 0.; });
      if (rests || y.bad_drives != 0 || y.bad_steers != 0) continue;
      const auto rate = rate_at(recording.motion, (y.begin_ns + y.end_ns) / 2);
      if (rate) moving.push_back({y, *rate});
    }
  }
  std::vector<TurningSample> out;
  const auto wanted = std::min<std::size_t>(kSamples, moving.size());
  for (std::size_t i = 0; i < wanted; ++i) out.push_back(moving[i * moving.size() / wanted]);
  return out;
}

/// What the rows leave when the turn of the base is known and its velocity is not: for TinySolver.
class SearchCost {
 public:
  // NOLINTBEGIN(readability-identifier-naming): as TinySolver calls them.
  using Scalar = double;
  enum { NUM_RESIDUALS = Eigen::Dynamic, NUM_PARAMETERS = Eigen::Dynamic };

  SearchCost(const WheelModel& model, std::vector<TurningSample> samples,
             const std::vector<int>& zeros)
      : model_(model), samples_(std::move(samples)), nominal_(model.nominal()) {
    for (const IntrinsicSpec& spec : model.description().intrinsics) {
      by_sigma_.push_back(1. / spec.prior_sigma);
    }
    for (const int zero : zeros) by_sigma_[static_cast<std::size_t>(zero)] = 0.;
    double squares = 0.;
    for (const TurningSample& sample : samples_) squares += rows(sample, nominal_).b.squaredNorm();
    const double count = static_cast<double>(samples_.size()) * model.n_rows();
    // The size of a residual is not known yet: a twentieth of what the wheels roll.
    by_noise_ = 1. / std::max(0.05 * std::sqrt(squares / std::max(1., count)), 1e-9);
  }

  int NumParameters() const { return static_cast<int>(nominal_.size()); }
  int NumResiduals() const {
    return static_cast<int>(samples_.size()) * model_.n_rows() + NumParameters();
  }
  // NOLINTEND(readability-identifier-naming)

  bool operator()(const double* parameters, double* residuals, double* jacobian) const {
    const Intrinsics x = Eigen::Map<const Eigen::VectorXd>(parameters, NumParameters());
    Eigen::Map<Eigen::VectorXd> r(residuals, NumResiduals());
    evaluate(x, r);
    if (jacobian == nullptr) return r.allFinite();
    Eigen::Map<Eigen::MatrixXd> J(jacobian, NumResiduals(), NumParameters());
    Eigen::VectorXd moved(NumResiduals());
    for (int k = 0; k < NumParameters(); ++k) {
      const double step = 1e-6 * std::max(1e-2, std::abs(x[k]));
      Intrinsics there = x;
      there[k] += step;
      evaluate(there, moved);
      J.col(k) = (moved - r) / step;
    }
    return r.allFinite() && J.allFinite();
  }

  double cost(const Intrinsics& x) const {
    Eigen::VectorXd r(NumResiduals());
    evaluate(x, r);
    return r.squaredNorm();
  }

 private:
  RowSystem rows(const TurningSample& sample, const Intrinsics& x) const {
    RowSystem out;
    out.A.setZero(model_.n_rows(), 3);
    out.b.setZero(model_.n_rows());
    model_.model().rows(sample.y, x, false, out);
    return out;
  }

  template <class Vector>
  void evaluate(const Intrinsics& x, Vector& r) const {
    const int m = model_.n_rows();
    int row = 0;
    for (const TurningSample& sample : samples_) {
      const RowSystem system = rows(sample, x);
      const RowVector b = system.b - sample.omega_rad_per_s * system.A.col(2);
      const auto A_v = system.A.leftCols<2>();
      const Eigen::Matrix2d M = A_v.transpose() * A_v;
      // A base without sideways rows knows one velocity only.
      const Eigen::Vector2d v =
          M.completeOrthogonalDecomposition().solve(Eigen::Vector2d(A_v.transpose() * b));
      r.segment(row, m) = by_noise_ * (b - A_v * v);
      row += m;
    }
    for (int k = 0; k < NumParameters(); ++k) {
      r[row + k] = by_sigma_[static_cast<std::size_t>(k)] * (x[k] - nominal_[k]);
    }
  }

  const WheelModel& model_;
  std::vector<TurningSample> samples_;
  Intrinsics nominal_;
  std::vector<double> by_sigma_;
  double by_noise_ = 1.;
};

struct Solution {
  Intrinsics x;
  double cost = 0.;
};

/// From zeros anywhere: each in turn to the best of some tries on the circle, then all at once.
Solution descend(const SearchCost& cost, const std::vector<int>& zeros, Intrinsics x) {
  for (int sweep = 0; sweep < 2; ++sweep) {
    for (const int zero : zeros) {
      Solution best{x, cost.cost(x)};
      for (int i = 1; i < kTries; ++i) {
        Intrinsics there = x;
        there[zero] += 2. * M_PI * i / kTries;
        const double at = cost.cost(there);
        if (at < best.cost) best = {there, at};
      }
      x = best.x;
    }
  }
  using Solver = ceres::TinySolver<SearchCost>;
  Solver solver;
  Solver::Parameters parameters = x;
  solver.Solve(cost, &parameters);
  x = parameters;
  for (const int zero : zeros) x[zero] = wrap_angle(x[zero]);
  return {x, cost.cost(x)};
}

double farthest(const Intrinsics& a, const Intrinsics& b, const std::vector<int>& zeros) {
  double most = 0.;
  for (const int zero : zeros) most = std::max(most, std::abs(wrap_angle(a[zero] - b[zero])));
  return most;
}

/// All solutions from nominal zeros and from random ones, the best first.
std::vector<Solution> solve(const SearchCost& cost, const std::vector<int>& zeros,
                            const Intrinsics& nominal) {
  std::vector<Solution> solutions(zeros.empty() ? 1 : kStarts);
  std::mt19937_64 random(1);
  std::vector<Intrinsics> starts(solutions.size(), nominal);
  for (std::size_t i = 1; i < starts.size(); ++i) {
    for (const int zero : zeros) {
      starts[i][zero] = std::ldexp(2. * M_PI * static_cast<double>(random() >> 11), -53);
    }
  }
  parallel_for(starts.size(),
               [&](std::size_t i) { solutions[i] = descend(cost, zeros, starts[i]); });
  std::stable_sort(solutions.begin(), solutions.end(),
                   [](const Solution& a, const Solution& b) { return a.cost < b.cost; });
  return solutions;
}

void reverse(const std::vector<int>& signs, EncoderSample& y) {
  for (std::size_t i = 0; i < signs.size(); ++i) y.drive_rad_per_s[i] *= signs[i];
}

/// -1 for each bit of the pattern that is set.
std::vector<int> signs_of(std::size_t pattern, std::size_t n) {
  std::vector<int> signs(n, 1);
  for (std::size_t i = 0; i < n; ++i) signs[i] = (pattern >> i & 1) != 0 ? -1 : 1;
  return signs;
}

}  // namespace

std::vector<int> steering_zeros(const WheelModel& model) {
  const ModelDescription& description = model.description();
  std::vector<int> zeros(static_cast<std::size_t>(description.n_steer), -1);
  EncoderSample y;
  y.n_drive = description.n_drive;
  y.n_steer = description.n_steer;
  for (std::size_t i = 0; i < static_cast<std::size_t>(y.n_drive); ++i) {
    y.drive_rad_per_s[i] = 3. + 0.7 * static_cast<double>(i);
  }
  for (std::size_t i = 0; i < zeros.size(); ++i)
    y.steer_rad[i] = 0.2 + 0.1 * static_cast<double>(i);
  const Intrinsics x = model.nominal();
  RowSystem rows;
  rows.A.setZero(model.n_rows(), 3);
  rows.b.setZero(model.n_rows());
  if (model.model().rows(y, x, false, rows) != Status::kOk) return zeros;
  const Twist xi(0.5, 0.1, 0.3);
  const RowVector e = rows.b - rows.A * xi;
  IntrinsicDerivatives by_x;
  by_x.J.setZero(model.n_rows(), model.n_intrinsics());
  by_x.DtE.setZero(3, model.n_intrinsics());
  NoiseDerivatives by_n;
  by_n.J.setZero(model.n_rows(), model.n_noises());
  by_n.DtE.setZero(3, model.n_noises());
  model.model().intrinsic_derivatives(y, x, rows, rows.b, xi, e, by_x);
  model.model().noise_derivatives(y, x, rows, rows.b, xi, e, by_n);
  for (int q = 0; q < model.n_noises(); ++q) {
    const NoiseSpec& noise = description.noises[static_cast<std::size_t>(q)];
    if (noise.kind != NoiseKind::kSteer || by_n.J.col(q).isZero()) continue;
    for (int k = 0; k < model.n_intrinsics(); ++k) {
      const double scale = 1e-6 * by_n.J.col(q).norm();
      const bool same = (by_x.J.col(k) + by_n.J.col(q)).norm() < scale ||
                        (by_x.J.col(k) - by_n.J.col(q)).norm() < scale;
      if (same) zeros[static_cast<std::size_t>(noise.channel)] = k;
    }
  }
  return zeros;
}

void reverse_drives(CalibrationSetup& setup, const std::vector<int>& signs) {
  for (CalibrationRecording& recording : setup.recordings) {
    const auto wheels = recording.data.wheels();
    std::vector<EncoderSample> samples(wheels.begin(), wheels.end());
    for (EncoderSample& sample : samples) reverse(signs, sample);
    recording.data.recorded.set(recording.data.wheels_name, samples);
  }
}

JointSearch search_joints(const CalibrationSetup& setup,
                          const std::vector<std::size_t>& recordings) {
  const WheelModel& model = *setup.recordings[recordings.front()].setup.model;
  const ModelDescription& description = model.description();
  JointSearch out;
  if (setup.options.find_steering_zeros) {
    out.zeros = steering_zeros(model);
    for (std::size_t i = 0; i < out.zeros.size(); ++i) {
      if (out.zeros[i] >= 0) continue;
      throw InputError(
          "find_steering_zeros: the model has no intrinsic that is the zero of steering "
          "channel " +
          std::to_string(i + 1));
    }
    if (out.zeros.empty()) {
      throw InputError("find_steering_zeros: the model has no steering");
    }
  }
  const std::vector<TurningSample> samples = pick_samples(setup, recordings);
  if (samples.size() < 30) {
    throw InputError("find_steering_zeros, find_drive_signs: of the recordings only " +
                     std::to_string(samples.size()) +
                     " samples of the wheels move while the turn of the base is known");
  }
  // A steered wheel that drives backwards is one that points backwards: then zeros are enough.
  const auto n = static_cast<std::size_t>(description.n_drive);
  const bool signs = setup.options.find_drive_signs && out.zeros.empty();
  const std::size_t patterns = signs ? std::size_t{1} << n : 1;
  std::vector<Solution> all;
  std::vector<std::size_t> pattern_of;
  for (std::size_t pattern = 0; pattern < patterns; ++pattern) {
    const std::vector<int> drive_signs = signs_of(pattern, n);
    auto signed_samples = samples;
    for (TurningSample& sample : signed_samples) reverse(drive_signs, sample.y);
    const SearchCost cost(model, std::move(signed_samples), out.zeros);
    for (Solution& solution : solve(cost, out.zeros, model.nominal())) {
      all.push_back(std::move(solution));
      pattern_of.push_back(pattern);
    }
  }
  std::size_t best = 0;
  for (std::size_t i = 1; i < all.size(); ++i) {
    if (all[i].cost < all[best].cost) best = i;
  }
  out.x_WI = all[best].x;
  out.cost = all[best].cost;
  out.drive_signs = signs_of(pattern_of[best], n);
  out.other_cost = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool other = pattern_of[i] != pattern_of[best] ||
                       farthest(all[i].x, all[best].x, out.zeros) > kOther_rad;
    if (other && all[i].cost < out.other_cost) {
      out.other_cost = all[i].cost;
      out.other = all[i].x;
      out.other_drive_signs = signs_of(pattern_of[i], n);
    }
  }
  return out;
}

}  // namespace viwo::calibration

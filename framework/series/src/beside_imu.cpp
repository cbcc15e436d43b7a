#include "viwo/series/beside_imu.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "viwo/eval/statistics.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo::series {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPair_s = 1.;     ///< apart: far above the gyro's noise, far below its walk
constexpr double kHalf_s = 0.5;    ///< of the second differences
constexpr double kMaxGap_s = 0.2;  ///< of poses or IMU
constexpr std::size_t kFewestPairs = 20, kMostPairs = 2000;
constexpr int kIterations = 6;
constexpr double kOutlierSigmas = 4.;
/// Median of the norm of three normal numbers, and of the magnitude of one.
constexpr double kMedianNorm = 1.5382, kMedianMagnitude = 0.67449;

/// Places in the fit of orientations.
constexpr int kBias = 0, kMounting = 3, kClock = 6, kUnknowns = 7;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;

/// The readings of an IMU by time.
class Readings {
 public:
  explicit Readings(std::span<const ImuSample> imu) : imu_(imu) {}

  /// Calls f(dt_s, gyro, accel, t_ns) for the pieces between readings from `begin` to `end`, with
  /// the means over each and its middle; false where readings are missing.
  template <class F>
  bool between(std::int64_t begin_ns, std::int64_t end_ns, const F& f) const {
    auto after = std::upper_bound(
        imu_.begin(), imu_.end(), begin_ns,
        [](std::int64_t t_ns, const ImuSample& sample) { return t_ns < sample.t_ns; });
    if (after == imu_.begin()) return false;
    for (std::int64_t t_ns = begin_ns; t_ns < end_ns; ++after) {
      if (after == imu_.end()) return false;
      const ImuSample &a = *(after - 1), &b = *after;
      const double period_s = seconds_between(a.t_ns, b.t_ns);
      if (!(period_s > 0.) || period_s > kMaxGap_s) return false;
      const std::int64_t last_ns = std::min(b.t_ns, end_ns);
      const std::int64_t middle_ns = t_ns + (last_ns - t_ns) / 2;
      const double part = seconds_between(a.t_ns, middle_ns) / period_s;
      const Vector3d w0 = to_vector(a.gyro_rad_per_s), w1 = to_vector(b.gyro_rad_per_s);
      const Vector3d f0 = to_vector(a.accel_m_per_s2), f1 = to_vector(b.accel_m_per_s2);
      f(seconds_between(t_ns, last_ns), Vector3d(w0 + part * (w1 - w0)),
        Vector3d(f0 + part * (f1 - f0)), middle_ns);
      t_ns = last_ns;
    }
    return true;
  }

 private:
  std::span<const ImuSample> imu_;
};

/// Indices of two poses, a second apart.
struct Pair {
  std::size_t from, to;
};

/// The first pose at `after_s` or more after another, if it is not much later.
std::optional<std::size_t> later(const Trajectory& poses, std::size_t from, double after_s) {
  const std::int64_t t_ns = poses[from].t_ns + to_ns(after_s);
  const auto at = std::lower_bound(
      poses.begin() + static_cast<std::ptrdiff_t>(from), poses.end(), t_ns,
      [](const StampedPose& pose, std::int64_t stamp) { return pose.t_ns < stamp; });
  if (at == poses.end() || seconds_between(t_ns, at->t_ns) > kMaxGap_s) return std::nullopt;
  return static_cast<std::size_t>(at - poses.begin());
}

std::vector<Pair> pairs_of(const Trajectory& poses) {
  std::vector<Pair> pairs;
  const std::size_t step = 1 + poses.size() / kMostPairs;
  for (std::size_t i = 0; i < poses.size(); i += step) {
    if (const auto to = later(poses, i, kPair_s)) pairs.push_back({i, *to});
  }
  return pairs;
}

/// What is left of one pair, and its derivatives.
struct Row {
  Vector3d r = Vector3d::Zero();
  Eigen::Matrix<double, 3, kUnknowns> J;
};

std::optional<Row> row_of(const Trajectory& poses, const Pair& pair, const Readings& readings,
                          const BesideGyro& now) {
  const StampedPose &from = poses[pair.from], &to = poses[pair.to];
  const std::int64_t shift_ns = to_ns(now.t_BtoI_s);
  Matrix3d turn = Matrix3d::Identity(), by_bias = Matrix3d::Zero();  // I at the end to I before
  Vector3d first = Vector3d::Zero(), last = Vector3d::Zero();
  bool begun = false;
  const auto add = [&](double dt_s, const Vector3d& gyro, const Vector3d&, std::int64_t) {
    last = gyro - now.gyro_bias;
    if (!begun) first = last;
    begun = true;
    const Matrix3d step = exp_so3(dt_s * last);
    turn = turn * step;
    by_bias = step.transpose() * by_bias + dt_s * Matrix3d::Identity();
  };
  if (!readings.between(from.t_ns + shift_ns, to.t_ns + shift_ns, add)) return std::nullopt;
  const Matrix3d of_body = (from.q_BtoW.conjugate() * to.q_BtoW).toRotationMatrix();
  Row row;
  row.r = log_so3(turn.transpose() * now.R_BtoI * of_body * now.R_BtoI.transpose());
  row.J.middleCols<3>(kBias) = by_bias;
  row.J.middleCols<3>(kMounting) = turn.transpose() - Matrix3d::Identity();
  row.J.col(kClock) = turn.transpose() * first - last;
  return row;
}

/// The rows without outliers.
std::vector<Row> fitting(std::vector<Row> rows) {
  std::vector<double> norms;
  for (const Row& row : rows) norms.push_back(row.r.norm());
  const double most = kOutlierSigmas * eval::median(norms) / kMedianNorm;
  std::erase_if(rows, [&](const Row& row) { return row.r.norm() > most; });
  return rows;
}

void step(const std::vector<Row>& rows, BesideGyro& now) {
  Eigen::Matrix<double, kUnknowns, kUnknowns> A;
  A.setZero();
  Unknowns b = Unknowns::Zero();
  for (const Row& row : rows) {
    A += row.J.transpose() * row.J;
    b -= row.J.transpose() * row.r;
  }
  A.diagonal().array() += 1e-9 * static_cast<double>(rows.size());  // what the motion does not tell
  const Unknowns dx = A.ldlt().solve(b);
  if (!dx.allFinite()) return;
  now.gyro_bias += dx.segment<3>(kBias);
  now.R_BtoI = exp_so3(dx.segment<3>(kMounting)) * now.R_BtoI;
  now.t_BtoI_s += dx[kClock];
}

/// A second difference: y = x^T [gravity, bias, place], of the weight `time_s`.
struct Window {
  Eigen::Matrix<double, 3, 9> H;
  Vector3d y = Vector3d::Zero();
};

std::optional<Window> window_of(const Trajectory& poses, std::size_t from, std::size_t middle,
                                std::size_t to, const Readings& readings,
                                const BesideGyro& mounting) {
  const std::int64_t shift_ns = to_ns(mounting.t_BtoI_s);
  const auto t_ns = [&](std::size_t i) { return poses[i].t_ns + shift_ns; };
  const double before_s = seconds_between(t_ns(from), t_ns(middle));
  const double after_s = seconds_between(t_ns(middle), t_ns(to));
  const auto weight = [&](std::int64_t at_ns) {
    return at_ns < t_ns(middle) ? seconds_between(t_ns(from), at_ns) / before_s
                                : seconds_between(at_ns, t_ns(to)) / after_s;
  };
  Vector3d of_force = Vector3d::Zero();
  Matrix3d of_turn = Matrix3d::Zero();
  for (std::size_t k = from; k < to; ++k) {  // from every pose anew
    Matrix3d R_ItoW = poses[k].q_BtoW.toRotationMatrix() * mounting.R_BtoI.transpose();
    const auto add = [&](double dt_s, const Vector3d& gyro, const Vector3d& force,
                         std::int64_t at_ns) {
      const Vector3d rate = gyro - mounting.gyro_bias;
      const Matrix3d R = R_ItoW * exp_so3(0.5 * dt_s * rate);
      of_force += weight(at_ns) * dt_s * (R * force);
      of_turn += weight(at_ns) * dt_s * R;
      R_ItoW = R_ItoW * exp_so3(dt_s * rate);
    };
    if (!readings.between(t_ns(k), t_ns(k + 1), add)) return std::nullopt;
  }
  const auto second = [&](const auto& of) {
    return ((of(to) - of(middle)) / after_s - (of(middle) - of(from)) / before_s).eval();
  };
  Window window;
  window.y = second([&](std::size_t i) { return poses[i].p_BinW; }) - of_force;
  window.H << 0.5 * (before_s + after_s) * Matrix3d::Identity(), -of_turn,
      -second([&](std::size_t i) { return poses[i].q_BtoW.toRotationMatrix(); });
  return window;
}

std::vector<Window> windows_of(const Trajectory& poses, const Readings& readings,
                               const BesideGyro& mounting) {
  std::vector<Window> windows;
  for (std::size_t i = 0; i < poses.size();) {
    const auto middle = later(poses, i, kHalf_s);
    const auto to = middle ? later(poses, *middle, kHalf_s) : std::nullopt;
    const auto window = to ? window_of(poses, i, *middle, *to, readings, mounting) : std::nullopt;
    if (window) windows.push_back(*window);
    i = window ? *to : i + 1;
  }
  return windows;
}

/// Gravity, the accelerometer's bias, and the place of the body in the IMU.
struct Solution {
  Eigen::Matrix<double, 9, 1> x;
  Eigen::Matrix<double, 9, 9> P;  ///< times the variance of a window
};

struct NormalEquations {
  Eigen::Matrix<double, 9, 9> A = Eigen::Matrix<double, 9, 9>::Zero();
  Eigen::Matrix<double, 9, 1> b = Eigen::Matrix<double, 9, 1>::Zero();

  static NormalEquations of(std::span<const Window> windows) {
    NormalEquations sum;
    for (const Window& window : windows) {
      sum.A += window.H.transpose() * window.H;
      sum.b += window.H.transpose() * window.y;
    }
    return sum;
  }
  void operator-=(const NormalEquations& part) {
    A -= part.A;
    b -= part.b;
  }
  Solution solve(double variance, double sigma_bias_m_per_s2) const {
    constexpr double kPlace_m = 1.;  // the IMU is about there
    Eigen::Matrix<double, 9, 9> with_prior = A;
    with_prior.diagonal().segment<3>(3).array() +=
        variance / (sigma_bias_m_per_s2 * sigma_bias_m_per_s2);
    with_prior.diagonal().tail<3>().array() += variance / (kPlace_m * kPlace_m);
    const Eigen::Matrix<double, 9, 9> P = with_prior.inverse();
    return {P * b, P};
  }
};

}  // namespace

std::optional<BesideGyro> compare_with_gyro(const Trajectory& poses, std::span<const ImuSample> imu,
                                            const Matrix3d& R_BtoI) {
  const Readings readings(imu);
  const std::vector<Pair> pairs = pairs_of(poses);
  BesideGyro found;
  found.R_BtoI = R_BtoI;
  std::vector<Row> rows;
  for (int i = 0; i <= kIterations; ++i) {
    rows.clear();
    for (const Pair& pair : pairs) {
      if (const auto row = row_of(poses, pair, readings, found)) rows.push_back(*row);
    }
    if (rows.size() < kFewestPairs) return std::nullopt;
    if (i < kIterations) step(fitting(rows), found);
  }
  std::vector<double> magnitudes;
  for (const Row& row : rows) {
    for (int k = 0; k < 3; ++k) magnitudes.push_back(std::abs(row.r[k]));
  }
  // Of a difference of two.
  found.sigma_rad = eval::median(magnitudes) / kMedianMagnitude / std::sqrt(2.);
  found.pairs = rows.size();
  return found;
}

std::optional<Vertical> find_vertical(const Trajectory& poses, std::span<const ImuSample> imu,
                                      const BesideGyro& mounting, double sigma_bias_m_per_s2) {
  std::vector<Window> windows = windows_of(poses, Readings(imu), mounting);
  NormalEquations all;
  double variance = 1.;
  for (int i = 0; i < kIterations; ++i) {
    if (windows.size() < kFewestPairs) return std::nullopt;
    all = NormalEquations::of(windows);
    const Eigen::Matrix<double, 9, 1> x = all.solve(variance, sigma_bias_m_per_s2).x;
    std::vector<double> norms;
    for (const Window& window : windows) norms.push_back((window.y - window.H * x).norm());
    const double sigma = eval::median(norms) / kMedianNorm;
    variance = std::max(sigma * sigma, 1e-20);
    std::erase_if(windows, [&](const Window& window) {
      return (window.y - window.H * x).norm() > kOutlierSigmas * sigma + 1e-9;
    });
  }
  if (windows.size() < kFewestPairs) return std::nullopt;
  all = NormalEquations::of(windows);
  const Solution solution = all.solve(variance, sigma_bias_m_per_s2);
  const Vector3d g = solution.x.head<3>();
  if (!(g.norm() > 0.)) return std::nullopt;
  // Errors that last: each eighth of the time left out in turn.
  constexpr std::size_t kParts = 8;
  double square = 0.;
  for (std::size_t part = 0; part < kParts; ++part) {
    const auto begin = static_cast<std::ptrdiff_t>(part * windows.size() / kParts);
    const auto end = static_cast<std::ptrdiff_t>((part + 1) * windows.size() / kParts);
    NormalEquations others = all;
    others -= NormalEquations::of({windows.begin() + begin, windows.begin() + end});
    const Vector3d without = others.solve(variance, sigma_bias_m_per_s2).x.head<3>();
    square += (without - g).head<2>().squaredNorm() * (kParts - 1.) / kParts;
  }
  Vertical found;
  found.gravity_m_per_s2 = g.norm();
  found.tilt_rad = std::atan2(g.head<2>().norm(), -g.z());
  found.sigma_rad = std::sqrt(std::max(variance * (solution.P(0, 0) + solution.P(1, 1)), square)) /
                    found.gravity_m_per_s2;
  found.windows = windows.size();
  return found;
}

}  // namespace viwo::series

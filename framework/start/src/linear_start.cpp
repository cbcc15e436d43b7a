#include "linear_start.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "start_frame.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/median.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Bearings this far off the epipolar plane, or off the point, count half: two to three pixels.
constexpr double kOutlierRad = 0.005;

/// What the IMU says of a key: rotation to the frame of the first one, and where the specific force
/// alone would have taken it from a rest there.
struct DeadReckoned {
  Matrix3d R_toFirst = Matrix3d::Identity();
  Vector3d fallen = Vector3d::Zero();
  double t_s = 0.;
};

std::vector<DeadReckoned> dead_reckon(const VisualWindow& window, const Vector3d& gyro_bias) {
  std::vector<DeadReckoned> keys(1);
  Matrix3d R = Matrix3d::Identity();
  Vector3d velocity = Vector3d::Zero(), position = Vector3d::Zero();
  for (std::size_t k = 1; k < window.keys.size(); ++k) {
    const auto& imu = window.keys[k].imu;
    for (std::size_t i = 1; i < imu.size(); ++i) {
      const double dt = seconds_between(imu[i - 1].t_ns, imu[i].t_ns);
      const Vector3d rate =
          0.5 * (to_vector(imu[i - 1].gyro_rad_per_s) + to_vector(imu[i].gyro_rad_per_s)) -
          gyro_bias;
      const Matrix3d next = R * exp_so3(dt * rate);
      const Vector3d force = 0.5 * (R * to_vector(imu[i - 1].accel_m_per_s2) +
                                    next * to_vector(imu[i].accel_m_per_s2));
      position += dt * velocity + 0.5 * dt * dt * force;
      velocity += dt * force;
      R = next;
    }
    keys.push_back({R, position, seconds_between(window.keys.front().t_ns, window.keys[k].t_ns)});
  }
  return keys;
}

/// Where a track was seen from a key, by the camera that saw it first.
struct Bearing {
  std::size_t key;
  Vector3d in_I;
};
using Bearings = std::vector<std::vector<Bearing>>;

Bearings bearings_of(const VisualWindow& window, const VisualStartOptions& options) {
  Bearings all;
  for (const StartTrack& track : window.tracks) {
    auto& bearings = all.emplace_back();
    const std::size_t camera = track.sights.front().camera;
    const Matrix3d& R_ItoC = options.cameras[camera].camera.R_ItoC;
    for (const StartSight& sight : track.sights) {
      if (sight.camera != camera) continue;
      bearings.push_back({sight.key, R_ItoC.transpose() * sight.bearing});
    }
  }
  return all;
}

/// How far the normals of the planes that bearings of two images span are from being perpendicular
/// to one direction, that of the translation: robust sum of squares (F-34).
double epipolar_cost(std::span<const Vector3d> normals) {
  constexpr int kReweightings = 3;
  Vector3d translation = Vector3d::Zero();
  double cost = 0.;
  for (int i = 0; i <= kReweightings; ++i) {
    Matrix3d N = Matrix3d::Zero();
    cost = 0.;
    for (const Vector3d& normal : normals) {
      const double off = squared(normal.dot(translation) / kOutlierRad);
      N += normal * normal.transpose() / squared(1. + off);
      cost += squared(kOutlierRad) * off / (1. + off);
    }
    Eigen::SelfAdjointEigenSolver<Matrix3d> eigen;
    eigen.computeDirect(N);
    translation = eigen.eigenvectors().col(0);
  }
  return cost;
}

class EpipolarCost {
 public:
  EpipolarCost(const VisualWindow& window, const VisualStartOptions& options)
      : window_(window), options_(options), bearings_(bearings_of(window, options)) {}

  /// Of pairs of keys that are no more than `most_apart` apart.
  double operator()(const Vector3d& gyro_bias, std::size_t most_apart) const {
    const auto keys = dead_reckon(window_, gyro_bias);
    const std::size_t n = keys.size();
    std::vector<std::vector<Vector3d>> normals(n * n);
    for (const auto& track : bearings_) {
      for (std::size_t a = 0; a < track.size(); ++a) {
        const Vector3d first = keys[track[a].key].R_toFirst * track[a].in_I;
        for (std::size_t b = a + 1; b < track.size(); ++b) {
          if (track[b].key - track[a].key > most_apart) break;
          normals[track[a].key * n + track[b].key].push_back(
              first.cross(keys[track[b].key].R_toFirst * track[b].in_I));
        }
      }
    }
    constexpr std::size_t kFewest = 8;
    double cost =
        squared(kBearingRad) * (gyro_bias / options_.sigma_gyro_bias_rad_per_s).squaredNorm();
    for (const auto& pair : normals) {
      if (pair.size() >= kFewest) cost += epipolar_cost(pair);
    }
    return cost;
  }

 private:
  static constexpr double kBearingRad = 0.002;
  const VisualWindow& window_;
  const VisualStartOptions& options_;
  Bearings bearings_;
};

/// Newton's method with central differences, damped.
Vector3d minimise(const EpipolarCost& cost, Vector3d x, std::size_t most_apart) {
  constexpr double kStep = 2e-4;
  constexpr int kIterations = 8;
  double now = cost(x, most_apart);
  double damping = 1e-3;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Vector3d gradient;
    Matrix3d H;
    std::array<double, 3> plus{}, minus{};
    for (int i = 0; i < 3; ++i) {
      const auto k = static_cast<std::size_t>(i);
      plus[k] = cost(x + kStep * Vector3d::Unit(i), most_apart);
      minus[k] = cost(x - kStep * Vector3d::Unit(i), most_apart);
      gradient[i] = (plus[k] - minus[k]) / (2. * kStep);
      H(i, i) = (plus[k] - 2. * now + minus[k]) / squared(kStep);
    }
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < i; ++j) {
        const double both = cost(x + kStep * (Vector3d::Unit(i) + Vector3d::Unit(j)), most_apart);
        H(i, j) = H(j, i) =
            (both - plus[static_cast<std::size_t>(i)] - plus[static_cast<std::size_t>(j)] + now) /
            squared(kStep);
      }
    }
    // Where the cost is not convex: the step of the nearest that is.
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(H);
    const Vector3d curvature =
        eigen.eigenvalues().cwiseAbs().cwiseMax(1e-9 * eigen.eigenvalues().cwiseAbs().maxCoeff());
    bool improved = false;
    for (int attempt = 0; attempt < 6 && !improved; ++attempt) {
      const Vector3d damped = curvature.array() + damping * curvature.maxCoeff();
      const Vector3d step = -(eigen.eigenvectors() * damped.cwiseInverse().asDiagonal() *
                              eigen.eigenvectors().transpose() * gradient);
      const double then = cost(x + step, most_apart);
      improved = then < now;
      if (!improved) {
        damping *= 8.;
        continue;
      }
      x += step;
      now = then;
      damping *= 0.2;
      if (step.norm() < 1e-5) return x;
    }
    if (!improved) return x;
  }
  return x;
}

/// Normal equations of velocity and gravity, with the points eliminated.
struct Reduced {
  Matrix6d H = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
};

/// min x^T G x - 2 h^T x with |x| = length: (G + mu I) x = h, mu above the lowest eigenvalue of -G.
Vector3d minimise_on_sphere(const Matrix3d& G, const Vector3d& h, double length) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(G);
  const Vector3d& lambda = eigen.eigenvalues();
  const Vector3d c = eigen.eigenvectors().transpose() * h;
  const auto at = [&](double mu) -> Vector3d {
    return c.cwiseQuotient(Vector3d(lambda.array() + mu).cwiseMax(1e-300));
  };
  double low = -lambda[0], high = -lambda[0] + c.norm() / length;
  for (int i = 0; i < 100; ++i) {
    const double mu = 0.5 * (low + high);
    (at(mu).norm() > length ? low : high) = mu;
  }
  const Vector3d x = eigen.eigenvectors() * at(high);
  return x.normalized() * length;
}

class LinearSystem {
 public:
  LinearSystem(const VisualWindow& window, const Vector3d& gyro_bias,
               const VisualStartOptions& options)
      : window_(window), options_(options), keys_(dead_reckon(window, gyro_bias)) {
    for (const StartTrack& track : window.tracks) weights_.emplace_back(track.sights.size(), 1.);
  }

  bool solve(LinearStart& out) const {
    Reduced reduced;
    std::vector<Eigen::Matrix<double, 3, 6>> dependence;
    out.points.clear();
    for (std::size_t i = 0; i < window_.tracks.size(); ++i) {
      eliminate(i, reduced, dependence, out.points);
    }
    const Eigen::LDLT<Matrix3d> of_velocity(reduced.H.topLeftCorner<3, 3>());
    const Matrix3d cross = reduced.H.topRightCorner<3, 3>();
    const Matrix3d G =
        reduced.H.bottomRightCorner<3, 3>() - cross.transpose() * of_velocity.solve(cross);
    const Vector3d h =
        reduced.b.tail<3>() - cross.transpose() * of_velocity.solve(reduced.b.head<3>());
    if (!G.allFinite() || !h.allFinite()) return false;
    out.gravity = minimise_on_sphere(G, h, options_.gravity_m_per_s2);
    out.velocity = of_velocity.solve(reduced.b.head<3>() - cross * out.gravity);
    Vector6d x;
    x << out.velocity, out.gravity;
    for (std::size_t i = 0; i < out.points.size(); ++i) out.points[i] -= dependence[i] * x;
    return x.allFinite();
  }

  /// Residuals are angles times distances: divides by the distances, and by more where an angle is
  /// large. Counts the points in front.
  void reweight(LinearStart& found) {
    std::size_t front = 0, all = 0;
    for (std::size_t i = 0; i < window_.tracks.size(); ++i) {
      const auto& sights = window_.tracks[i].sights;
      for (std::size_t s = 0; s < sights.size(); ++s, ++all) {
        const Vector3d p_C = in_camera(sights[s], found, found.points[i]);
        const double distance = std::max(p_C.norm(), 0.05);
        const double off = p_C.cross(sights[s].bearing).norm() / distance;
        if (p_C.dot(sights[s].bearing) > 0.) ++front;
        weights_[i][s] = 1. / (squared(distance) * squared(1. + squared(off / kOutlierRad)));
      }
    }
    found.in_front = static_cast<double>(front) / static_cast<double>(all);
  }

 private:
  Vector3d in_camera(const StartSight& sight, const LinearStart& found,
                     const Vector3d& point) const {
    const DeadReckoned& key = keys_[sight.key];
    const CameraView& camera = options_.cameras[sight.camera].camera;
    const Vector3d position =
        key.t_s * found.velocity + 0.5 * squared(key.t_s) * found.gravity + key.fallen;
    return camera.R_ItoC * (key.R_toFirst.transpose() * (point - position)) + camera.p_IinC;
  }

  void eliminate(std::size_t i, Reduced& reduced,
                 std::vector<Eigen::Matrix<double, 3, 6>>& dependence,
                 std::vector<Vector3d>& constants) const {
    Matrix3d of_point = Matrix3d::Zero();
    Eigen::Matrix<double, 3, 6> with = Eigen::Matrix<double, 3, 6>::Zero();
    Vector3d b_point = Vector3d::Zero();
    const auto& sights = window_.tracks[i].sights;
    for (std::size_t s = 0; s < sights.size(); ++s) {
      const DeadReckoned& key = keys_[sights[s].key];
      const CameraView& camera = options_.cameras[sights[s].camera].camera;
      const Matrix3d A = camera.R_ItoC * key.R_toFirst.transpose();
      const Matrix3d across =
          Matrix3d::Identity() - sights[s].bearing * sights[s].bearing.transpose();
      const double weight = weights_[i][s];
      const Matrix3d B = weight * A.transpose() * across * A;
      const Vector3d b = B * key.fallen - weight * A.transpose() * across * camera.p_IinC;
      const double t = key.t_s, t2 = 0.5 * squared(t);
      of_point += B;
      with.leftCols<3>() -= t * B;
      with.rightCols<3>() -= t2 * B;
      b_point += b;
      reduced.H.topLeftCorner<3, 3>() += t * t * B;
      reduced.H.topRightCorner<3, 3>() += t * t2 * B;
      reduced.H.bottomRightCorner<3, 3>() += t2 * t2 * B;
      reduced.b.head<3>() -= t * b;
      reduced.b.tail<3>() -= t2 * b;
    }
    // Points without parallax must not make it singular.
    of_point.diagonal().array() += 1e-9 * of_point.trace();
    const Eigen::LDLT<Matrix3d> solver(of_point);
    dependence.emplace_back(solver.solve(with));
    constants.emplace_back(solver.solve(b_point));
    reduced.H -= with.transpose() * dependence.back();
    reduced.b -= with.transpose() * constants.back();
  }

  const VisualWindow& window_;
  const VisualStartOptions& options_;
  std::vector<DeadReckoned> keys_;
  std::vector<std::vector<double>> weights_;
};

}  // namespace

Vector3d epipolar_gyro_bias(const VisualWindow& window, const VisualStartOptions& options) {
  const EpipolarCost cost(window, options);
  // Neighbours turn little from each other, whatever the bias; pairs further apart tell more of it.
  const Vector3d rough = minimise(cost, Vector3d::Zero(), 1);
  return minimise(cost, rough, window.keys.size());
}

std::optional<LinearStart> solve_linear_start(const VisualWindow& window, const Vector3d& gyro_bias,
                                              const VisualStartOptions& options) {
  constexpr int kIterations = 4;
  LinearSystem system(window, gyro_bias, options);
  LinearStart found;
  for (int i = 0; i < kIterations; ++i) {
    if (!system.solve(found)) return std::nullopt;
    system.reweight(found);
  }
  return found;
}

double parallax_rad(const VisualWindow& window, const Vector3d& gyro_bias,
                    const VisualStartOptions& options) {
  const auto keys = dead_reckon(window, gyro_bias);
  std::vector<double> angles;
  for (const auto& track : bearings_of(window, options)) {
    const Vector3d last = keys[track.back().key].R_toFirst * track.back().in_I;
    double most = 0.;
    for (const Bearing& bearing : track) {
      most = std::max(most, (keys[bearing.key].R_toFirst * bearing.in_I).cross(last).norm());
    }
    angles.push_back(most);
  }
  return upper_median(angles);
}

}  // namespace viwo

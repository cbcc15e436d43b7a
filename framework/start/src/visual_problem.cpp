#include "visual_problem.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "start_frame.hpp"
#include "viwo/camera/camera_model.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/median.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kHuber = 3.;              ///< sigmas from where on a sight counts less
constexpr double kFarthestInverse = 1e-4;  ///< 1/m

/// Inverse of the correlations of what is known of the calibration, in its order.
MatrixXd inverse_correlations(const VisualStartOptions& options) {
  std::vector<std::string> names;
  for (std::size_t c = 0; c < options.cameras.size(); ++c) {
    for (const BlockSpec& block : camera_blocks(c, options.cameras[c])) {
      for (const BlockEntry& entry : block.entries) names.push_back(entry.name);
    }
  }
  const MatrixXd C = options.correlations.among(names);
  return C.ldlt().solve(MatrixXd::Identity(C.rows(), C.cols()));
}

}  // namespace

VisualProblem::VisualProblem(const VisualWindow& window, const VisualStartOptions& options)
    : window_(window), options_(options) {
  for (std::size_t c = 0; c < options.cameras.size(); ++c) {
    // A camera that shares its clock has that of the first one.
    clocks_.push_back(options.cameras[c].shares_clock ? 0 : c);
  }
  known_ = inverse_correlations(options);
}

VisualEstimate VisualProblem::initial(const LinearStart& linear, const Vector3d& gyro_bias) const {
  VisualEstimate x;
  x.calibration = VectorXd::Zero(size() - imu_columns());
  const Matrix3d R_GtoI = R_GtoI_from_up(-linear.gravity.normalized());
  ImuState state;
  state.R_GtoI = R_GtoI;
  state.v_IinG = R_GtoI.transpose() * linear.velocity;
  state.gyro_bias = gyro_bias;
  x.keys.push_back(state);
  for (std::size_t k = 1; k < window_.keys.size(); ++k) {
    x.keys.push_back(predict(x.keys.back(), k).state);
  }
  std::vector<double> depths;
  std::vector<Vector3d> in_anchor;
  for (std::size_t i = 0; i < window_.tracks.size(); ++i) {
    const StartSight& sight = window_.tracks[i].sights.front();
    const CameraView& camera = options_.cameras[sight.camera].camera;
    const ImuState& key = x.keys[sight.key];
    const Vector3d p_G = R_GtoI.transpose() * linear.points[i];
    in_anchor.emplace_back(camera.R_ItoC * (key.R_GtoI * (p_G - key.p_IinG)) + camera.p_IinC);
    if (in_anchor.back().z() > 0.05) depths.push_back(in_anchor.back().z());
  }
  const double usual = depths.empty() ? 3. : upper_median(depths);
  for (std::size_t i = 0; i < window_.tracks.size(); ++i) {
    const Vector3d& bearing = window_.tracks[i].sights.front().bearing;
    const double z = in_anchor[i].z();
    const double depth = z > 0.1 * usual ? std::min(z, 100. * usual) : usual;
    x.points.emplace_back(bearing.x() / bearing.z(), bearing.y() / bearing.z(), 1. / depth);
  }
  return x;
}

VisualNormals VisualProblem::linearise(const VisualEstimate& x, double sigma_px) const {
  VisualNormals n;
  n.H = MatrixXd::Zero(size(), size());
  n.b = VectorXd::Zero(size());
  add_priors(x, n);
  for (std::size_t k = 1; k < x.keys.size(); ++k) add_imu(x, k, n);
  for (std::size_t i = 0; i < window_.tracks.size(); ++i) add_track(x, i, sigma_px, n);
  n.cost += n.imu_cost;
  return n;
}

VisualEstimate VisualProblem::moved(const VisualEstimate& x, const VectorXd& dx,
                                    const VisualNormals& n) const {
  VisualEstimate y = x;
  for (std::size_t k = 0; k < y.keys.size(); ++k) {
    retract(dx.segment<kImuSize>(kImuSize * static_cast<Eigen::Index>(k)), y.keys[k]);
  }
  y.calibration += dx.tail(y.calibration.size());
  for (std::size_t i = 0; i < y.points.size(); ++i) {
    y.points[i] += n.point_inverse[i] * (n.point_b[i] - n.point_with[i] * dx);
    y.points[i].z() = std::max(y.points[i].z(), kFarthestInverse);
  }
  return y;
}

VisualProblem::Prediction VisualProblem::predict(const ImuState& from, std::size_t to) const {
  Prediction p;
  p.state = from;
  p.state.R_GtoI_fej = from.R_GtoI;
  p.state.p_IinG_fej = from.p_IinG;
  p.state.v_IinG_fej = from.v_IinG;
  p.transition =
      propagate(window_.keys[to].imu, options_.noise, options_.gravity_m_per_s2, p.state);
  return p;
}

void VisualProblem::add_priors(const VisualEstimate& x, VisualNormals& n) const {
  const auto add = [&](int column, const Vector3d& value, double sigma) {
    n.H.diagonal().segment<3>(column).array() += 1. / squared(sigma);
    n.b.segment<3>(column) -= value / squared(sigma);
    n.cost += value.squaredNorm() / squared(sigma);
  };
  add(kGyroBiasColumn, x.keys.front().gyro_bias, options_.sigma_gyro_bias_rad_per_s);
  add(kAccelBiasColumn, x.keys.front().accel_bias, options_.sigma_accel_bias_m_per_s2);
  n.H.bottomRightCorner(known_.rows(), known_.cols()) += known_;
  const VectorXd pull = known_ * x.calibration;
  n.b.tail(x.calibration.size()) -= pull;
  n.cost += x.calibration.dot(pull);
  constexpr double kHeld = 1e10;
  const Eigen::Index last = imu_columns() - kImuSize;
  const Vector3d up = x.keys.back().R_GtoI.col(2);
  n.H.block<3, 3>(last + kThetaColumn, last + kThetaColumn) += kHeld * up * up.transpose();
  n.H.diagonal().segment<3>(last + kPositionColumn).array() += kHeld;
}

void VisualProblem::add_imu(const VisualEstimate& x, std::size_t k, VisualNormals& n) const {
  const Prediction p = predict(x.keys[k - 1], k);
  const ImuVector r = difference(x.keys[k], p.state);
  // An IMU that is said to have no noise has rounding errors. Of dynamic size: GCC 14 warns of a
  // loop in Eigen's factorisation of a fixed one.
  Eigen::MatrixXd Q = p.transition.Q;
  Q.diagonal().array() += 1e-16;
  const ImuMatrix W = Q.llt().solve(ImuMatrix::Identity());
  const ImuMatrix PhiW = p.transition.Phi.transpose() * W;
  const Eigen::Index b = kImuSize * static_cast<Eigen::Index>(k), a = b - kImuSize;
  n.H.block<kImuSize, kImuSize>(a, a) += PhiW * p.transition.Phi;
  n.H.block<kImuSize, kImuSize>(b, a) -= PhiW.transpose();
  n.H.block<kImuSize, kImuSize>(b, b) += W;
  n.b.segment<kImuSize>(a) += PhiW * r;
  n.b.segment<kImuSize>(b) -= W * r;
  n.imu_cost += r.dot(W * r);
}

CameraView VisualProblem::camera_at(const VisualEstimate& x, std::size_t c) const {
  const CameraPrior& prior = options_.cameras[c];
  const auto z = x.calibration.segment<kCalibration>(kCalibration * static_cast<Eigen::Index>(c));
  CameraView camera = prior.camera;
  const Eigen::Matrix<double, 6, 1> mount = prior.sigma_extrinsics.cwiseProduct(z.head<6>());
  camera.R_ItoC = exp_so3(-mount.head<3>()) * camera.R_ItoC;
  camera.p_IinC += mount.tail<3>();
  camera.intrinsics += prior.sigma_intrinsics.cwiseProduct(z.segment<8>(6));
  return camera;
}

Vector3d VisualProblem::rate_at(std::size_t key) const {
  return key == 0 ? to_vector(window_.keys[1].imu.front().gyro_rad_per_s)
                  : to_vector(window_.keys[key].imu.back().gyro_rad_per_s);
}

bool VisualProblem::sight_row(const VisualEstimate& x, std::size_t i, const StartSight& sight,
                              Row& row) const {
  const StartSight& first = window_.tracks[i].sights.front();
  const CameraView& anchor_camera = options_.cameras[first.camera].camera;
  const Matrix3d R_CtoI = anchor_camera.R_ItoC.transpose();
  const ImuState& anchor = x.keys[first.key];
  const Vector3d& q = x.points[i];
  const Vector3d p_A(q.x() / q.z(), q.y() / q.z(), 1. / q.z());
  const Vector3d p_anchorI = R_CtoI * (p_A - anchor_camera.p_IinC);
  const Vector3d p_G = anchor.R_GtoI.transpose() * p_anchorI + anchor.p_IinG;

  const CameraView camera = camera_at(x, sight.camera);
  const CameraPrior& prior = options_.cameras[sight.camera];
  const ImuState& key = x.keys[sight.key];
  // The image was taken a little later than the key's stamp if the clock is off, and a row of a
  // rolling shutter anyway.
  const double later_s =
      sight.after_s +
      clock_sigma(sight.camera) * x.calibration[clock_column(sight.camera) - imu_columns()];
  const Vector3d rate = rate_at(sight.key) - key.gyro_bias;
  const Matrix3d R_GtoI = exp_so3(-later_s * rate) * key.R_GtoI;
  const Vector3d p_IinG = key.p_IinG + later_s * key.v_IinG;
  const Vector3d p_I = R_GtoI * (p_G - p_IinG);
  const Vector3d in_C = camera.R_ItoC * p_I;
  Vector2d uv;
  PixelJacobian J;
  IntrinsicsJacobian J_intrinsics;
  if (!project(camera, in_C + camera.p_IinC, uv, J, &J_intrinsics)) return false;
  row.r = sight.uv_px - uv;
  const PixelJacobian J_I = J * camera.R_ItoC;
  const PixelJacobian J_G = J_I * R_GtoI;
  row.of_key << J_I * skew(p_I), -J_G;
  const Matrix3d R_ItoG = anchor.R_GtoI.transpose();
  row.of_anchor << -J_G * R_ItoG * skew(p_anchorI), J_G;
  Matrix3d of_q;
  of_q << Vector3d::UnitX() / q.z(), Vector3d::UnitY() / q.z(), -p_A / q.z();
  row.of_point = J_G * R_ItoG * R_CtoI * of_q;
  row.of_calibration << J * skew(in_C) * prior.sigma_extrinsics.head<3>().asDiagonal(),
      J * prior.sigma_extrinsics.tail<3>().asDiagonal(),
      J_intrinsics * prior.sigma_intrinsics.asDiagonal();
  row.of_clock = clock_sigma(sight.camera) *
                 (row.of_key.leftCols<3>() * rate + row.of_key.rightCols<3>() * key.v_IinG);
  row.key = kImuSize * static_cast<Eigen::Index>(sight.key);
  row.anchor = kImuSize * static_cast<Eigen::Index>(first.key);
  row.calibration = imu_columns() + kCalibration * static_cast<Eigen::Index>(sight.camera);
  row.clock = clock_column(sight.camera);
  return true;
}

void VisualProblem::add_track(const VisualEstimate& x, std::size_t i, double sigma_px,
                              VisualNormals& n) const {
  Matrix3d of_point = Matrix3d::Zero();
  Vector3d b_point = Vector3d::Zero();
  Eigen::Matrix<double, 3, Eigen::Dynamic> with;
  with.setZero(3, size());
  double squares = 0.;
  const auto& sights = window_.tracks[i].sights;
  Row row;
  for (const StartSight& sight : sights) {
    if (!sight_row(x, i, sight, row)) {
      n.cost += squared(10. * kHuber);  // behind a camera
      squares += squared(10. * kHuber);
      continue;
    }
    const double off = row.r.norm() / sigma_px;
    const double huber = off > kHuber ? kHuber / off : 1.;
    n.cost += off > kHuber ? kHuber * (2. * off - kHuber) : squared(off);
    squares += squared(off);
    if (off <= kHuber) {
      n.sight_cost += squared(off);
      ++n.n_sights;
    }
    const double weight = huber / squared(sigma_px);
    add_row(row, weight, n);
    of_point += weight * row.of_point.transpose() * row.of_point;
    b_point += weight * row.of_point.transpose() * row.r;
    with.middleCols<6>(row.key) += weight * row.of_point.transpose() * row.of_key;
    with.middleCols<6>(row.anchor) += weight * row.of_point.transpose() * row.of_anchor;
    with.middleCols<14>(row.calibration) += weight * row.of_point.transpose() * row.of_calibration;
    with.col(row.clock) += weight * row.of_point.transpose() * row.of_clock;
  }
  // A point of which nothing but a direction is known keeps its distance.
  of_point(2, 2) += 1e-6;
  const Matrix3d inverse = of_point.llt().solve(Matrix3d::Identity());
  n.H.selfadjointView<Eigen::Lower>().rankUpdate(
      (with.transpose() * inverse.llt().matrixL().toDenseMatrix()).eval(), -1.);
  n.b -= with.transpose() * (inverse * b_point);
  n.point_inverse.push_back(inverse);
  n.point_with.push_back(std::move(with));
  n.point_b.push_back(b_point);
  n.track_cost.push_back(squares / static_cast<double>(sights.size()));
}

void VisualProblem::add_row(const Row& row, double weight, VisualNormals& n) {
  struct Part {
    Eigen::Index first;
    Eigen::Ref<const Eigen::Matrix<double, 2, Eigen::Dynamic>> J;
  };
  const Part parts[] = {{row.key, row.of_key},
                        {row.anchor, row.of_anchor},
                        {row.calibration, row.of_calibration},
                        {row.clock, row.of_clock}};
  for (const Part& a : parts) {
    n.b.segment(a.first, a.J.cols()) += weight * a.J.transpose() * row.r;
    for (const Part& b : parts) {
      if (b.first > a.first) continue;
      n.H.block(a.first, b.first, a.J.cols(), b.J.cols()) += weight * a.J.transpose() * b.J;
    }
  }
}

}  // namespace viwo

#include "viwo/eval/alignment.hpp"

#include <cmath>
#include <stdexcept>

#include <Eigen/SVD>

#include "viwo/api/status.hpp"

namespace viwo::eval {

namespace {

/// Below this rms distance from the mean position the yaw comes from the orientations.
constexpr double kMinSpread_m = 0.05;

/// Second singular value of the cross-covariance over the first: 1e-6 is a thousandth in length.
constexpr double kMinSingularRatio = 1e-6;

/// First moments and cross-covariance of the positions.
struct Moments {
  Eigen::Vector3d mean_R = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_E = Eigen::Vector3d::Zero();
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();  ///< mean of (p_R - mean_R)(p_E - mean_E)^T
  double spread_R_m = 0.;                           ///< horizontal rms distance from the mean
  double spread_E_m = 0.;
};

Moments moments(std::span<const PosePair> pairs) {
  Moments m;
  const auto n = static_cast<double>(pairs.size());
  for (const PosePair& pair : pairs) {
    m.mean_R += pair.reference.p_BinW / n;
    m.mean_E += pair.estimate.p_BinW / n;
  }
  double square_R = 0.;
  double square_E = 0.;
  for (const PosePair& pair : pairs) {
    const Eigen::Vector3d d_R = pair.reference.p_BinW - m.mean_R;
    const Eigen::Vector3d d_E = pair.estimate.p_BinW - m.mean_E;
    m.cross += d_R * d_E.transpose() / n;
    square_R += d_R.head<2>().squaredNorm() / n;
    square_E += d_E.head<2>().squaredNorm() / n;
  }
  m.spread_R_m = std::sqrt(square_R);
  m.spread_E_m = std::sqrt(square_E);
  return m;
}

/// The yaw psi that maximises trace(Rz(psi)^T M), M a sum of "reference times estimate transposed".
double best_yaw(const Eigen::Matrix3d& M) {
  return std::atan2(M(1, 0) - M(0, 1), M(0, 0) + M(1, 1));
}

RigidTransform about_means(const Moments& m, const Eigen::Quaterniond& q_EtoR) {
  return {q_EtoR, m.mean_R - q_EtoR * m.mean_E};
}

RigidTransform align_start(const PosePair& pair) {
  const Eigen::Quaterniond q_EtoR =
      (pair.reference.q_BtoW * pair.estimate.q_BtoW.conjugate()).normalized();
  return {q_EtoR, pair.reference.p_BinW - q_EtoR * pair.estimate.p_BinW};
}

RigidTransform align_yaw_position(std::span<const PosePair> pairs) {
  const Moments m = moments(pairs);
  Eigen::Matrix3d M = m.cross;
  if (m.spread_R_m < kMinSpread_m || m.spread_E_m < kMinSpread_m) {
    M.setZero();
    for (const PosePair& pair : pairs) {
      M += (pair.reference.q_BtoW * pair.estimate.q_BtoW.conjugate()).toRotationMatrix();
    }
  }
  const Eigen::AngleAxisd yaw_rotation(best_yaw(M), Eigen::Vector3d::UnitZ());
  return about_means(m, Eigen::Quaterniond(yaw_rotation));
}

/// Umeyama (1991) without scale.
RigidTransform align_se3(std::span<const PosePair> pairs) {
  const Moments m = moments(pairs);
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m.cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& sigma = svd.singularValues();
  if (sigma[1] <= kMinSingularRatio * sigma[0]) {
    throw InputError(
        "alignment 'se3' is not determined: all positions are in one point or on one line; use "
        "'yaw_position' or 'start'");
  }
  // A proper rotation, also when the best orthogonal matrix is a reflection.
  Eigen::Vector3d sign = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.) sign[2] = -1.;
  const Eigen::Matrix3d R_EtoR = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  return about_means(m, Eigen::Quaterniond(R_EtoR).normalized());
}

}  // namespace

std::string_view name(Alignment alignment) {
  switch (alignment) {
    case Alignment::kNone:
      return "none";
    case Alignment::kStart:
      return "start";
    case Alignment::kYawPosition:
      return "yaw_position";
    case Alignment::kSe3:
      return "se3";
  }
  throw std::invalid_argument("name: not an alignment");
}

StampedPose RigidTransform::operator*(const StampedPose& pose_inE) const {
  StampedPose pose_inR = pose_inE;
  pose_inR.p_BinW = q_EtoR * pose_inE.p_BinW + p_EinR;
  pose_inR.q_BtoW = (q_EtoR * pose_inE.q_BtoW).normalized();
  return pose_inR;
}

RigidTransform align(std::span<const PosePair> pairs, Alignment alignment) {
  if (pairs.empty()) throw std::invalid_argument("align: no pairs");
  switch (alignment) {
    case Alignment::kNone:
      return {};
    case Alignment::kStart:
      return align_start(pairs.front());
    case Alignment::kYawPosition:
      return align_yaw_position(pairs);
    case Alignment::kSe3:
      return align_se3(pairs);
  }
  throw std::invalid_argument("align: not an alignment");
}

}  // namespace viwo::eval

#include "patch.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace viwo::klt {
namespace {

constexpr int kMaxSteps = 12;
constexpr float kStepPx = 0.005F;
/// Holds the deformation where it is in directions that the patch does not tell it, as a part of
/// the mean diagonal of the normal equations.
constexpr double kDamping = 1e-3;
/// The texture of a patch that has become much larger or smaller is not the same any more.
constexpr float kMaxScale = 2.5F;

/// Grey level between pixels; (x, y) at least one pixel inside of the image.
float interpolate(const cv::Mat& image, float x, float y) {
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const float a = x - static_cast<float>(column), b = y - static_cast<float>(row);
  const std::uint8_t* above = image.ptr<std::uint8_t>(row) + column;
  const std::uint8_t* below = image.ptr<std::uint8_t>(row + 1) + column;
  const auto grey = [](std::uint8_t value) { return static_cast<float>(value); };
  const float top = grey(above[0]) + a * (grey(above[1]) - grey(above[0]));
  const float bottom = grey(below[0]) + a * (grey(below[1]) - grey(below[0]));
  return top + b * (bottom - top);
}

}  // namespace

bool Patch::sample(const cv::Mat& image, const PatchPose& pose, Pixels& out) {
  const Eigen::Vector2f reach = static_cast<float>(kRadius) * pose.A.cwiseAbs().rowwise().sum();
  const Eigen::Vector2f limit(static_cast<float>(image.cols - 2),
                              static_cast<float>(image.rows - 2));
  if (!((pose.u - reach).minCoeff() >= 1.F && (limit - pose.u - reach).minCoeff() >= 0.F)) {
    return false;
  }
  int i = 0;
  for (int y = -kRadius; y <= kRadius; ++y) {
    Eigen::Vector2f at = pose.u + pose.A * Eigen::Vector2f(-kRadius, static_cast<float>(y));
    for (int x = -kRadius; x <= kRadius; ++x, ++i, at += pose.A.col(0)) {
      out[i] = interpolate(image, at.x(), at.y());
    }
  }
  return true;
}

Patch::Patch(const cv::Mat& image, const Eigen::Vector2f& u) {
  Eigen::Matrix<float, kPixels, 6> J;
  int i = 0;
  for (int y = -kRadius; y <= kRadius; ++y) {
    for (int x = -kRadius; x <= kRadius; ++x, ++i) {
      const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
      const float px = u.x() + fx, py = u.y() + fy;
      T_[i] = interpolate(image, px, py);
      const float gx = 0.5F * (interpolate(image, px + 1.F, py) - interpolate(image, px - 1.F, py));
      const float gy = 0.5F * (interpolate(image, px, py + 1.F) - interpolate(image, px, py - 1.F));
      J.row(i) << gx * fx, gx * fy, gy * fx, gy * fy, gx, gy;  // (KLT-3)
    }
  }
  T_.array() -= T_.mean();
  const float norm = std::max(T_.norm(), 1e-3F);
  T_ /= norm;
  J /= norm;
  // Without what brightness and contrast explain, (KLT-4).
  J.rowwise() -= J.colwise().mean().eval();
  J -= T_ * (T_.transpose() * J).eval();
  Eigen::Matrix<double, 6, 6> H = (J.transpose() * J).cast<double>();
  H.diagonal().head<4>().array() += kDamping * H.diagonal().head<4>().mean();
  H.diagonal().array() += 1e-9;
  const Eigen::Matrix<float, 6, 6> H_inverse =
      H.llt().solve(Eigen::Matrix<double, 6, 6>::Identity()).cast<float>();
  steps_ = J * H_inverse;
}

float Patch::fit(const cv::Mat& image, PatchPose& pose) const {
  Pixels grey;
  for (int k = 0; k < kMaxSteps; ++k) {
    if (!sample(image, pose, grey)) return -1.F;
    const float gain = T_.dot(grey);
    if (!(gain > 0.F)) return -1.F;
    const Eigen::Matrix<float, 6, 1> d = steps_.transpose() * grey / gain;  // (KLT-5)
    Eigen::Matrix2f D;
    D << 1.F + d[0], d[1], d[2], 1.F + d[3];
    if (!(D.determinant() > 0.25F)) return -1.F;
    // (KLT-6)
    pose.A = pose.A * D.inverse();
    const Eigen::Vector2f move = pose.A * d.tail<2>();
    pose.u -= move;
    const float scale = pose.A.norm() / std::sqrt(2.F);
    if (!(scale < kMaxScale && scale > 1.F / kMaxScale)) return -1.F;
    if (move.squaredNorm() > kStepPx * kStepPx) continue;
    const float norm = (grey.array() - grey.mean()).matrix().norm();
    return norm > 1e-3F ? gain / norm : -1.F;
  }
  return -1.F;
}

}  // namespace viwo::klt

#include "patch.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

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

Patch::Offsets Patch::offsets(bool along_x) {
  Offsets out{};
  for (int i = 0; i < kPixels; ++i) {
    out[static_cast<std::size_t>(i)] =
        static_cast<float>((along_x ? i % kSide : i / kSide) - kRadius);
  }
  return out;
}

bool Patch::sample(const cv::Mat& image, const PatchPose& pose, Pixels& out) {
  const Eigen::Vector2f reach = static_cast<float>(kRadius) * pose.A.cwiseAbs().rowwise().sum();
  const Eigen::Vector2f limit(static_cast<float>(image.cols - 2),
                              static_cast<float>(image.rows - 2));
  if (!((pose.u - reach).minCoeff() >= 1.F && (limit - pose.u - reach).minCoeff() >= 0.F)) {
    return false;
  }
  static const Offsets x = offsets(true), y = offsets(false);
  // In three loops, so that the compiler does the arithmetic of several pixels at once.
  std::array<float, kFilled> a, b;
  std::array<std::int32_t, kFilled> at;
  const auto step = static_cast<std::int32_t>(image.step1());
  const float ux = pose.u.x(), uy = pose.u.y();
  const float xx = pose.A(0, 0), xy = pose.A(0, 1), yx = pose.A(1, 0), yy = pose.A(1, 1);
  for (std::size_t i = 0; i < kFilled; ++i) {
    const float px = ux + xx * x[i] + xy * y[i], py = uy + yx * x[i] + yy * y[i];
    const auto column = static_cast<std::int32_t>(px), row = static_cast<std::int32_t>(py);
    a[i] = px - static_cast<float>(column);
    b[i] = py - static_cast<float>(row);
    at[i] = row * step + column;
  }
  std::array<std::array<std::uint8_t, 2>, kFilled> above, below;
  const std::uint8_t* grey = image.ptr<std::uint8_t>();
  for (std::size_t i = 0; i < kFilled; ++i) {
    std::memcpy(&above[i], grey + at[i], 2);
    std::memcpy(&below[i], grey + at[i] + step, 2);
  }
  float* __restrict sampled = out.data();
  for (std::size_t i = 0; i < kFilled; ++i) {
    const auto p00 = static_cast<float>(above[i][0]), p01 = static_cast<float>(above[i][1]);
    const auto p10 = static_cast<float>(below[i][0]), p11 = static_cast<float>(below[i][1]);
    const float top = p00 + a[i] * (p01 - p00), bottom = p10 + a[i] * (p11 - p10);
    sampled[i] = top + b[i] * (bottom - top);
  }
  return true;
}

Patch::Patch(const cv::Mat& image, const Eigen::Vector2f& u) {
  T_.setZero();
  Eigen::Matrix<float, kFilled, 6> J = Eigen::Matrix<float, kFilled, 6>::Zero();
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
  auto T = T_.head<kPixels>();
  T.array() -= T.mean();
  const float norm = std::max(T.norm(), 1e-3F);
  T /= norm;
  J /= norm;
  // Without what brightness and contrast explain, (KLT-4).
  J.topRows<kPixels>().rowwise() -= J.topRows<kPixels>().colwise().mean().eval();
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
    const auto seen = grey.head<kPixels>();
    const float norm = (seen.array() - seen.mean()).matrix().norm();
    return norm > 1e-3F ? gain / norm : -1.F;
  }
  return -1.F;
}

}  // namespace viwo::klt

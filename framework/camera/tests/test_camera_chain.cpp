#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "viwo/camera/camera_chain.hpp"

namespace viwo {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

std::vector<CameraView> three_cameras() {
  std::vector<CameraView> cameras(3);
  cameras[0].R_ItoC = AngleAxisd(0.4, Vector3d(1., 2., -1.).normalized()).toRotationMatrix();
  cameras[1].R_ItoC = AngleAxisd(-1.2, Vector3d(0., 1., 1.).normalized()).toRotationMatrix();
  cameras[2].R_ItoC = AngleAxisd(2.5, Vector3d(1., 0., 3.).normalized()).toRotationMatrix();
  return cameras;
}

/// What is drawn has the correlations that the filter is told.
TEST(CameraChain, CorrelationsAreThoseOfWhatIsDrawn) {
  constexpr int kDraws = 40'000;
  std::mt19937 random(1);
  std::normal_distribution<double> gaussian;
  const auto drawn = [&] { return Vector3d(gaussian(random), gaussian(random), gaussian(random)); };
  const std::vector<CameraView> cameras = three_cameras();
  for (const double relative : {0.3, 1.}) {
    Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(18, 18);
    for (int draw = 0; draw < kDraws; ++draw) {
      Eigen::VectorXd errors(18);
      for (const Eigen::Index part : {0, 3}) {
        ChainedErrors chained(relative);
        for (Eigen::Index k = 0; k < 3; ++k) {
          errors.segment<3>(6 * k + part) =
              chained.next(cameras[static_cast<std::size_t>(k)].R_ItoC, drawn());
        }
      }
      scatter += errors * errors.transpose() / kDraws;
    }
    const Eigen::MatrixXd expected = chain_correlations(relative, cameras);
    EXPECT_LT((scatter - expected).cwiseAbs().maxCoeff(), 5. / std::sqrt(kDraws)) << relative;
    EXPECT_GT((scatter - chain_correlations(0.6, cameras)).cwiseAbs().maxCoeff(), 0.1);
  }
  EXPECT_EQ(chain_correlations(1., cameras), Eigen::MatrixXd::Identity(18, 18));
}

/// A mount that is moved on the IMU: what the cameras know of each other stays.
TEST(CameraChain, WhatIsOfTheFirstMovesTheCamerasTogether) {
  std::vector<CameraView> cameras = three_cameras();
  cameras[0].p_IinC = Vector3d(0.1, -0.2, 0.05);
  cameras[1].p_IinC = Vector3d(-0.3, 0.02, 0.4);
  cameras[2].p_IinC = Vector3d(0.01, 0.2, -0.1);
  const Vector3d turn(0.3, -0.2, 0.5), shift(0.2, 0.1, -0.4);
  ChainedErrors turns(0.), shifts(0.);
  std::vector<CameraView> moved = cameras;
  for (std::size_t k = 0; k < 3; ++k) {
    const Matrix3d& R_ItoC = cameras[k].R_ItoC;
    const Vector3d theta = turns.next(R_ItoC, k == 0 ? turn : Vector3d::Ones());
    moved[k].R_ItoC =
        AngleAxisd(theta.norm(), theta.normalized()).toRotationMatrix() * cameras[k].R_ItoC;
    moved[k].p_IinC += shifts.next(R_ItoC, k == 0 ? shift : Vector3d::Ones());
  }
  const auto between = [](const std::vector<CameraView>& of, std::size_t k) {
    const Matrix3d R_C0toC = of[k].R_ItoC * of[0].R_ItoC.transpose();
    return std::pair(R_C0toC, Vector3d(of[k].p_IinC - R_C0toC * of[0].p_IinC));
  };
  for (const std::size_t k : {1u, 2u}) {
    EXPECT_LT((between(moved, k).first - between(cameras, k).first).norm(), 1e-14);
    EXPECT_LT((between(moved, k).second - between(cameras, k).second).norm(), 1e-14);
  }
}

}  // namespace
}  // namespace viwo

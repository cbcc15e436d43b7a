// Jacobians carried back to the start, against what they are there.
#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "viwo/math/so3.hpp"
#include "viwo/observability/observability_matrix.hpp"

namespace viwo {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

ImuPrior start_prior() {
  ImuPrior prior;
  prior.state.R_GtoI = exp_so3({0.1, -0.2, 0.7});
  prior.state.p_IinG = {0.3, -0.4, 0.2};
  prior.state.v_IinG = {0.5, 0.1, -0.05};
  prior.P.diagonal().setConstant(0.01);
  return prior;
}

/// A filter whose camera extrinsics are six calibration columns.
Filter make_filter(const std::vector<RoomSpec>& rooms = {}) {
  FilterOptions options;
  options.clones = 3;
  BlockSpec camera;
  camera.name = "cam0.extrinsics";
  camera.add_rotation({"a", "b", "c"}, Eigen::Matrix3d::Identity(), Vector3d::Constant(0.02));
  camera.add("x", "m", 0., 0.02).add("y", "m", 0., 0.).add("z", "m", 0., 0.02);  // y is held
  Filter filter(options, {camera}, rooms);
  filter.initialize(start_prior());
  return filter;
}

int camera_column(const Filter& filter) { return filter.blocks().views()[0].column(); }

/// One more epoch of a quiet tumble; returns the transition.
ImuMatrix advance(Filter& filter) {
  std::vector<ImuSample> samples(5);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i].t_ns = filter.t_ns() + static_cast<std::int64_t>(i) * 20'000'000;
    samples[i].gyro_rad_per_s = {0.3, -0.2, 0.5};
    samples[i].accel_m_per_s2 = {0.2, 0.1, 9.7};
  }
  const ImuTransition transition = filter.propagate(samples);
  filter.clone(samples.back());
  return transition.Phi;
}

/// M^T M in units of the noise.
MatrixXd gram(ObservabilityMatrix& matrix) {
  const MatrixXd R = matrix.triangle();
  return R.transpose() * R;
}

TEST(ObservabilityMatrix, LeavesHeldColumnsOut) {
  const Filter filter = make_filter();
  const ObservabilityMatrix matrix(filter, {});
  EXPECT_EQ(matrix.size(), 15 + 5 + 3);
  const int first = camera_column(filter);
  EXPECT_EQ(matrix.state_column(first), 15);
  EXPECT_EQ(matrix.state_column(first + 4), -1);
  EXPECT_EQ(matrix.state_column(first + 5), 19);
  EXPECT_EQ(matrix.state_column(-1), -1);
  EXPECT_NEAR(matrix.prior_sigma()[16], 0.02, 1e-15);
}

TEST(ObservabilityMatrix, CarriesAFactorBackToTheStart) {
  Filter filter = make_filter();
  ObservabilityMatrix matrix(filter, {.enabled = false});
  const ImuMatrix Phi1 = advance(filter);
  matrix.on_clone(filter, Phi1);
  const ImuMatrix Phi2 = advance(filter);
  matrix.on_clone(filter, Phi2);

  // Rows on both clones, the velocity and the calibration.
  ResidualFactor factor;
  factor.columns.add(filter.clones()[0].column, 6);
  factor.columns.add(filter.clones()[1].column, 6);
  factor.columns.add(kVelocityColumn, 3);
  factor.columns.add(camera_column(filter), 6);
  factor.set_rows(3);
  std::mt19937_64 rng(1);
  std::normal_distribution<double> gaussian;
  factor.H = MatrixXd::NullaryExpr(3, 21, [&] { return gaussian(rng); });
  factor.R = Vector3d(0.04, 0.09, 0.01).asDiagonal();
  matrix.on_factor(filter, {}, factor);

  MatrixXd expected = MatrixXd::Zero(3, 20);
  const ImuMatrix Phi21 = Phi2 * Phi1;
  expected.leftCols<15>() = factor.H.leftCols(6) * Phi1.topRows<6>() +
                            factor.H.middleCols(6, 6) * Phi21.topRows<6>() +
                            factor.H.middleCols(12, 3) * Phi21.middleRows<3>(kVelocityColumn);
  for (const auto& [of, own] : {std::pair{0, 15}, {1, 16}, {2, 17}, {3, 18}, {5, 19}}) {
    expected.col(own) = factor.H.col(15 + of);
  }
  const MatrixXd weight = factor.R.inverse();
  const MatrixXd information = expected.transpose() * weight * expected;
  EXPECT_LT((gram(matrix) - information).norm(), 1e-9 * information.norm());

  // The same as normal equations.
  ObservabilityMatrix by_information(make_filter(), {.enabled = false});
  Filter again = make_filter();
  for (int i = 0; i < 2; ++i) {
    const ImuMatrix Phi = advance(again);
    by_information.on_clone(again, Phi);
  }
  InformationFactor normal;
  normal.columns = factor.columns;
  normal.Lambda = factor.H.transpose() * weight * factor.H;
  normal.eta = VectorXd::Zero(21);
  by_information.on_factor(again, {}, normal);
  EXPECT_LT((gram(by_information) - information).norm(), 1e-9 * information.norm());
}

TEST(ObservabilityMatrix, DoesNotTakeLandmarksAsKnown) {
  // GIVEN a factor of a pose and of a landmark that stands in the state
  Filter filter = make_filter({{.name = "landmarks", .blocks = 2, .entries = 3}});
  ObservabilityMatrix matrix(filter, {.enabled = false});
  const ImuMatrix Phi = advance(filter);
  matrix.on_clone(filter, Phi);
  ResidualFactor factor;
  factor.columns.add(filter.clones()[0].column, 6);
  factor.columns.add(filter.blocks().views().back().column(), 3);
  factor.set_rows(5);
  std::mt19937_64 rng(2);
  std::normal_distribution<double> gaussian;
  factor.H = MatrixXd::NullaryExpr(5, 9, [&] { return gaussian(rng); });
  factor.R.setIdentity();
  matrix.on_factor(filter, {}, factor);
  // THEN what remains is what it tells when nothing is known of the landmark
  const MatrixXd H = factor.H.leftCols(6) * Phi.topRows<6>(), L = factor.H.rightCols(3);
  const MatrixXd without =
      MatrixXd::Identity(5, 5) - L * (L.transpose() * L).inverse() * L.transpose();
  const MatrixXd expected = H.transpose() * without * H;
  const MatrixXd found = gram(matrix).topLeftCorner(15, 15);
  EXPECT_LT((found - expected).norm(), 1e-9 * expected.norm());

  // The same as normal equations; and one bearing of it says nothing of the pose.
  ObservabilityMatrix by_information(filter, {.enabled = false});
  by_information.on_clone(filter, Phi);
  InformationFactor normal;
  normal.columns = factor.columns;
  normal.Lambda = factor.H.transpose() * factor.H;
  normal.eta = VectorXd::Zero(9);
  by_information.on_factor(filter, {}, normal);
  EXPECT_LT((gram(by_information) - gram(matrix)).norm(), 1e-9 * expected.norm());
  ObservabilityMatrix of_bearing(filter, {.enabled = false});
  of_bearing.on_clone(filter, Phi);
  const MatrixXd bearing = factor.H.topRows(2);
  normal.Lambda = bearing.transpose() * bearing;
  of_bearing.on_factor(filter, {}, normal);
  EXPECT_LT(gram(of_bearing).norm(), 1e-9);
}

/// Bearing of the feature in the frame of the last clone, when the start was off by `dx`.
Vector3d bearing(const VectorXd& dx) {
  const Vector3d p_FinI(4., 3., 2.);
  const ImuPrior truth = start_prior();
  const Vector3d p_FinG =
      truth.state.p_IinG + truth.state.R_GtoI.transpose() * p_FinI + Vector3d(dx.tail<3>());
  ImuPrior off = truth;
  off.state.R_GtoI = exp_so3(-dx.segment<3>(kThetaColumn)) * off.state.R_GtoI;
  off.state.p_IinG += dx.segment<3>(kPositionColumn);
  off.state.v_IinG += dx.segment<3>(kVelocityColumn);
  off.state.gyro_bias += dx.segment<3>(kGyroBiasColumn);
  off.state.accel_bias += dx.segment<3>(kAccelBiasColumn);
  Filter filter = make_filter();
  filter.initialize(off);
  advance(filter);
  advance(filter);
  const CloneState& clone = filter.clones().back();
  return (clone.R_GtoI * (p_FinG - clone.p_IinG)).normalized();
}

TEST(ObservabilityMatrix, SeesTheFeatureAsItsBearingChangesWithTheStart) {
  Filter filter = make_filter();
  ObservabilityMatrix matrix(filter, {});
  MatrixXd expected = MatrixXd::Zero(matrix.size(), matrix.size());
  ImuMatrix Phi = advance(filter);
  advance(filter);
  // Only the last epoch is looked at: both steps in one transition.
  Filter two = make_filter();
  const ImuMatrix first = advance(two);
  const ImuMatrix second = advance(two);
  EXPECT_EQ(first, Phi);
  Phi = second * first;
  matrix.on_clone(two, Phi);
  constexpr double kStep = 1e-6;
  MatrixXd J = MatrixXd::Zero(3, matrix.size());
  for (int i = 0; i < matrix.size(); ++i) {
    if (i >= 15 && i < 20) continue;  // the calibration has no part in it
    const VectorXd step = kStep * VectorXd::Unit(matrix.size(), i);
    J.col(i) = (bearing(step) - bearing(-step)) / (2. * kStep);
  }
  const double sigma = FeatureOptions().sigma_bearing_rad;
  expected = J.transpose() * J / (sigma * sigma);
  EXPECT_LT((gram(matrix) - expected).norm(), 1e-5 * expected.norm());
}

TEST(ObservabilityMatrix, KeepsItsInformationOverManyRows) {
  Filter filter = make_filter();
  ObservabilityMatrix matrix(filter, {});
  MatrixXd sum = MatrixXd::Zero(matrix.size(), matrix.size());
  for (int epoch = 0; epoch < 400; ++epoch) {
    if (filter.window_full()) filter.drop_oldest_clone();
    const ImuMatrix Phi = ImuMatrix::Identity();
    advance(filter);
    ObservabilityMatrix alone(make_filter(), {});
    matrix.on_clone(filter, Phi);
    alone.on_clone(filter, Phi);
    sum += gram(alone);
  }
  EXPECT_LT((gram(matrix) - sum).norm(), 1e-10 * sum.norm());
}

}  // namespace
}  // namespace viwo

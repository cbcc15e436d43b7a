// Twist, sensitivities and parity residual of every model against independent computations.
#include <cmath>

#include <Eigen/Dense>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "message_of.hpp"
#include "more_bases.hpp"
#include "viwo/math/se2.hpp"
#include "viwo/testing/jacobian.hpp"
#include "viwo/wheel/twist_solver.hpp"
#include "wheel_fixture.hpp"

namespace viwo {
namespace {

using testing::central_difference;
using testing::differential;
using testing::follow;
using testing::jacobian_mismatch;
using testing::load_model;
using testing::swerve;

struct Case {
  const char* name;
  Twist xi;
};

const Case kSwerveCases[] = {{"rest", {0., 0., 0.}},
                             {"straight", {0.5, 0., 0.}},
                             {"crab", {0., 0.5, 0.}},
                             {"spin", {0., 0., 0.8}},
                             {"arc", {0.4, 0.1, 0.6}},
                             {"reverse", {-0.5, 0.05, -0.3}},
                             {"steering limit", {0.02, -0.5, 0.9}},
                             {"slow", {1e-4, 2e-4, 1e-4}}};
const Case kDifferentialCases[] = {{"rest", {0., 0., 0.}},
                                   {"straight", {0.5, 0., 0.}},
                                   {"spin", {0., 0., 0.8}},
                                   {"arc", {0.4, 0., 0.6}},
                                   {"reverse", {-0.5, 0., -0.3}}};
const Case kCarCases[] = {{"rest", {0., 0., 0.}},
                          {"straight", {0.5, 0., 0.}},
                          {"arc", {0.4, 0., 0.6}},
                          {"steering limit", {0.21, 0., -1.}},
                          {"reverse", {-0.5, 0., -0.3}}};
// v_y = -x_icr omega, with the x_icr of skid_steer().
const Case kSkidCases[] = {{"rest", {0., 0., 0.}},
                           {"straight", {0.5, 0., 0.}},
                           {"spin", {0., 0.04, 0.8}},
                           {"arc", {0.4, 0.03, 0.6}},
                           {"reverse", {-0.5, -0.015, -0.3}}};

std::vector<std::string> intrinsic_names(const WheelModel& model) {
  std::vector<std::string> names;
  for (const auto& spec : model.description().intrinsics) names.push_back(spec.name);
  return names;
}

/// A sample that no rigid body motion explains: e is far from zero, so the second term of the
/// master identity counts.
EncoderSample disturbed(EncoderSample y) {
  for (int i = 0; i < y.n_drive; ++i)
    y.drive_rad_per_s[static_cast<std::size_t>(i)] += 0.3 * std::sin(3. * i + 1.);
  for (int i = 0; i < y.n_steer; ++i)
    y.steer_rad[static_cast<std::size_t>(i)] += 0.04 * std::cos(2. * i);
  return y;
}

class EveryModel : public ::testing::TestWithParam<std::string> {
 protected:
  std::shared_ptr<const WheelModel> model_ = load_model(GetParam());
  std::span<const Case> cases() const {
    if (GetParam().find("skid_steer") != std::string::npos) return kSkidCases;
    if (GetParam().find("ackermann") != std::string::npos) return kCarCases;
    if (GetParam().find("mecanum") != std::string::npos) return kSwerveCases;
    return model_->description().n_steer == 0 ? std::span<const Case>(kDifferentialCases)
                                              : std::span<const Case>(kSwerveCases);
  }
};

INSTANTIATE_TEST_SUITE_P(
    , EveryModel,
    ::testing::Values(swerve("four_wis_wid"), swerve("four_wis_wid_drive_only"), differential(),
                      differential(", left_drives: [1, 4], right_drives: [2, 3]")));

INSTANTIATE_TEST_SUITE_P(More, EveryModel, ::testing::ValuesIn(testing::more_bases()));

TEST_P(EveryModel, GivesBackTheTwistOfASlipFreeSample) {
  TwistSolver solver(model_, {.rank_tolerance = 1e-9});
  for (const Case& c : cases()) {
    EncoderSample y;
    follow(*model_, c.xi, y);
    TwistSolution solution;
    ASSERT_EQ(solver.solve(y, solution), Status::kOk) << c.name;
    if (solution.rank_deficient) continue;  // parallel rolling rows: tested below
    EXPECT_LT((solution.xi - c.xi).norm(), 1e-12) << c.name;
    EXPECT_LT(solution.e.norm(), 1e-12) << c.name;
  }
}

TEST_P(EveryModel, HasTheSensitivityOfCentralDifferences) {
  for (const bool weighted : {false, true}) {
    for (const Case& c : cases()) {
      EncoderSample y;
      follow(*model_, c.xi, y);
      y = disturbed(y);
      TwistSolver solver(model_, {.noise_weighted = weighted, .rank_tolerance = 1e-9});
      const auto twist_of = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
        TwistSolution solution;
        solver.move_intrinsics(x);
        solver.solve(y, solution);
        return solution.xi;
      };
      const Eigen::MatrixXd numeric = central_difference(twist_of, model_->nominal(), 1e-5);
      TwistSolution solution;
      solver.set_intrinsics(model_->nominal());
      ASSERT_EQ(solver.solve(y, solution), Status::kOk);
      if (GetParam().find("left_drives") != std::string::npos || model_->n_rows() > 3) {
        EXPECT_GT(solution.e.norm(), 1e-4)
            << c.name << ": the case does not test the residual term";
      }
      EXPECT_EQ(jacobian_mismatch(solution.J_xi_WI, numeric, intrinsic_names(*model_), 1e-5), "")
          << c.name;
    }
  }
}

TEST_P(EveryModel, PropagatesTheNoiseOfCentralDifferences) {
  for (const Case& c : cases()) {
    EncoderSample y;
    follow(*model_, c.xi, y);
    y = disturbed(y);
    TwistSolver solver(model_, {.rank_tolerance = 1e-9});
    Eigen::Matrix3d P = Eigen::Matrix3d::Zero();
    for (const NoiseSpec& noise : model_->description().noises) {
      if (noise.kind == NoiseKind::kSlip) continue;
      const auto twist_of = [&](const Eigen::VectorXd& n) -> Eigen::VectorXd {
        EncoderSample moved = y;
        const auto channel = static_cast<std::size_t>(noise.channel);
        (noise.kind == NoiseKind::kDrive ? moved.drive_rad_per_s : moved.steer_rad)[channel] +=
            n[0];
        TwistSolution solution;
        solver.solve(moved, solution);
        return solution.xi;
      };
      const Eigen::Vector3d g = central_difference(twist_of, Eigen::VectorXd::Zero(1));
      P += noise.sigma * noise.sigma * g * g.transpose();
    }
    // Slip enters b directly: A+ column by column, the directions written out here again.
    TwistSolution solution;
    ASSERT_EQ(solver.solve(y, solution), Status::kOk);
    RowSystem rows;
    rows.A.setZero(model_->n_rows(), 3);
    rows.b.setZero(model_->n_rows());
    model_->model().rows(y, model_->nominal(), false, rows);
    const Eigen::MatrixXd A_plus =
        Eigen::MatrixXd(rows.A).completeOrthogonalDecomposition().pseudoInverse();
    for (const NoiseSpec& noise : model_->description().noises) {
      if (noise.kind != NoiseKind::kSlip) continue;
      Eigen::VectorXd direction = Eigen::VectorXd::Zero(model_->n_rows());
      if (noise.rows.count == 2) {  // a steered wheel, written in O
        const double delta = y.steer_rad[static_cast<std::size_t>(noise.channel)] -
                             model_->nominal()[3 * y.n_steer + noise.channel];
        direction.segment<2>(noise.rows.first) << -std::sin(delta), std::cos(delta);
      } else {
        direction[noise.rows.first] = 1.;
      }
      const Eigen::Vector3d g = A_plus * direction;
      P += noise.sigma * noise.sigma * g * g.transpose();
    }
    EXPECT_LT((solution.P_xi - P).norm(), 1e-6 * P.norm()) << c.name;
  }
}

TEST_P(EveryModel, WeightsTheRowsByTheirNoise) {
  // The weighted twist of a sample against a dense generalised least-squares fit.
  for (const Case& c : cases()) {
    EncoderSample y;
    follow(*model_, c.xi, y);
    y = disturbed(y);
    TwistSolver solver(model_, {.noise_weighted = true, .rank_tolerance = 1e-9});
    TwistSolver plain(model_, {.rank_tolerance = 1e-9});
    TwistSolution solution, first;
    ASSERT_EQ(solver.solve(y, solution), Status::kOk);
    ASSERT_EQ(plain.solve(y, first), Status::kOk);
    const int m = model_->n_rows(), q = model_->n_noises();
    RowSystem rows;
    rows.A.setZero(m, 3);
    rows.b.setZero(m);
    model_->model().rows(y, model_->nominal(), false, rows);
    NoiseDerivatives by_n;
    by_n.J.setZero(m, q);
    by_n.DtE.setZero(3, q);
    model_->model().noise_derivatives(y, model_->nominal(), rows, rows.b, first.xi, first.e, by_n);
    Eigen::MatrixXd R = Eigen::MatrixXd::Zero(m, m);
    for (int k = 0; k < q; ++k) {
      const double sigma = model_->description().noises[static_cast<std::size_t>(k)].sigma;
      R += sigma * sigma * by_n.J.col(k) * by_n.J.col(k).transpose();
    }
    const Eigen::MatrixXd W = R.inverse();
    const Eigen::MatrixXd A = rows.A;
    const Eigen::Vector3d xi = (A.transpose() * W * A).ldlt().solve(A.transpose() * W * rows.b);
    EXPECT_LT((solution.xi - xi).norm(), 1e-8 * (1. + xi.norm())) << c.name;
    const double chi2 = (rows.b - A * xi).dot(W * (rows.b - A * xi));
    EXPECT_NEAR(solver.parity().chi2(), chi2, 1e-7 * (1. + chi2)) << c.name;
    EXPECT_NEAR(plain.parity().chi2(), chi2, 1e-7 * (1. + chi2)) << c.name;
  }
}

TEST_P(EveryModel, AccumulatesTheParityInformationOfAnExplicitNullSpaceBasis) {
  for (const Case& c : cases()) {
    EncoderSample y;
    follow(*model_, c.xi, y);
    y = disturbed(y);
    TwistSolver solver(model_, {.rank_tolerance = 1e-9});
    TwistSolution solution;
    ASSERT_EQ(solver.solve(y, solution), Status::kOk);
    const TwistSolver::Parity of_sample = solver.parity();
    if (of_sample.dof() <= 0) continue;
    ParityInformation parity;
    const int m = model_->n_rows(), n = model_->n_intrinsics(), q = model_->n_noises();
    parity.reset(n);
    solver.add_parity(of_sample, 1., parity);

    RowSystem rows;
    rows.A.setZero(m, 3);
    rows.b.setZero(m);
    model_->model().rows(y, model_->nominal(), false, rows);
    NoiseDerivatives by_n;
    by_n.J.setZero(m, q);
    by_n.DtE.setZero(3, q);
    model_->model().noise_derivatives(y, model_->nominal(), rows, rows.b, solution.xi, solution.e,
                                      by_n);
    Eigen::MatrixXd R = Eigen::MatrixXd::Zero(m, m);
    for (int k = 0; k < q; ++k) {
      const double sigma = model_->description().noises[static_cast<std::size_t>(k)].sigma;
      R += sigma * sigma * by_n.J.col(k) * by_n.J.col(k).transpose();
    }
    const Eigen::MatrixXd A = rows.A;
    // Left null space of A, and the fitted signal of the weighted twist.
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(A);
    qr.setThreshold(1e-6);
    const Eigen::MatrixXd full_Q = qr.householderQ();
    const Eigen::MatrixXd N = full_Q.rightCols(m - qr.rank());
    const Eigen::MatrixXd W = R.inverse();
    const Eigen::Vector3d xi =
        (A.transpose() * W * A).completeOrthogonalDecomposition().solve(A.transpose() * W * rows.b);
    IntrinsicDerivatives by_x;
    by_x.J.setZero(m, n);
    by_x.DtE.setZero(3, n);
    const RowVector b_fit = A * xi;
    model_->model().intrinsic_derivatives(y, model_->nominal(), rows, b_fit, xi, solution.e, by_x);
    const Eigen::MatrixXd H = N.transpose() * by_x.J;
    const Eigen::MatrixXd S = (N.transpose() * R * N).inverse();
    const Eigen::MatrixXd Lambda = H.transpose() * S * H;
    const Eigen::VectorXd eta = H.transpose() * S * N.transpose() * rows.b;
    // Both come out of differences of J^T R^-1 J, which may be much larger.
    const double rounding = 1e-11 * (by_x.J.transpose() * W * by_x.J).norm();
    EXPECT_LT((parity.Lambda - Lambda).norm(), 1e-6 * Lambda.norm() + rounding) << c.name;
    EXPECT_LT((parity.eta - eta).norm(), 1e-6 * eta.norm() + rounding) << c.name;
    EXPECT_EQ(parity.dof, static_cast<int>(N.cols())) << c.name;
  }
}

TEST(FourWisWid, HasAConstantNormalMatrixWhateverTheSteering) {
  const auto model = load_model(swerve("four_wis_wid"));
  Eigen::Matrix3d first;
  for (const Case& c : kSwerveCases) {
    EncoderSample y;
    follow(*model, c.xi, y);
    RowSystem rows;
    rows.A.setZero(8, 3);
    rows.b.setZero(8);
    model->model().rows(y, model->nominal(), false, rows);
    const Eigen::Matrix3d M = rows.A.transpose() * rows.A;
    if (c.name == std::string("rest")) first = M;
    EXPECT_EQ(M, first) << c.name;
  }
  // (S-10): [[N I2, N J pbar], [.., sum |p|^2]].
  const Intrinsics x = model->nominal();
  const Eigen::Vector2d mean(x.segment<4>(4).mean(), x.segment<4>(8).mean());
  EXPECT_NEAR(first(0, 0), 4., 1e-15);
  EXPECT_LT((first.block<2, 1>(0, 2) - 4. * J2() * mean).norm(), 1e-15);
  EXPECT_NEAR(first(2, 2), x.segment<8>(4).squaredNorm(), 1e-15);
}

TEST(FourWisWid, HasTheTwistAndResidualOfThePapersWheelFrameRows) {
  const auto model = load_model(swerve("four_wis_wid"));
  const Intrinsics x = model->nominal();
  for (const Case& c : kSwerveCases) {
    EncoderSample y;
    follow(*model, c.xi, y);
    y = disturbed(y);
    // Paper, eq. (ab_rows) and (forward_map): four rolling rows over four lateral rows.
    Eigen::Matrix<double, 8, 3> A;
    Eigen::Matrix<double, 8, 1> v = Eigen::Matrix<double, 8, 1>::Zero();
    for (int j = 0; j < 4; ++j) {
      const double delta = y.steer_rad[static_cast<std::size_t>(j)] - x[12 + j];
      const double cd = std::cos(delta), sd = std::sin(delta), xw = x[4 + j], yw = x[8 + j];
      A.row(j) << cd, sd, -yw * cd + xw * sd;
      A.row(4 + j) << -sd, cd, yw * sd + xw * cd;
      v[j] = x[j] * y.drive_rad_per_s[static_cast<std::size_t>(j)];
    }
    const Eigen::Vector3d xi = A.colPivHouseholderQr().solve(v);
    TwistSolver solver(model, {});
    TwistSolution solution;
    ASSERT_EQ(solver.solve(y, solution), Status::kOk);
    EXPECT_LT((solution.xi - xi).norm(), 1e-12) << c.name;
    EXPECT_NEAR(solution.e.norm(), (v - A * xi).norm(), 1e-12) << c.name;
  }
}

TEST(FourWisWid, CannotTellTheCommonScaleFromTheParityResidual) {
  // Both scale directions, all radii and all positions, must be free of information, exactly, also
  // for samples that do not fit (W-9: else an errors-in-variables pull).
  const auto model = load_model(swerve("four_wis_wid"));
  std::mt19937_64 rng(7);
  TwistSolver solver(model, {});
  ParityInformation parity;
  parity.reset(16);
  for (const Case& c : kSwerveCases) {
    EncoderSample clean;
    follow(*model, c.xi, clean);
    const EncoderSample y = testing::with_noise(*model, c.xi, clean, 20., rng);
    TwistSolution solution;
    solver.solve(y, solution);
    solver.add_parity(solver.parity(), 1., parity);
  }
  const Intrinsics x = model->nominal();
  Intrinsics radii = Intrinsics::Zero(16);
  radii.head<4>() = x.head<4>();
  EXPECT_LT((parity.Lambda * radii).norm(), 1e-9 * (parity.Lambda.norm() * radii.norm()));
  EXPECT_GT((parity.Lambda * Intrinsics(x)).norm(), 1e-6 * parity.Lambda.norm() * x.norm())
      << "the test must be able to see a direction that is observable";
}

}  // namespace
}  // namespace viwo

// Twist and increment against the equations of the paper, written down here once more as they are
// printed; against numerical integration, central differences and simulated noise.
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "increment.hpp"
#include "viwo/math/se2.hpp"
#include "viwo/testing/jacobian.hpp"
#include "wheel_fixture.hpp"

namespace viwo::wheel_relative_pose {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::load_model;
using testing::swerve;

constexpr std::int64_t kPeriodNs = 10'000'000;
const std::string kAllRows = swerve("four_wis_wid");
const std::string kRollingRows = swerve("four_wis_wid_drive_only");

Twist sweep(double t) {
  return {0.4 * std::cos(0.9 * t), 0.3 * std::sin(1.3 * t), 0.7 * std::sin(2.8 * t) + 0.1};
}

std::vector<EncoderSample> noisy_sweep(const WheelModel& model, double duration_s, int seed) {
  std::mt19937_64 rng(static_cast<std::uint64_t>(seed));
  auto samples = testing::sample_motion(model, sweep, duration_s, 100.);
  for (EncoderSample& y : samples) {
    const double t = 1e-9 * static_cast<double>(y.t_ns);
    y = testing::with_noise(model, sweep(t), y, 1., rng);
  }
  return samples;
}

/// One percent, one centimetre, ten milliradians off, up or down.
Intrinsics rough(const WheelModel& model) {
  Intrinsics x = model.nominal();
  for (int i = 0; i < 16; ++i) x[i] += (i % 3 == 1 ? -0.01 : 0.01) * (i < 4 ? x[i] : 1.);
  return x;
}

/// The section "Odometry Measurement with Intrinsics" as printed: rows in the frames of the wheels,
/// theta that shrinks with omega. With `lateral` false its reduced map.
struct Printed {
  Intrinsics x;
  bool lateral;
  double sigma_d = 1e-3, sigma_delta = 1e-3, sigma_l = 1e-3;

  Vector3d xi = Vector3d::Zero(), g = Vector3d::Zero();
  MatrixXd H_x = {}, H_n = {}, by_x = MatrixXd::Zero(3, 16);
  VectorXd e = {};
  Matrix3d P = Matrix3d::Zero();

  void twist(const EncoderSample& y) {
    const int m = lateral ? 8 : 4;
    MatrixXd A(m, 3);
    VectorXd v = VectorXd::Zero(m);
    for (int j = 0; j < 4; ++j) {
      const double delta = y.steer_rad[static_cast<std::size_t>(j)] - x[12 + j];
      const double c = std::cos(delta), s = std::sin(delta), px = x[4 + j], py = x[8 + j];
      A.row(j) << c, s, -py * c + px * s;  // ab_rows, c_definitions
      if (lateral) A.row(4 + j) << -s, c, py * s + px * c;
      v[j] = x[j] * y.drive_rad_per_s[static_cast<std::size_t>(j)];
    }
    const Matrix3d N = (A.transpose() * A).inverse();
    const MatrixXd A_plus = N * A.transpose();
    xi = A_plus * v;  // twist_ls
    e = v - A * xi;
    H_x.setZero(3, 16);
    H_n.setZero(3, lateral ? 12 : 8);
    const auto D_term = [&](int j, const Vector3d& a, const Vector3d& b) {
      // master_identity with D that has the rows a^T and b^T.
      Vector3d column = -A_plus.col(j) * a.dot(xi) + N * a * e[j];
      if (lateral) column += -A_plus.col(4 + j) * b.dot(xi) + N * b * e[4 + j];
      return column;
    };
    for (int j = 0; j < 4; ++j) {
      const Vector3d a = A.row(j);
      const double c = a[0], s = a[1];
      const Vector3d b(-s, c, x[8 + j] * s + x[4 + j] * c);
      const double omega_m = y.drive_rad_per_s[static_cast<std::size_t>(j)];
      H_x.col(j) = omega_m * A_plus.col(j);              // jac_radii
      H_x.col(12 + j) = D_term(j, -b, a);                // jac_steering
      H_x.col(4 + j) = D_term(j, {0, 0, s}, {0, 0, c});  // jac_position
      H_x.col(8 + j) = D_term(j, {0, 0, -c}, {0, 0, s});
      H_n.col(j) = -x[j] * A_plus.col(j);  // jac_noise
      H_n.col(4 + j) = H_x.col(12 + j);
      if (lateral) H_n.col(8 + j) = A_plus.col(4 + j);
    }
  }

  void advance(double dt) {
    const double omega = xi[2], z = omega * dt / 2.;
    const double rho = 2. / omega * std::sin(z);
    const double rho_prime = dt * dt / 2. * (z * std::cos(z) - std::sin(z)) / (z * z);
    const double theta_m = g[0] - omega * dt / 2.;
    const double c = std::cos(theta_m), s = std::sin(theta_m);
    const double dx = rho * (xi[0] * c + xi[1] * s);  // preint_closed_form
    const double dy = rho * (-xi[0] * s + xi[1] * c);
    Matrix3d Phi_tr, Phi_xi;  // Phi_tr_xi
    Phi_tr << 1, 0, 0, dy, 1, 0, -dx, 0, 1;
    Phi_xi << 0, 0, -dt, rho * c, rho * s, rho_prime / rho * dx - dt / 2. * dy, -rho * s, rho * c,
        rho_prime / rho * dy + dt / 2. * dx;
    VectorXd Q(H_n.cols());
    Q.head(4).setConstant(sigma_d * sigma_d);
    Q.segment(4, 4).setConstant(sigma_delta * sigma_delta);
    Q.tail(Q.size() - 8).setConstant(sigma_l * sigma_l);
    by_x = (Phi_tr * by_x + Phi_xi * H_x).eval();  // dg_dxWI_recursion
    const MatrixXd Phi_n = Phi_xi * H_n;
    P = (Phi_tr * P * Phi_tr.transpose() + Phi_n * Q.asDiagonal() * Phi_n.transpose()).eval();
    g += Vector3d(-omega * dt, dx, dy);
  }
};

TEST(Increment, IsThatOfThePrintedEquationsWithTheOtherSignOfYaw) {
  const Vector3d S(-1., 1., 1.);
  for (const bool lateral : {true, false}) {
    const auto model = load_model(lateral ? kAllRows : kRollingRows);
    Printed printed{rough(*model), lateral};
    TwistSolver solver(model, {.rank_tolerance = 0.});
    solver.set_intrinsics(printed.x);
    Increment ours;
    ours.reset(16);
    double largest_e = 0.;
    for (const EncoderSample& y : noisy_sweep(*model, 1., 1)) {
      TwistSolution twist;
      ASSERT_EQ(solver.solve(y, twist), Status::kOk);
      printed.twist(y);
      EXPECT_LT((twist.xi - printed.xi).norm(), 1e-10);
      EXPECT_NEAR(twist.e.norm(), printed.e.norm(), 1e-10);
      largest_e = std::max(largest_e, printed.e.norm());
      EXPECT_LT((twist.J_xi_WI - printed.H_x).norm(), 1e-9 * printed.H_x.norm());
      advance(twist, 0.01, ours);
      printed.advance(0.01);
    }
    EXPECT_LT((S.asDiagonal() * ours.g - printed.g).norm(), 1e-10);
    EXPECT_LT((S.asDiagonal() * ours.J_g_WI - printed.by_x).norm(), 1e-9 * printed.by_x.norm());
    EXPECT_LT((S.asDiagonal() * ours.P_g * S.asDiagonal() - printed.P).norm(),
              1e-9 * printed.P.norm());
    EXPECT_GT(largest_e, 1e-3) << "else the second term of the master identity is not seen";
    // The yaw that kinematic_model prints, with the printed closed form, is another pose: as far
    // off as the base turns.
    const double turned = ours.g[0];
    EXPECT_GT(std::abs(turned - printed.g[0]), 0.5 * std::abs(turned));
  }
}

TEST(Increment, HasTheClosedFormOfTheIntegralOfItsTwists) {
  TwistSolution twist;
  twist.J_xi_WI.setZero(3, 1);
  twist.P_xi.setZero();
  Increment increment;
  increment.reset(1);
  Vector3d fine = Vector3d::Zero();
  for (const Twist& xi : {Twist(0.5, -0.2, 1.3), Twist(0.4, 0.1, 0.), Twist(0., 0.3, 1e-9),
                          Twist(-0.3, 0.2, -2.), Twist::Zero().eval()}) {
    twist.xi = xi;
    advance(twist, 0.1, increment);
    constexpr int kSteps = 20'000;
    for (int i = 0; i < kSteps; ++i) {  // middle of each step: the error is of second order
      const double dt = 0.1 / kSteps;
      fine.tail<2>() += dt * (R2(fine[0] + 0.5 * dt * xi[2]) * xi.head<2>());
      fine[0] += dt * xi[2];
    }
  }
  EXPECT_LT((increment.g - fine).norm(), 1e-9);
}

/// The increment over [0.013, 0.987] s.
Increment integrate(const std::shared_ptr<const WheelModel>& model,
                    const std::vector<EncoderSample>& samples, const Intrinsics& x,
                    const IncrementOptions& options = {}) {
  IncrementIntegrator integrator(model, options);
  integrator.set_intrinsics(x);
  Increment out;
  EXPECT_TRUE(integrator.integrate(samples, 13'000'000, 987'000'000, out));
  return out;
}

IncrementOptions plain() { return {.twist = {.rank_tolerance = 0.}}; }

TEST(Increment, HasTheDerivativeOfItselfAtTheMeasuredReadings) {
  for (const std::string& yaml : {kAllRows, kRollingRows}) {
    const auto model = load_model(yaml);
    const auto samples = noisy_sweep(*model, 1., 2);
    const Intrinsics x = rough(*model);
    const auto g = [&](const VectorXd& at) -> VectorXd {
      return integrate(model, samples, at, plain()).g;
    };
    const MatrixXd numeric = testing::central_difference(g, x);
    EXPECT_EQ(
        testing::jacobian_mismatch(integrate(model, samples, x, plain()).J_g_WI, numeric, {}, 1e-6),
        "");
    // At the readings that the twist predicts it is another one: by the size of what the wheels
    // contradict each other, here that of a wrong calibration.
    IncrementOptions fitted = plain();
    fitted.twist.fitted_jacobian = true;
    const MatrixXd J = integrate(model, samples, x, fitted).J_g_WI;
    EXPECT_GT((J - numeric).norm(), 1e-3 * numeric.norm());
    EXPECT_LT((J - numeric).norm(), 0.1 * numeric.norm());
  }
}

TEST(Increment, CountsNoiseAsInformationAboutWhatTheTwistDoesNotShow) {
  const auto model = load_model(kAllRows);
  // What the slip-free motion hides from the twist: nine directions.
  MatrixXd clean_rows(0, 16), measured = clean_rows, fitted = clean_rows;
  const auto append = [&](MatrixXd& rows, const EncoderSample& y, bool at_fitted) {
    TwistSolver solver(model, {.fitted_jacobian = at_fitted, .rank_tolerance = 0.});
    TwistSolution twist;
    ASSERT_EQ(solver.solve(y, twist), Status::kOk);
    rows.conservativeResize(rows.rows() + 3, 16);
    rows.bottomRows<3>() = twist.J_xi_WI;
  };
  for (const EncoderSample& y : testing::sample_motion(*model, sweep, 10., 100.)) {
    append(clean_rows, y, false);
  }
  for (const EncoderSample& y : noisy_sweep(*model, 10., 3)) {
    append(measured, y, false);
    append(fitted, y, true);
  }
  const Eigen::JacobiSVD<MatrixXd> svd(clean_rows, Eigen::ComputeFullV);
  EXPECT_LT(svd.singularValues()[7], 1e-9 * svd.singularValues()[0]);
  const MatrixXd hidden = svd.matrixV().rightCols(9);
  EXPECT_LT((fitted * hidden).norm(), 1e-9 * fitted.norm());
  // The rows along hidden directions are the noise of the contact velocities, times A+.
  const double noise = (measured * hidden).norm() / measured.norm();
  EXPECT_GT(noise, 1e-4);
  EXPECT_LT(noise, 1e-1);
}

TEST(Increment, OfRollingRowsHasItsOwnDerivativeByTheOffsetsWhichIsZeroWithoutSlip) {
  const auto model = load_model(kRollingRows);
  const auto clean = testing::sample_motion(*model, sweep, 1., 100.);
  const auto by_offsets = [&](const std::vector<EncoderSample>& samples, const Intrinsics& x) {
    return integrate(model, samples, x, plain()).J_g_WI.rightCols<4>().norm();
  };
  EXPECT_LT(by_offsets(clean, model->nominal()), 1e-9);  // Lemma drive_only
  EXPECT_GT(by_offsets(noisy_sweep(*model, 1., 4), model->nominal()), 1e-5);
  EXPECT_GT(by_offsets(clean, rough(*model)), 1e-3);
}

/// Mean of (g - truth)^T P^-1 (g - truth) over draws of the noise.
double mean_square(const std::shared_ptr<const WheelModel>& assumed, int draws) {
  const auto model = load_model(kAllRows);
  const IncrementOptions options{.holds_from_stamp = false};
  const auto clean = testing::sample_motion(*model, sweep, 1., 100.);
  const Vector3d truth = integrate(model, clean, model->nominal(), options).g;
  double sum = 0.;
  for (int i = 0; i < draws; ++i) {
    const Increment one =
        integrate(assumed, noisy_sweep(*model, 1., 100 + i), model->nominal(), options);
    const Vector3d error = one.g - truth;
    sum += error.dot(one.P_g.llt().solve(error));
  }
  return sum / draws;
}

TEST(Increment, HasTheCovarianceThatSimulatedNoiseHas) {
  constexpr int kDraws = 1000;
  // Chi-square of three: variance 6. 99.9 %.
  EXPECT_NEAR(mean_square(load_model(kAllRows), kDraws), 3., 3.29 * std::sqrt(6. / kDraws));
  EXPECT_GT(mean_square(load_model(swerve("four_wis_wid", ", sigma_lateral_m_per_s: 0.0005")), 200),
            4.);
}

TEST(Increment, LeavesOutReadingsWhoseWheelsContradictEachOther) {
  const auto model = load_model(kAllRows);
  auto samples = testing::sample_motion(*model, sweep, 1., 100.);
  const auto error_of = [&](double gate, std::int64_t gated) {
    IncrementOptions options = plain();
    options.residual_gate_m_per_s = gate;
    const Vector3d clean = integrate(model, samples, model->nominal(), options).g;
    auto slipping = samples;
    for (std::size_t k = 50; k < 54; ++k) slipping[k].drive_rad_per_s[2] *= 1.5;
    const Increment one = integrate(model, slipping, model->nominal(), options);
    EXPECT_EQ(one.gated, gated);
    EXPECT_NEAR(one.longest_hold_s, gated > 0 ? 0.05 : 0.01, 1e-9);
    return (one.g - clean).norm();
  };
  const double without = error_of(0., 0);
  EXPECT_GT(without, 1e-3);
  EXPECT_LT(error_of(0.05, 4), 0.3 * without);
}

TEST(Increment, HoldsAReadingFromItsStampWhichIsHalfAPeriodLate) {
  const auto model = load_model(kAllRows);
  const auto samples = testing::sample_motion(*model, sweep, 1., 100.);
  const auto g = [&](bool from_stamp, std::int64_t later_ns) {
    IncrementIntegrator integrator(model, {.holds_from_stamp = from_stamp});
    Increment out;
    EXPECT_TRUE(integrator.integrate(samples, 300'000'000 + later_ns, 400'000'000 + later_ns, out));
    return out.g;
  };
  EXPECT_LT((g(true, kPeriodNs / 2) - g(false, 0)).norm(), 1e-12);
  EXPECT_GT((g(true, 0) - g(false, 0)).norm(), 1e-4);
}

TEST(Increment, SaysWhereReadingsAreMissing) {
  const auto model = load_model(kAllRows);
  auto samples = testing::sample_motion(*model, sweep, 1., 100.);
  IncrementIntegrator integrator(model, {});
  Increment out;
  EXPECT_FALSE(integrator.integrate({}, 0, 1, out));
  EXPECT_FALSE(integrator.integrate(samples, 0, 100'000'000, out)) << "before the first stamp";
  EXPECT_FALSE(integrator.integrate(samples, 950'000'000, 1'010'000'000, out));
  samples.erase(samples.begin() + 50, samples.begin() + 60);
  EXPECT_TRUE(integrator.integrate(samples, 400'000'000, 700'000'000, out));
  EXPECT_NEAR(out.longest_hold_s, 0.11, 1e-9);
  // A base whose wheels are parallel has no twist from rolling rows.
  const auto rolling = load_model(
      "{type: four_wis_wid_drive_only, radius_m: 0.0255, "
      "x_m: [1, -1, -1, 1], y_m: [1, 1, -1, -1]}");
  const auto straight = testing::sample_motion(
      *rolling, [](double) { return Twist(0.5, 0., 0.); }, 1., 100.);
  IncrementIntegrator no_inverse(rolling, plain());
  EXPECT_TRUE(no_inverse.integrate(straight, 400'000'000, 500'000'000, out));
  EXPECT_EQ(out.refused, 11);
  EXPECT_TRUE(std::isinf(out.longest_hold_s));
}

TEST(Increment, DoesNotDriveOnFromIntervalToIntervalWithoutReadings) {
  const auto model = load_model(kAllRows);
  auto samples = testing::sample_motion(*model, sweep, 1., 100.);
  IncrementOptions options = plain();
  options.residual_gate_m_per_s = 0.05;
  for (std::size_t k = 50; k < samples.size(); ++k) samples[k].drive_rad_per_s[2] += 10.;
  IncrementIntegrator integrator(model, options);
  Increment out;
  for (int i = 0; i < 30; ++i) {  // epochs that are shorter than what is to be noticed
    const std::int64_t begin_ns = 300'000'000 + i * 20'000'000;
    ASSERT_TRUE(integrator.integrate(samples, begin_ns, begin_ns + 20'000'000, out));
    const double since_s = 0.02 * (i + 1) - 0.19;  // the last reading that is believed
    if (since_s > 0.05) {
      EXPECT_NEAR(out.longest_hold_s, since_s, 0.011) << i;
    }
  }
  EXPECT_GT(out.longest_hold_s, 0.39);
}

}  // namespace
}  // namespace viwo::wheel_relative_pose

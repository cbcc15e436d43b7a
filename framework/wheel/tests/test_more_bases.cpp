// Car-like, skid-steered and mecanum bases, and swerve bases of three and six wheels: derivatives
// at many states, closed forms of the inverse kinematics, what the parity residual must not tell,
// other odometry frames.
#include <cmath>
#include <random>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "message_of.hpp"
#include "more_bases.hpp"
#include "viwo/math/se2.hpp"
#include "viwo/testing/jacobian.hpp"
#include "viwo/wheel/twist_solver.hpp"

namespace viwo {
namespace {

using testing::central_difference;
using testing::feasible;
using testing::load_model;
using testing::mecanum;
using testing::skid_steer;

/// A reading that need not fit any motion, at random intrinsics near the nominal ones.
struct RandomState {
  EncoderSample y;
  Intrinsics x;
  Twist xi;
  RowVector e;
};

RandomState random_state(const WheelModel& model, std::mt19937_64& rng) {
  std::uniform_real_distribution<double> uniform(-1., 1.);
  RandomState s;
  s.y.n_drive = model.description().n_drive;
  s.y.n_steer = model.description().n_steer;
  for (double& rate : s.y.drive_rad_per_s) rate = 10. * uniform(rng);
  for (double& angle : s.y.steer_rad) angle = 1.2 * uniform(rng);
  s.x = model.nominal();
  for (int i = 0; i < s.x.size(); ++i) s.x[i] *= 1. + 0.1 * uniform(rng);
  s.xi << uniform(rng), uniform(rng), 2. * uniform(rng);
  s.e.resize(model.n_rows());
  for (int i = 0; i < s.e.size(); ++i) s.e[i] = 0.1 * uniform(rng);
  return s;
}

RowSystem rows_of(const WheelModel& model, const EncoderSample& y, const Intrinsics& x) {
  RowSystem rows;
  rows.A.setZero(model.n_rows(), 3);
  rows.b.setZero(model.n_rows());
  EXPECT_EQ(model.model().rows(y, x, false, rows), Status::kOk);
  return rows;
}

/// b - A xi over A^T e: what the derivatives of a model are of.
Eigen::VectorXd stacked(const RowSystem& rows, const RandomState& s) {
  Eigen::VectorXd out(rows.b.size() + 3);
  out << rows.b - rows.A * s.xi, rows.A.transpose() * s.e;
  return out;
}

class MoreBases : public ::testing::TestWithParam<std::string> {
 protected:
  std::shared_ptr<const WheelModel> model_ = load_model(GetParam());
};

INSTANTIATE_TEST_SUITE_P(, MoreBases, ::testing::ValuesIn(testing::more_bases()));

TEST_P(MoreBases, HaveTheIntrinsicDerivativesOfCentralDifferencesAtManyStates) {
  const int m = model_->n_rows(), n = model_->n_intrinsics();
  std::vector<std::string> names;
  for (const auto& spec : model_->description().intrinsics) names.push_back(spec.name);
  std::mt19937_64 rng(3);
  IntrinsicDerivatives out;  // kept, as the host does
  out.J.setZero(m, n);
  out.DtE.setZero(3, n);
  for (int trial = 0; trial < 100; ++trial) {
    const RandomState s = random_state(*model_, rng);
    const RowSystem rows = rows_of(*model_, s.y, s.x);
    model_->model().intrinsic_derivatives(s.y, s.x, rows, rows.b, s.xi, s.e, out);
    Eigen::MatrixXd J(m + 3, n);
    J << out.J, out.DtE;
    const Eigen::MatrixXd numeric = central_difference(
        [&](const Eigen::VectorXd& x) { return stacked(rows_of(*model_, s.y, x), s); }, s.x, 1e-6);
    ASSERT_EQ(testing::jacobian_mismatch(J, numeric, names, 1e-6), "") << "trial " << trial;
    for (int k = 0; k < n; ++k) {  // rows that are not declared are not looked at
      const RowRange range = model_->description().intrinsics[static_cast<std::size_t>(k)].rows;
      for (int i = 0; i < m; ++i) {
        if (i >= range.first && i < range.first + range.count) continue;
        ASSERT_EQ(numeric(i, k), 0.) << names[static_cast<std::size_t>(k)] << " row " << i;
      }
    }
  }
}

TEST_P(MoreBases, HaveTheNoiseDerivativesOfCentralDifferencesAtManyStates) {
  const int m = model_->n_rows(), q = model_->n_noises();
  std::mt19937_64 rng(4);
  NoiseDerivatives out;
  out.J.setZero(m, q);
  out.DtE.setZero(3, q);
  for (int trial = 0; trial < 100; ++trial) {
    const RandomState s = random_state(*model_, rng);
    const RowSystem rows = rows_of(*model_, s.y, s.x);
    model_->model().noise_derivatives(s.y, s.x, rows, rows.b, s.xi, s.e, out);
    for (int k = 0; k < q; ++k) {
      const NoiseSpec& noise = model_->description().noises[static_cast<std::size_t>(k)];
      if (noise.kind == NoiseKind::kSlip) {
        EXPECT_NEAR(out.J.col(k).norm(), 1., 1e-12) << "a velocity in its rows";
        continue;
      }
      const auto channel = static_cast<std::size_t>(noise.channel);
      const Eigen::VectorXd numeric = central_difference(
          [&](const Eigen::VectorXd& by) {
            EncoderSample y = s.y;
            (noise.kind == NoiseKind::kDrive ? y.drive_rad_per_s : y.steer_rad)[channel] += by[0];
            return stacked(rows_of(*model_, y, s.x), s);
          },
          Eigen::VectorXd::Zero(1), 1e-6);
      Eigen::VectorXd column(m + 3);
      column << out.J.col(k), out.DtE.col(k);
      ASSERT_LT((column - numeric).norm(), 1e-6 * (1. + numeric.norm())) << "noise " << k;
    }
  }
}

TEST_P(MoreBases, RealiseSlipThatTheirEncodersCanShow) {
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> uniform(-1., 1.);
  for (int trial = 0; trial < 50; ++trial) {
    const Twist xi =
        feasible(*model_, {0.6 + 0.3 * uniform(rng), 0.2 * uniform(rng), uniform(rng)});
    RowVector slip = RowVector::Zero(model_->n_rows());
    for (const NoiseSpec& noise : model_->description().noises) {
      // Of the axle and of the centre of rotation no encoder knows.
      const bool seen =
          noise.rows.first !=
          (GetParam().find("ackermann") != std::string::npos ? 2 : model_->description().n_drive);
      if (noise.kind == NoiseKind::kSlip && noise.rows.count == 1 && seen) {
        slip[noise.rows.first] = 0.01 * uniform(rng);
      }
    }
    EncoderSample y;
    ASSERT_EQ(model_->model().inverse(xi, model_->nominal(), slip, y), Status::kOk);
    const RowSystem rows = rows_of(*model_, y, model_->nominal());
    EXPECT_LT((rows.b - rows.A * xi - slip).norm(), 1e-12);
  }
}

/// Parity information of noisy samples along a direction of the intrinsics, in units of the whole.
double information_along(const WheelModel& model, const Intrinsics& direction) {
  std::mt19937_64 rng(7);
  std::uniform_real_distribution<double> uniform(-1., 1.);
  TwistSolver solver(std::make_shared<const WheelModel>(model), {});
  ParityInformation parity;
  parity.reset(model.n_intrinsics());
  EncoderSample clean;
  for (int trial = 0; trial < 50; ++trial) {
    const Twist xi = feasible(model, {0.5 + 0.2 * uniform(rng), 0.2 * uniform(rng), uniform(rng)});
    testing::follow(model, xi, clean);
    const EncoderSample y = testing::with_noise(model, xi, clean, 20., rng);
    TwistSolution solution;
    EXPECT_EQ(solver.solve(y, solution), Status::kOk);
    solver.add_parity(solver.parity(), 1., parity);
  }
  return (parity.Lambda * direction).norm() / (parity.Lambda.norm() * direction.norm());
}

TEST_P(MoreBases, CannotTellTheCommonScaleOfTheRadiiFromTheParityResidual) {
  if (GetParam().find("skid_steer") != std::string::npos) {
    GTEST_SKIP() << "its residual, if any, tells of no intrinsic";
  }
  Intrinsics radii = Intrinsics::Zero(model_->n_intrinsics());
  for (int i = 0; i < radii.size(); ++i) {
    const auto& name = model_->description().intrinsics[static_cast<std::size_t>(i)].name;
    if (name.starts_with("r_")) radii[i] = model_->nominal()[i];
  }
  EXPECT_LT(information_along(*model_, radii), 1e-9);
  Intrinsics one = Intrinsics::Zero(model_->n_intrinsics());
  one[0] = 1.;
  EXPECT_GT(information_along(*model_, one), 1e-4) << "the test must be able to see something";
}

TEST(Ackermann, CannotTellTheScaleOfItsLengthsFromTheParityResidual) {
  for (const std::string& yaml : testing::more_bases()) {
    if (yaml.find("ackermann") == std::string::npos) continue;
    const auto model = load_model(yaml);
    Intrinsics lengths = Intrinsics::Zero(model->n_intrinsics());
    for (const char* name : {"wheel_base", "track"}) {
      lengths[model->find(name)] = model->nominal()[model->find(name)];
    }
    EXPECT_LT(information_along(*model, lengths), 1e-9) << yaml;
    lengths[model->find("track")] *= -1.;
    EXPECT_GT(information_along(*model, lengths), 1e-6) << yaml;
  }
}

TEST(Ackermann, TurnsItsWheelsAboutOneCentre) {
  const auto model = load_model(
      "{type: ackermann, wheel_base_m: 0.32, track_m: 0.26, radius_m: 0.05, wheel_speeds: all, "
      "steering: both, steer_offset_rad: [0.02, -0.01]}");
  const auto centre = load_model(
      "{type: ackermann, wheel_base_m: 0.32, track_m: 0.26, radius_m: 0.05, wheel_speeds: all}");
  for (const double radius : {0.6, 1.5, -0.8}) {  // of the middle of the rear axle, left positive
    for (const double speed : {0.4, -0.3}) {
      EncoderSample y, y_centre;
      testing::follow(*model, {speed, 0., speed / radius}, y);
      testing::follow(*centre, {speed, 0., speed / radius}, y_centre);
      EXPECT_NEAR(std::tan(y.steer_rad[0] - 0.02), 0.32 / (radius - 0.13), 1e-12);
      EXPECT_NEAR(std::tan(y.steer_rad[1] + 0.01), 0.32 / (radius + 0.13), 1e-12);
      EXPECT_NEAR(std::tan(y_centre.steer_rad[0]), 0.32 / radius, 1e-12);
      const double omega = speed / radius;
      for (const EncoderSample* sample : {&y, &y_centre}) {
        const auto& rate = sample->drive_rad_per_s;
        EXPECT_NEAR(rate[0] * 0.05, omega * (radius - 0.13), 1e-12);
        EXPECT_NEAR(rate[1] * 0.05, omega * (radius + 0.13), 1e-12);
        const double forward = speed < 0. ? -1. : 1.;
        EXPECT_NEAR(rate[2] * 0.05, forward * std::abs(omega) * std::hypot(radius - 0.13, 0.32),
                    1e-12);
        EXPECT_NEAR(rate[3] * 0.05, forward * std::abs(omega) * std::hypot(radius + 0.13, 0.32),
                    1e-12);
      }
    }
  }
}

TEST(Ackermann, CannotSpinNorCrab) {
  const auto model =
      load_model("{type: ackermann, wheel_base_m: 0.32, track_m: 0.26, radius_m: 0.05}");
  const RowVector no_slip = RowVector::Zero(model->n_rows());
  EncoderSample y;
  for (const Twist& xi : {Twist(0., 0., 0.5), Twist(0.3, 0.1, 0.), Twist(0.1, 0., 0.6)}) {
    EXPECT_EQ(model->model().inverse(xi, model->nominal(), no_slip, y), Status::kRejected);
  }
}

TEST(Mecanum, RollsAsTextbooksSay) {
  const auto model = load_model(
      "{type: mecanum, x_m: [0.2, -0.2, -0.2, 0.2], y_m: [0.15, 0.15, -0.15, -0.15], radius_m: "
      "0.05, roller_angle_rad: [-0.785398163397448, 0.785398163397448, -0.785398163397448, "
      "0.785398163397448]}");
  const double vx = 0.3, vy = -0.2, turn = (0.2 + 0.15) * 0.7;
  EncoderSample y;
  testing::follow(*model, {vx, vy, 0.7}, y);
  const double expected[] = {vx - vy - turn, vx + vy - turn, vx - vy + turn, vx + vy + turn};
  for (std::size_t j = 0; j < 4; ++j) {  // front left, back left, back right, front right
    EXPECT_NEAR(0.05 * y.drive_rad_per_s[j], expected[j], 1e-12) << j;
  }
}

TEST(SkidSteer, TurnsItsSidesAboutTheirCentres) {
  const auto model = load_model(skid_steer());
  EncoderSample y;
  testing::follow(*model, {0.31 * 0.6, 0.05 * 0.6, 0.6}, y);
  EXPECT_NEAR(y.drive_rad_per_s[0], 0., 1e-12) << "the base turns about the left centre";
  EXPECT_NEAR(0.102 * y.drive_rad_per_s[1], (0.31 + 0.28) * 0.6, 1e-12);
  const RowVector no_slip = RowVector::Zero(model->n_rows());
  EXPECT_EQ(model->model().inverse({0.3, 0., 0.6}, model->nominal(), no_slip, y), Status::kRejected)
      << "x_icr moves sideways";
}

TEST(MoveFrameOfMoreBases, GivesTheTwistOfTheOtherFrameFromTheSameReadings) {
  std::mt19937_64 rng(11);
  std::uniform_real_distribution<double> uniform(-1., 1.);
  for (const std::string& yaml : {mecanum(), skid_steer()}) {
    const auto model = load_model(yaml);
    const bool turns = yaml == mecanum();
    for (int trial = 0; trial < 20; ++trial) {
      const Twist xi = feasible(*model, {uniform(rng), uniform(rng), 2. * uniform(rng)});
      const Eigen::Vector3d g(turns ? 0.5 * uniform(rng) : 0., 0.3 * uniform(rng),
                              0.3 * uniform(rng));
      EncoderSample sample;
      testing::follow(*model, xi, sample);
      Intrinsics moved = model->nominal();
      ASSERT_EQ(model->model().move_frame(g, moved), Status::kOk);
      TwistSolver solver(model, {});
      solver.set_intrinsics(moved);
      TwistSolution solution;
      ASSERT_EQ(solver.solve(sample, solution), Status::kOk);
      const Eigen::Vector2d v = xi.head<2>() + xi[2] * J2() * g.tail<2>();
      Twist expected;
      expected << R2(-g[0]) * v, xi[2];
      EXPECT_LT((solution.xi - expected).norm(), 1e-9) << yaml;
      EXPECT_LT(solution.e.norm(), 1e-9) << yaml;
    }
  }
}

TEST(MoveFrameOfMoreBases, IsNotOfferedWhereTheModelPlacesTheFrame) {
  Intrinsics x = load_model(skid_steer())->nominal();
  EXPECT_EQ(load_model(skid_steer())->model().move_frame({0.1, 0., 0.}, x), Status::kUnsupported);
  const auto car =
      load_model("{type: ackermann, wheel_base_m: 0.32, track_m: 0.26, radius_m: 0.05}");
  x = car->nominal();
  EXPECT_EQ(car->model().move_frame({0., 0.1, 0.}, x), Status::kUnsupported);
}

TEST(MoreBasesParameters, AreRefusedWithAReason) {
  const auto says = [](const std::string& yaml, const std::string& text) {
    const std::string what = testing::error_of<std::exception>([&] { load_model(yaml); });
    EXPECT_NE(what.find(text), std::string::npos) << what;
  };
  says("{type: ackermann, wheel_base_m: 0.3, track_m: 0.2, radius_m: [0.05, 0.05, 0.05]}",
       "radius_m: has 3 values for 2 measured wheels");
  says(
      "{type: skid_steer, radius_left_m: 0.1, radius_right_m: 0.1, y_icr_left_m: -0.2, "
      "y_icr_right_m: 0.2}",
      "y_icr_left_m: must be greater than y_icr_right_m: y is to the left");
  says("{type: mecanum, x_m: [1, 2], y_m: [1, 2], roller_angle_rad: [0.8, -0.8], radius_m: 0.1}",
       "x_m: has 2 wheels, this model takes 3 to 8");
  says(
      "{type: mecanum, x_m: [1, -1, -1, 1], y_m: [1, 1, -1, -1], radius_m: 0.1, "
      "roller_angle_rad: [0.8, 0.8, -0.8, -0.8]}",
      "roller_angle_rad: wheels 1 and 2 place the odometry frame on the base and must have "
      "different angles: put the wheels in another order");
}

}  // namespace
}  // namespace viwo

// Every wheeled base of the tree against contacts that are carried along with p_dot + omega x r:
// signs, sizes, order of the channels, names. Nothing of the models is used to make the readings.
#include <cmath>
#include <map>
#include <random>

#include "support.hpp"
#include "test_contact.hpp"
#include "viwo/wheel/wheel_model.hpp"

namespace viwo::contact {
namespace {

struct Pair {
  std::string model;  // as a configuration has it
  Geometry geometry;
};

std::string text(const std::vector<double>& values) {
  std::string out = "[";
  for (const double value : values) {
    char number[32];
    std::snprintf(number, sizeof number, "%.17g", value);
    out += (out == "[" ? "" : ", ") + std::string(number);
  }
  return out + "]";
}

std::vector<Pair> pairs() {
  std::vector<Pair> out;
  const Geometry swerve{.base = "swerve",
                        .x_m = {0.2, -0.21, -0.2, 0.19, 0.02},
                        .y_m = {0.15, 0.16, -0.15, -0.14, 0.01},
                        .radius_m = {0.05, 0.051, 0.0495, 0.0502, 0.049},
                        .steer_offset_rad = {0.1, -0.2, 0.3, 0., 0.05}};
  for (const char* type : {"four_wis_wid", "four_wis_wid_drive_only"}) {
    out.push_back({std::string("{type: ") + type + ", x_m: " + text(swerve.x_m) +
                       ", y_m: " + text(swerve.y_m) + ", radius_m: " + text(swerve.radius_m) +
                       ", steer_offset_rad: " + text(swerve.steer_offset_rad) + "}",
                   swerve});
  }
  out.push_back({"{type: differential, radius_left_m: 0.1, radius_right_m: 0.102, baseline_m: 0.5}",
                 {"differential", {0., 0.}, {0.25, -0.25}, {0.1, 0.102}}});
  for (const char* speeds : {"rear", "all"}) {
    for (const char* steering : {"centre", "both"}) {
      const bool four = speeds == std::string("all"), both = steering == std::string("both");
      const std::vector<double> offsets =
          both ? std::vector<double>{0.02, -0.01} : std::vector<double>{0.02};
      const std::vector<double> radius = {0.05, 0.0505, 0.0497, 0.0502};
      out.push_back({"{type: ackermann, wheel_base_m: 0.32, track_m: 0.26, wheel_speeds: " +
                         std::string(speeds) + ", steering: " + steering +
                         ", radius_m: " + text({radius.begin(), radius.begin() + (four ? 4 : 2)}) +
                         ", steer_offset_rad: " + text(offsets) + "}",
                     {.base = "ackermann",
                      .x_m = {0., 0., 0.32, 0.32},
                      .y_m = {0.13, -0.13, 0.13, -0.13},
                      .radius_m = radius,
                      .steer_offset_rad = offsets,
                      .wheel_speeds = speeds,
                      .steering = steering}});
    }
  }
  const Geometry mecanum{.base = "mecanum",
                         .x_m = {0.2, -0.21, -0.2, 0.19},
                         .y_m = {0.15, 0.16, -0.15, -0.14},
                         .radius_m = {0.05, 0.051, 0.0495, 0.0502},
                         .roller_angle_rad = {-0.78, 0.79, -0.8, 0.77}};
  out.push_back({"{type: mecanum, x_m: " + text(mecanum.x_m) + ", y_m: " + text(mecanum.y_m) +
                     ", roller_angle_rad: " + text(mecanum.roller_angle_rad) +
                     ", radius_m: " + text(mecanum.radius_m) + "}",
                 mecanum});
  // Two wheels on one line do not skid: their centres of rotation are where they stand.
  out.push_back(
      {"{type: skid_steer, radius_left_m: 0.1, radius_right_m: 0.102, y_icr_left_m: 0.31, "
       "y_icr_right_m: -0.28, x_icr_m: -0.05}",
       {"skid_steer", {-0.05, -0.05}, {0.31, -0.28}, {0.1, 0.102}}});
  return out;
}

std::shared_ptr<const WheelModel> model_of(const Pair& pair) {
  config::Errors errors;
  const auto loaded =
      registry().make_kinematics(config::parse(pair.model, "test.yaml"), "kinematics", 1, errors);
  errors.throw_if_any();
  return std::make_shared<const WheelModel>(loaded.object);
}

/// A hundred twists through the base, the first of them in all directions.
std::vector<Twist> twists() {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1., 1.);
  std::vector<Twist> out = {{0.5, 0., 0.}, {-0.5, 0., 0.}, {0., 0.5, 0.}, {0., 0., 0.7}};
  while (out.size() < 100) out.push_back({uniform(random), uniform(random), uniform(random)});
  return out;
}

/// The largest row b - A xi of the model at what the contacts of `base` read, m/s.
double worst_row(const WheelModel& model, const Base& base) {
  ContactSolver solver(base, base, Physics{});
  Encoders encoders(EncoderErrors{}, 1);
  RowSystem rows;
  rows.A.setZero(model.n_rows(), 3);
  rows.b.setZero(model.n_rows());
  double worst = 0.;
  for (const Twist& xi : twists()) {
    ContactState state;
    solver.stand(xi);
    EXPECT_TRUE(solver.step(demand_of(moving(xi), Physics{}), 0.01, state));
    const EncoderSample y = encoders.read(base, state, 0.01);
    EXPECT_EQ(y.n_drive, model.description().n_drive);
    EXPECT_EQ(y.n_steer, model.description().n_steer);
    EXPECT_EQ(model.model().rows(y, model.nominal(), false, rows), Status::kOk);
    worst = std::max(worst, (rows.b - rows.A * state.xi).lpNorm<Eigen::Infinity>());
  }
  return worst;
}

TEST(Bases, RowsOfEveryModelHoldForContactsThatDoNotSlip) {
  for (const Pair& pair : pairs()) {
    EXPECT_LT(worst_row(*model_of(pair), make_base(pair.geometry)), 1e-14) << pair.model;
  }
}

TEST(Bases, RowsDoNotHoldForAMirroredOrOtherwiseWrongBase) {
  for (const Pair& pair : pairs()) {
    const auto model = model_of(pair);
    const bool has_length =
        pair.geometry.x_m[0] != 0. || pair.geometry.x_m[0] != pair.geometry.x_m.back();
    Geometry mirrored = pair.geometry, turned = pair.geometry, swapped = pair.geometry;
    for (double& y : mirrored.y_m) y = -y;
    EXPECT_GT(worst_row(*model, make_base(mirrored)), 0.05) << pair.model;
    for (double& x : turned.x_m) x = -x;
    if (has_length) {
      EXPECT_GT(worst_row(*model, make_base(turned)), 0.05) << pair.model;
    }
    std::swap(swapped.radius_m[0], swapped.radius_m[1]);
    EXPECT_GT(worst_row(*model, make_base(swapped)), 1e-3) << pair.model;
    Geometry offset = pair.geometry;
    for (double& angle : offset.steer_offset_rad) angle = -angle;
    if (model->description().n_steer > 0) {
      EXPECT_GT(worst_row(*model, make_base(offset)), 0.01) << pair.model;
    }
    Geometry rollers = pair.geometry;
    for (double& angle : rollers.roller_angle_rad) angle = -angle;
    if (pair.geometry.base == "mecanum") {
      EXPECT_GT(worst_row(*model, make_base(rollers)), 0.5) << pair.model;
    }
  }
}

TEST(Bases, InverseKinematicsOfEveryModelReadsWhatTheContactsRead) {
  for (const Pair& pair : pairs()) {
    const auto model = model_of(pair);
    const Base base = make_base(pair.geometry);
    ContactSolver solver(base, base, Physics{});
    Encoders encoders(EncoderErrors{}, 1);
    for (const Twist& xi : twists()) {
      ContactState state;
      solver.stand(xi);
      ASSERT_TRUE(solver.step(demand_of(moving(xi), Physics{}), 0.01, state));
      const EncoderSample y = encoders.read(base, state, 0.01);
      // The previous sample says which of two equal directions a wheel has.
      EncoderSample inverse = y;
      inverse.drive_rad_per_s.fill(0.);
      const Status status = model->model().inverse(state.xi, model->nominal(),
                                                   RowVector::Zero(model->n_rows()), inverse);
      // A car that would steer further than it can is refused; its contacts have no such limit.
      if (status == Status::kRejected && pair.geometry.base == "ackermann") continue;
      ASSERT_EQ(status, Status::kOk) << pair.model;
      for (std::size_t i = 0; i < static_cast<std::size_t>(y.n_drive); ++i) {
        EXPECT_NEAR(inverse.drive_rad_per_s[i], y.drive_rad_per_s[i], 1e-12) << pair.model << i;
      }
      for (std::size_t i = 0; i < static_cast<std::size_t>(y.n_steer); ++i) {
        EXPECT_NEAR(inverse.steer_rad[i], y.steer_rad[i], 1e-12) << pair.model << i;
      }
    }
  }
}

TEST(Bases, TrueIntrinsicsHaveTheNamesAndValuesOfTheModels) {
  for (const Pair& pair : pairs()) {
    const Base base = make_base(pair.geometry);
    const auto truth = intrinsics_of(base, pair.geometry.radius_m, 0);
    // What a skid-steered base reads follows from how it slips.
    if (pair.geometry.base == "skid_steer") {
      EXPECT_TRUE(truth.empty());
      continue;
    }
    const auto model = model_of(pair);
    ASSERT_EQ(truth.size(), static_cast<std::size_t>(model->n_intrinsics())) << pair.model;
    for (const CalibrationSample& sample : truth) {
      const int i = model->find(sample.name);
      ASSERT_GE(i, 0) << sample.name;
      EXPECT_NEAR(sample.value, model->nominal()[i], 1e-15) << sample.name;
    }
  }
}

}  // namespace
}  // namespace viwo::contact

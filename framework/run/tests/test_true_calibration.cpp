// The truth of a calibration, and the error of an estimate of it as the filter means errors.
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "simulated.hpp"
#include "true_calibration.hpp"
#include "viwo/math/so3.hpp"

namespace viwo {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::registry;

using Truth = std::map<std::string, double>;

/// Where a camera sits on the IMU, and its focal length.
BlockSpec camera_block(const Vector3d& theta, const Vector3d& p, double focal_px) {
  BlockSpec spec;
  spec.name = "cam0";
  spec.add_rotation({"theta_x", "theta_y", "theta_z"}, exp_so3(theta), Vector3d::Constant(0.1));
  constexpr const char* kAxes[] = {"p_x", "p_y", "p_z"};
  for (int i = 0; i < 3; ++i) spec.add(kAxes[i], "m", p[i], 0.1);
  spec.add("f", "px", focal_px, 2.);
  return spec;
}

std::vector<CalibrationTrack> tracks_of(const Filter& filter) {
  std::vector<CalibrationTrack> tracks;
  for (const std::string& name : calibration_names(filter)) tracks.emplace_back().name = name;
  return tracks;
}

/// The filter after a measurement without noise of dx of the block.
void measure(Filter& filter, const VectorXd& dx) {
  ResidualFactor factor;
  factor.columns.add(filter.blocks().views()[0].column(), static_cast<int>(dx.size()));
  factor.set_rows(static_cast<int>(dx.size()));
  factor.H.setIdentity();
  factor.R.diagonal().setConstant(1e-20);
  factor.residual = dx;
  EXPECT_EQ(filter.apply(factor), FactorResult::kApplied);
}

TEST(CompareCalibration, TellsTheErrorThatAnUpdateWouldTakeAway) {
  // GIVEN a mounting that is far from any axis and an estimate a tenth of a radian off
  const Vector3d theta(0.4, -1.1, 0.8), p(0.1, -0.2, 0.3);
  const Eigen::Matrix3d R = exp_so3(Vector3d(0.06, -0.05, 0.07)) * exp_so3(theta);
  Filter filter({}, {camera_block(log_so3(R), Vector3d(0.12, -0.21, 0.27), 462.)});
  filter.initialize({});
  const Truth truth{{"theta_x", theta.x()},
                    {"theta_y", theta.y()},
                    {"theta_z", theta.z()},
                    {"p_x", p.x()},
                    {"p_y", p.y()},
                    {"p_z", p.z()},
                    {"f", 460.}};
  // WHEN the errors are told
  std::vector<CalibrationTrack> tracks = tracks_of(filter);
  compare_calibration(truth, filter, tracks);
  ASSERT_EQ(tracks.size(), 7U);
  EXPECT_NEAR(tracks[3].final_error, 0.02, 1e-12);
  EXPECT_NEAR(tracks[6].final_error, 2., 1e-12);
  EXPECT_EQ(tracks[1].truth, theta.y());
  EXPECT_EQ(tracks[6].truth, 460.);
  // Not the difference of the rotation vectors.
  EXPECT_GT(std::abs(tracks[0].final_error - (log_so3(R).x() - theta.x())), 0.01);
  // THEN the error state without them is the truth
  VectorXd dx(7);
  for (int i = 0; i < 7; ++i) dx[i] = -tracks[static_cast<std::size_t>(i)].final_error;
  measure(filter, dx);
  EXPECT_LT((filter.blocks().views()[0].rotation() - exp_so3(theta)).norm(), 1e-9);
  compare_calibration(truth, filter, tracks);
  for (const CalibrationTrack& track : tracks) EXPECT_NEAR(track.final_error, 0., 1e-9);
}

TEST(CompareCalibration, SaysNothingOfWhatIsNotKnown) {
  Filter filter({}, {camera_block(Vector3d::Zero(), Vector3d::Zero(), 460.)});
  filter.initialize({});
  std::vector<CalibrationTrack> tracks = tracks_of(filter);
  // Two axes of a rotation are no rotation; a number is a number.
  compare_calibration({{"theta_x", 0.1}, {"theta_y", 0.2}, {"p_y", 0.3}}, filter, tracks);
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    EXPECT_EQ(std::isfinite(tracks[i].truth), i == 4) << tracks[i].name;
    EXPECT_EQ(std::isfinite(tracks[i].final_error), i == 4) << tracks[i].name;
  }
}

/// Two wheel sets of the swerve robot, neither of which is placed like the IMU.
FilterSetup two_wheel_sets() {
  const RunSetup run = read_run(
      config::parse(testing::swerve_with_camera(10) +
                        "wheels: {p_IinO_m: [0.05, 0.02, 0.15], rpy_ItoO_rad: [0.02, -0.01, 0.3]}\n"
                        "updates: {wheel_odometry: {}}\n",
                    "run.yaml"),
      registry(), 1);
  FilterSetup setup;
  setup.wheels = {run.filter->wheels.front(), run.filter->wheels.front()};
  setup.wheels.back().prior.name = "second";
  return setup;
}

/// The entries of a wheel set as they are, seen from a frame O that is turned and shifted.
Truth seen_from(const WheelSet& set, double yaw, const Eigen::Vector2d& shift) {
  WheelsPrior moved = set.prior;
  WheelsView& wheels = moved.wheels;
  EXPECT_EQ(set.model->model().move_frame({yaw, shift.x(), shift.y()}, wheels.x_WI), Status::kOk);
  const Eigen::Matrix3d R = exp_so3({0., 0., -yaw});
  wheels.R_ItoO = R * wheels.R_ItoO;
  wheels.p_IinO = R * (wheels.p_IinO - Vector3d(shift.x(), shift.y(), 0.));
  Truth truth;
  const auto blocks = wheels_blocks(moved);
  for (const BlockSpec& block : blocks) {
    for (std::size_t i = 0; i < block.entries.size(); ++i) {
      const std::size_t k = 3 * static_cast<std::size_t>(block.rotations);
      truth[block.entries[i].name] =
          i < k ? log_so3(wheels.R_ItoO)[static_cast<int>(i)] : block.value[i + 2 * k];
    }
  }
  return truth;
}

TEST(TrueCalibration, OfWheelsIsInTheGaugeThatTheEstimateHolds) {
  const FilterSetup setup = two_wheel_sets();
  const Truth first = seen_from(setup.wheels[0], 0., {0., 0.});
  const Truth second = seen_from(setup.wheels[1], 0., {0., 0.});
  EXPECT_EQ(first.size(), 23U);
  EXPECT_TRUE(second.contains("second.x_2"));
  // GIVEN truths of frames that are placed otherwise
  Truth given = seen_from(setup.wheels[0], 0.2, {0.03, -0.02});
  given.merge(seen_from(setup.wheels[1], -0.1, {0.01, 0.04}));
  EXPECT_GT(std::abs(given.at("x_1") - first.at("x_1")), 1e-3);
  EXPECT_GT(std::abs(given.at("second.theta_ItoO_z") - second.at("second.theta_ItoO_z")), 0.05);
  // THEN each is brought back by itself
  const Truth truth = true_calibration(setup, given);
  for (const auto& [name, value] : first) EXPECT_NEAR(truth.at(name), value, 1e-9) << name;
  for (const auto& [name, value] : second) EXPECT_NEAR(truth.at(name), value, 1e-9) << name;
}

TEST(TrueCalibration, OfWheelsThatAreNotAllKnownStaysAsItWasGiven) {
  const FilterSetup setup = two_wheel_sets();
  Truth given = seen_from(setup.wheels[0], 0.2, {0.03, -0.02});
  given.erase("r_3");
  given["cam0.fx"] = 460.;
  EXPECT_EQ(true_calibration(setup, given), given);
}

TEST(TrueCalibration, IsWhatASensorGivesBeforeWhatTheConfigurationWas) {
  FilterSetup setup;
  setup.drawn_from = {{"cam0.fx", 460.}, {"cam0.fy", 458.}};
  const Truth truth = true_calibration(setup, {{"cam0.fx", 461.}});
  EXPECT_EQ(truth, (Truth{{"cam0.fx", 461.}, {"cam0.fy", 458.}}));
}

TEST(TrueCalibration, OfCamerasThatStartWrongIsKnownInARun) {
  const std::string cameras = VIWO_TEST_SOURCE_DIR "/configs/cameras/pinhole.yaml";
  RunSetup setup =
      read_run(config::parse(testing::swerve_with_camera(40) + "cameras: {kalibr: " + cameras +
                                 "}\nestimator: {calibration_error_scale: 1}\n"
                                 "updates: {visual_features: {}, wheel_odometry: {}}\n",
                             "run.yaml"),
               registry(), 3);
  const CameraPrior& camera = setup.filter->cameras.front();
  EXPECT_NE(camera.camera.intrinsics[0], 460.);
  const RunResult result = run_filter(setup, collect(setup));
  ASSERT_EQ(result.status, RunStatus::kOk) << result.cause;
  ASSERT_EQ(result.calibration.size(), 15U + 23U);
  const std::map<std::string, std::string> units{
      {"cam0.fx", "px"}, {"cam0.t_CtoI", "s"}, {"cam0.p_IinC_x", "m"}, {"r_1", "m"}};
  for (const CalibrationTrack& track : result.calibration) {
    const auto unit = units.find(track.name);
    EXPECT_EQ(track.unit, unit == units.end() ? track.unit : unit->second) << track.name;
    EXPECT_TRUE(std::isfinite(track.truth)) << track.name;
    // The configuration of the wheels knows nothing of where the simulator has the IMU.
    if (track.sigma.back() == 0. || !track.name.starts_with("cam")) continue;
    EXPECT_LT(std::abs(track.final_error), 4. * track.sigma.back()) << track.name;
    EXPECT_LE(track.sigma.back(), track.sigma.front() * (1. + 1e-9)) << track.name;
    EXPECT_EQ(track.truth, track.name == "cam0.fx" ? 460. : track.truth);
  }
}

/// How far calibration starts from what the configuration says, in prior sigmas, without what the
/// gauge holds.
std::vector<double> start_errors(const std::string& estimator, std::uint64_t seed) {
  const auto start = [&](const std::string& section) {
    return read_run(config::parse(testing::swerve_with_camera(0) + "estimator: {" + section +
                                      "}\nwheels: {held_are_exact: true}\n"
                                      "updates: {wheel_odometry: {}}\n",
                                  "run.yaml"),
                    registry(), seed)
        .filter->wheels.front()
        .prior;
  };
  const WheelsPrior wrong = start(estimator), right = start("");
  std::vector<double> errors;
  for (Eigen::Index i = 0; i < wrong.wheels.x_WI.size(); ++i) {
    if (wrong.sigma_intrinsics[i] == 0.) continue;
    errors.push_back((wrong.wheels.x_WI[i] - right.wheels.x_WI[i]) / wrong.sigma_intrinsics[i]);
  }
  errors.push_back((wrong.wheels.t_OtoI_s - right.wheels.t_OtoI_s) / wrong.sigma_time_offset_s);
  const Vector3d turn = log_so3(wrong.wheels.R_ItoO * right.wheels.R_ItoO.transpose());
  const Vector3d shift = wrong.wheels.p_IinO - right.wheels.p_IinO;
  for (int i = 0; i < 3; ++i) {
    errors.push_back(turn[i] / wrong.sigma_extrinsics[i]);
    errors.push_back(shift[i] / wrong.sigma_extrinsics[3 + i]);
  }
  return errors;
}

TEST(CalibrationError, IsDrawnOrOneSigmaOfEveryParameterUpOrByChance) {
  const std::vector<double> plus =
      start_errors("calibration_error_scale: 2, calibration_error: plus", 1);
  ASSERT_EQ(plus.size(), 13U + 7U);
  for (const double error : plus) EXPECT_NEAR(error, 2., 1e-9);
  EXPECT_EQ(plus, start_errors("calibration_error_scale: 2, calibration_error: plus", 2));

  const std::vector<double> sign =
      start_errors("calibration_error_scale: 1, calibration_error: sign", 1);
  for (const double error : sign) EXPECT_NEAR(std::abs(error), 1., 1e-9);
  EXPECT_NE(sign, start_errors("calibration_error_scale: 1, calibration_error: sign", 2));
  // The sign is that of the draw.
  const std::vector<double> drawn = start_errors("calibration_error_scale: 1", 1);
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    EXPECT_EQ(std::signbit(drawn[i]), std::signbit(sign[i]));
    EXPECT_GT(std::abs(std::abs(drawn[i]) - 1.), 1e-6);
  }
}

}  // namespace
}  // namespace viwo

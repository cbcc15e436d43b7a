// The sensor as the host loads it.
#include <cmath>
#include <sstream>

#include "support.hpp"
#include "viwo/math/arrays.hpp"

namespace viwo {
namespace {

const std::string kSwerve =
    "base: swerve, x_m: [0.1125, -0.1125, -0.1125, 0.1125], y_m: [0.1125, 0.1125, -0.1125, "
    "-0.1125], radius_m: 0.0255, features: 0";
const std::string kDifferential =
    "base: differential, x_m: [0, 0], y_m: [0.2, -0.2], radius_m: 0.1, features: 0";

std::string section(const std::string& rest, const std::string& base = kSwerve) {
  return "{type: contact_simulator, " + base + ", " + rest + "}";
}

std::map<std::string, double> truth_of(const std::vector<Measurement>& all) {
  std::map<std::string, double> out;
  for (const auto& sample : only<CalibrationSample>(all)) out[sample.name] = sample.value;
  return out;
}

TEST(ContactSimulator, AnIdealBaseReadsWhatTheSimulatorReadsForEveryBase) {
  struct Case {
    std::string base, robot, motion;
  };
  const std::string square = "x_m: [0.2, -0.2, -0.2, 0.2], y_m: [0.15, 0.15, -0.15, -0.15]";
  const std::string rollers = "roller_angle_rad: [-0.7854, 0.7854, -0.7854, 0.7854]";
  const std::vector<Case> cases = {
      {"base: swerve, " + square + ", radius_m: 0.05, steer_offset_rad: [0, 0.1, -0.1, 0.2]",
       "type: four_wis_wid, " + square + ", radius_m: 0.05, steer_offset_rad: [0, 0.1, -0.1, 0.2]",
       "icr_sweep"},
      {"base: differential, x_m: [0, 0], y_m: [0.2, -0.2], radius_m: [0.1, 0.11]",
       "type: differential, radius_left_m: 0.1, radius_right_m: 0.11, baseline_m: 0.4",
       "figure_eight"},
      {"base: ackermann, x_m: [0, 0, 0.32, 0.32], y_m: [0.13, -0.13, 0.13, -0.13], radius_m: 0.05, "
       "wheel_speeds: all",
       "type: ackermann, wheel_base_m: 0.32, track_m: 0.26, radius_m: 0.05, wheel_speeds: all",
       "figure_eight"},
      {"base: mecanum, " + square + ", " + rollers + ", radius_m: 0.05",
       "type: mecanum, " + square + ", " + rollers + ", radius_m: 0.05", "icr_sweep"},
      {"base: skid_steer, x_m: [0, 0], y_m: [0.3, -0.3], radius_m: 0.1",
       "type: skid_steer, radius_left_m: 0.1, radius_right_m: 0.1, y_icr_left_m: 0.3, "
       "y_icr_right_m: -0.3, x_icr_m: 0",
       "figure_eight"}};
  for (const Case& c : cases) {
    const std::string rest = ", motion: " + c.motion +
                             ", duration_s: 20, ground: uneven, features: 0, noise: false, "
                             "t_OtoI_s: 0.01}";
    const auto here = play(*make_sensor("{type: contact_simulator, ideal: true, " + c.base + rest));
    const auto there = play(*make_sensor("{type: simulator, robot: {" + c.robot + "}" + rest));
    const auto a = only<EncoderSample>(here), b = only<EncoderSample>(there);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k) {
      ASSERT_EQ(a[k].t_ns, b[k].t_ns);
      ASSERT_EQ(a[k].begin_ns, b[k].begin_ns);
      for (std::size_t i = 0; i < kMaxDrives; ++i) {
        // The simulator follows a sideways velocity of up to 1e-9 m/s that a car cannot have.
        ASSERT_NEAR(a[k].drive_rad_per_s[i], b[k].drive_rad_per_s[i], 2e-9 / 0.05) << c.base << k;
        const double speed = 0.05 * std::abs(b[k].drive_rad_per_s[0]);
        if (speed < 1e-6) continue;
        ASSERT_NEAR(a[k].steer_rad[i], b[k].steer_rad[i], 1e-10 + 2e-9 / speed) << c.base << k;
      }
    }
    // IMU and states are those of the same trajectory, to the bit.
    const auto imu_a = only<ImuSample>(here), imu_b = only<ImuSample>(there);
    ASSERT_EQ(imu_a.size(), imu_b.size());
    for (std::size_t k = 0; k < imu_a.size(); ++k) {
      ASSERT_EQ(imu_a[k].accel_m_per_s2, imu_b[k].accel_m_per_s2) << c.base << k;
    }
  }
}

TEST(ContactSimulator, EqualSeedsGiveEqualReadingsAndNoiseIsWhatDiffers) {
  const std::string rest = "duration_s: 3, sigma_true_radius_m: 1e-4";
  const auto a = play(*make_sensor(section(rest))), again = play(*make_sensor(section(rest)));
  const auto other = play(*make_sensor(section(rest), 2));
  const auto x = only<EncoderSample>(a), y = only<EncoderSample>(again),
             z = only<EncoderSample>(other);
  ASSERT_EQ(x.size(), 301U);
  ASSERT_EQ(x.size(), y.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    EXPECT_EQ(x[k].drive_rad_per_s, y[k].drive_rad_per_s);
    EXPECT_EQ(x[k].steer_rad, y[k].steer_rad);
  }
  EXPECT_NE(x[200].drive_rad_per_s, z[200].drive_rad_per_s);
  EXPECT_EQ(truth_of(a), truth_of(again));
  EXPECT_NE(truth_of(a).at("r_1"), truth_of(other).at("r_1"));
}

TEST(ContactSimulator, WhiteNoiseHasTheSizeThatWasAskedFor) {
  const std::string rest = "duration_s: 60, motion: stationary, ideal: true, ";
  const auto samples = play_only<EncoderSample>(
      section(rest + "sigma_drive_rad_per_s: 0.01, sigma_steer_rad: 0.002"));
  double drive = 0., steer = 0.;
  for (const EncoderSample& sample : samples) {
    for (std::size_t j = 0; j < 4; ++j) {
      drive += std::pow(sample.drive_rad_per_s[j] / 0.01, 2);
      steer += std::pow(sample.steer_rad[j] / 0.002, 2);
    }
  }
  const double n = 4. * static_cast<double>(samples.size());
  // Mean of n squared standard normals: 1 with a deviation of sqrt(2 / n); four of them.
  EXPECT_NEAR(drive / n, 1., 4. * std::sqrt(2. / n));
  EXPECT_NEAR(steer / n, 1., 4. * std::sqrt(2. / n));
}

TEST(ContactSimulator, WhatAnEncoderCountsIsLostNowhere) {
  const std::string rest = "duration_s: 20, noise: false, ";
  const auto fine = play_only<EncoderSample>(section(rest + "drive_resolution_rad: 0"));
  const auto coarse = play_only<EncoderSample>(section(rest + "drive_resolution_rad: 0.01"));
  double counted = 0., turned = 0., worst = 0.;
  for (std::size_t k = 0; k < fine.size(); ++k) {
    turned += 0.01 * fine[k].drive_rad_per_s[0];
    counted += 0.01 * coarse[k].drive_rad_per_s[0];
    worst = std::max(worst, std::abs(counted - turned));
    const double counts = coarse[k].drive_rad_per_s[0] * 0.01 / 0.01;
    EXPECT_NEAR(counts, std::round(counts), 1e-6);
  }
  EXPECT_LE(worst, 0.005 + 1e-9);
  EXPECT_GT(turned, 100.);
}

TEST(ContactSimulator, ABaseOnAnAxleDriftsOutwardsInItsTurns) {
  const auto states = play_only<StateSample>(
      section("duration_s: 10, motion: circle, noise: false, p_IinO_m: [0, 0, 0], "
              "load_exponent: 1, com_m: [0, 0, 0], rolling_resistance: 0",
              kDifferential));
  const StateSample& last = states.back();
  const Eigen::Quaterniond q = to_quaternion(last.q_ItoG_xyzw);
  const Eigen::Vector3d v = q.conjugate() * to_vector(last.v_IinG_m_per_s);
  EXPECT_NEAR(v.x(), 0.5, 1e-4);
  // Slip angle 0.1 a/g with a = 0.3 m/s^2 of wheels that roll with 0.38 and 0.62 m/s, and the brush
  // gives way by a / (3 mu g) more.
  const double a_over_g = 0.3 / 9.81, speed = 2. / (1. / 0.38 + 1. / 0.62);
  EXPECT_NEAR(v.y() / (-speed * 0.1 * a_over_g), 1. + a_over_g / (3. * 0.8), 0.002);
}

TEST(ContactSimulator, TruthIsWhatTheWheelsRollWithUnderTheirLoad) {
  const auto truth = truth_of(play(*make_sensor(section("duration_s: 1, com_m: [0.05, 0, 0.1]"))));
  const double share = 30. * 9.81 / 4.;
  EXPECT_NEAR(truth.at("r_1"), 0.0255 - 1e-6 * share * (1. + 0.05 / 0.1125), 1e-12);
  EXPECT_NEAR(truth.at("r_2"), 0.0255 - 1e-6 * share * (1. - 0.05 / 0.1125), 1e-12);
  const auto drawn = truth_of(play(*make_sensor(
      section("duration_s: 1, sigma_true_position_m: 0.01, sigma_true_steer_offset_rad: 0.02"))));
  EXPECT_NE(drawn.at("x_1"), 0.1125);  // also what a filter holds
  EXPECT_NE(drawn.at("delta_o1"), 0.);
  EXPECT_NE(drawn.at("x_2"), -0.1125);
  EXPECT_NE(drawn.at("delta_o3"), 0.);
}

/// As in `simulator`.
TEST(ContactSimulator, DrawsTheMountAndTheClock) {
  const std::string rest =
      "duration_s: 3, noise: false, true_sigma_p_IinO_m: [0.1, 0.1, 0.1], "
      "true_sigma_R_ItoO_rad: [0.1, 0.1, 0.1], true_sigma_t_OtoI_s: 0.05";
  const auto as_configured = truth_of(play(*make_sensor(section("duration_s: 3, noise: false"))));
  const auto drawn = truth_of(play(*make_sensor(section(rest))));
  const auto exact = truth_of(play(*make_sensor(section(rest), 1, true)));
  for (const char* name : {"p_IinO_x", "p_IinO_z", "theta_ItoO_x", "t_OtoI"}) {
    EXPECT_GT(std::abs(drawn.at(name) - as_configured.at(name)), 1e-4) << name;
    EXPECT_EQ(exact.at(name), as_configured.at(name)) << name;
  }
  // The wheels are late by what is told.
  std::ostringstream clock;
  clock.precision(17);
  clock << drawn.at("t_OtoI");
  const auto late = only<EncoderSample>(play(*make_sensor(section(rest))));
  const auto told = only<EncoderSample>(
      play(*make_sensor(section("duration_s: 3, noise: false, t_OtoI_s: " + clock.str()))));
  ASSERT_EQ(late.size(), told.size());
  EXPECT_EQ(late[150].drive_rad_per_s, told[150].drive_rad_per_s);
}

TEST(ContactSimulator, IsExactWhenThatIsAskedForWhateverItsParametersSay) {
  const std::string rest = "duration_s: 3, sigma_true_radius_m: 1e-4, controller_knows: nominal";
  const auto sensor = make_sensor(section(rest), 1, true);
  EXPECT_TRUE(sensor->can_be_exact());
  const auto exact = play(*sensor);
  const auto quiet = play(*make_sensor(section("duration_s: 3, ideal: true, noise: false")));
  EXPECT_EQ(truth_of(exact), truth_of(quiet));
  const auto a = only<EncoderSample>(exact), b = only<EncoderSample>(quiet);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    EXPECT_EQ(a[k].drive_rad_per_s, b[k].drive_rad_per_s);
    EXPECT_EQ(a[k].steer_rad, b[k].steer_rad);
  }
}

TEST(ContactSimulator, SaysWhatItRefusesAndWhere) {
  const auto refusal = [](const std::string& rest, const std::string& base = kSwerve) {
    const std::string text = error_of(section(rest, base));
    return text.substr(std::min(text.find("sensor."), text.size()));
  };
  EXPECT_EQ(refusal("y_m: [0, 1]", "base: swerve, x_m: [0, 1, 2], radius_m: 0.1, features: 0"),
            "sensor.y_m: needs as many numbers as x_m");
  EXPECT_EQ(refusal("steer_offset_rad: [0, 1]"),
            "sensor.steer_offset_rad: has 2 values, not 1 or 4");
  EXPECT_EQ(refusal("base: ackermann", "x_m: [0, 0], y_m: [1, -1], radius_m: 0.1, features: 0"),
            "sensor.x_m: base ackermann has four wheels: rear left, rear right, front left, front "
            "right");
  EXPECT_EQ(refusal("slip_per_load: 0"),
            "sensor.slip_angle_per_load_rad: tyres that slip slip in both directions, those that "
            "do not (slip_per_load: 0) in none");
  EXPECT_EQ(refusal("slip_per_load: 0, slip_angle_per_load_rad: 0"),
            "sensor.slip_per_load: wheels with play or lag must slip: it must not be 0");
  EXPECT_EQ(refusal("ideal: true, controller_knows: nominal"),
            "sensor.controller_knows: a base whose controller is wrong must slip");
  EXPECT_EQ(refusal("duration_s: 5, motion: straight, ramp_s: 0.05, speed_m_per_s: 2"),
            "sensor.motion: after 0.000000 s base swerve would need more friction than there is");
  EXPECT_NE(refusal("duration_s: 5, ideal: true, motion: spin",
                    "base: skid_steer, x_m: [0.2, -0.2, 0.2, -0.2], y_m: [0.2, 0.2, -0.2, -0.2], "
                    "radius_m: 0.1, features: 0")
                .find("base skid_steer would have to slip (slip_per_load: 0)"),
            std::string::npos);
}

}  // namespace
}  // namespace viwo

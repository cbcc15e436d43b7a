// The simulator as the host loads it: what it yields and in which order, its truth, its streams.
#include "test_simulator.hpp"

#include <cmath>
#include <set>

#include "viwo/math/so3.hpp"
#include "viwo/sim/body_trajectory.hpp"

namespace viwo {
namespace {

TEST(Simulator, SimulatesTheSixMotionsOnBothGrounds) {
  for (const std::string motion :
       {"icr_sweep", "straight", "lateral", "circle", "stationary", "figure_eight"}) {
    for (const std::string ground : {"flat", "uneven"}) {
      const auto all = play(*make_sensor(section_of(
          "n_cameras: 2, features: 30, duration_s: 20, t_OtoI_s: 0.01, motion: " + motion +
          ", ground: " + ground)));
      EXPECT_EQ(only<ImuSample>(all).size(), 4001U) << motion;
      EXPECT_EQ(only<EncoderSample>(all).size(), 2001U) << motion;
      const auto images = only<FeatureSample>(all);
      EXPECT_EQ(images.size(), 400U) << motion;
      for (const auto& image : images) ASSERT_EQ(image.points.size(), 30U) << motion << ground;
      EXPECT_EQ(only<StateSample>(all).size(), 201U) << motion;
    }
  }
}

TEST(Simulator, RepetitionsAreOfOneRobotWithOtherNoise) {
  const auto drive = [](int repetition) {
    return play(
        *make_sensor(section_of("duration_s: 1, features: 0, true_intrinsics_scale: 1, "
                                "true_sigma_t_OtoI_s: 0.01, repetition: " +
                                std::to_string(repetition))));
  };
  const auto first = drive(0), second = drive(1), third = drive(2);
  const auto truth = only<CalibrationSample>(first);
  EXPECT_GT(truth.size(), 10U);
  for (const auto* other : {&second, &third}) {
    const auto same = only<CalibrationSample>(*other);
    ASSERT_EQ(same.size(), truth.size());
    for (std::size_t i = 0; i < truth.size(); ++i) EXPECT_EQ(same[i].value, truth[i].value);
  }
  const auto gyro = [](const auto& samples) {
    return only<ImuSample>(samples)[100].gyro_rad_per_s;
  };
  const auto drives = [](const auto& samples) {
    return only<EncoderSample>(samples)[50].drive_rad_per_s;
  };
  EXPECT_NE(gyro(first), gyro(second));
  EXPECT_NE(gyro(second), gyro(third));
  EXPECT_NE(drives(first), drives(second));
  EXPECT_NE(drives(second), drives(third));
}

TEST(Simulator, ABaseThatCannotMoveSidewaysDrivesOnUnevenGround) {
  const auto samples = play_only<EncoderSample>(
      section_of("motion: figure_eight, ground: uneven, features: 0, noise: false", kDifferential));
  EXPECT_EQ(samples.size(), 6001U);
}

TEST(Simulator, TrueValuesComeFirstAndAreThoseThatWereAskedFor) {
  const auto all = play(*make_sensor(section_of(
      "duration_s: 1, features: 0, start_ns: 5, t_OtoI_s: 0.012, p_IinO_m: [0.1, 0.2, 0.3], "
      "rpy_ItoO_rad: [0.1, -0.2, 0.3], true_intrinsics_scale: 1")));
  const auto truth = calibration_of(all);
  ASSERT_EQ(truth.size(), 16U + 7U);
  for (std::size_t k = 0; k < truth.size(); ++k) {
    EXPECT_NE(all[k].get_if<CalibrationSample>(), nullptr) << k;
    EXPECT_EQ(stamp_ns(all[k]), 5);
  }
  EXPECT_NE(all[truth.size()].get_if<StateSample>(), nullptr);
  EXPECT_EQ(truth.at("t_OtoI"), 0.012);
  EXPECT_EQ(truth.at("p_IinO_x"), 0.1);
  EXPECT_EQ(truth.at("p_IinO_z"), 0.3);
  const Eigen::Matrix3d R_ItoO =
      exp_so3({truth.at("theta_ItoO_x"), truth.at("theta_ItoO_y"), truth.at("theta_ItoO_z")});
  EXPECT_NEAR((R_ItoO - sim::rotation_from_euler(0.3, -0.2, 0.1)).norm(), 0., 1e-12);
  EXPECT_NE(truth.at("x_1"), 0.1125);  // also what a filter holds
  EXPECT_NEAR(truth.at("x_1"), 0.1125, 0.06);
  EXPECT_NE(truth.at("x_2"), -0.1125);
  EXPECT_NEAR(truth.at("x_2"), -0.1125, 0.06);
}

TEST(Simulator, StatesStandAtTheFirstImuStampAndAtTheImages) {
  for (const std::string phase : {"0", "0.0137"}) {
    const auto all = play(*make_sensor(
        section_of("duration_s: 2, features: 20, start_ns: 1000000000, camera_phase_s: " + phase)));
    const auto states = only<StateSample>(all);
    const auto images = only<FeatureSample>(all);
    const std::size_t extra = phase == "0" ? 0 : 1;
    EXPECT_EQ(states[0].t_ns, only<ImuSample>(all)[0].t_ns);
    ASSERT_EQ(states.size(), images.size() + extra);
    for (std::size_t k = 0; k < images.size(); ++k) {
      EXPECT_EQ(states[k + extra].t_ns, images[k].t_ns);
    }
    EXPECT_GE(only<ImuSample>(all).back().t_ns, images.back().t_ns);
  }
}

TEST(Simulator, EncodersAreOfTheTrueStatesAtTheirTimeOffset) {
  // On a circle at constant speed every wheel turns at a constant rate, at any offset; on a ramp
  // the offset shows: readings are those of 0.2 s later.
  const std::string rest = "motion: straight, ramp_s: 4, noise: false, features: 0, duration_s: 5";
  const auto now = play_only<EncoderSample>(section_of(rest));
  const auto ahead = play_only<EncoderSample>(section_of(rest + ", t_OtoI_s: 0.2"));
  for (std::size_t k = 0; k + 20 < now.size(); ++k) {
    EXPECT_NEAR(ahead[k].drive_rad_per_s[0], now[k + 20].drive_rad_per_s[0], 1e-6) << k;
  }
  EXPECT_GT(std::abs(ahead[150].drive_rad_per_s[0] - now[150].drive_rad_per_s[0]), 1.);
}

bool same(const FeatureSample& a, const FeatureSample& b) {
  return a.t_ns == b.t_ns && a.camera == b.camera &&
         std::equal(a.points.begin(), a.points.end(), b.points.begin(), b.points.end(),
                    [](const FeaturePoint& x, const FeaturePoint& y) {
                      return x.id == y.id && x.u_px == y.u_px && x.v_px == y.v_px;
                    });
}

bool same(const ImuSample& a, const ImuSample& b) {
  return a.t_ns == b.t_ns && a.gyro_rad_per_s == b.gyro_rad_per_s &&
         a.accel_m_per_s2 == b.accel_m_per_s2;
}

bool same(const PoseSample& a, const PoseSample& b) {
  return a.t_ns == b.t_ns && a.p_BinW_m == b.p_BinW_m && a.q_BtoW_xyzw == b.q_BtoW_xyzw;
}

bool same(const EncoderSample& a, const EncoderSample& b) {
  return a.t_ns == b.t_ns && a.drive_rad_per_s == b.drive_rad_per_s && a.steer_rad == b.steer_rad;
}

template <class Sample>
::testing::AssertionResult all_same(const std::vector<Measurement>& a,
                                    const std::vector<Measurement>& b) {
  const auto left = only<Sample>(a), right = only<Sample>(b);
  if (left.empty() || left.size() != right.size()) {
    return ::testing::AssertionFailure() << left.size() << " and " << right.size() << " samples";
  }
  for (std::size_t k = 0; k < left.size(); ++k) {
    if (!same(left[k], right[k])) return ::testing::AssertionFailure() << "sample " << k;
  }
  return ::testing::AssertionSuccess();
}

TEST(Simulator, SensorsThatAreTurnedOffLeaveTheOthersAsTheyWere) {
  const std::string rest =
      "duration_s: 5, n_cameras: 2, features: 30, t_OtoI_s: 0.01, sigma_gyro_bias_rad_per_s: 0.01, "
      "true_intrinsics_scale: 1";
  const auto with = [&](const std::string& more, std::uint64_t seed = 1) {
    return play(*make_sensor(section_of(rest + more), seed));
  };
  const auto all = with("");
  const auto again = with("");
  EXPECT_TRUE(all_same<ImuSample>(all, again));
  EXPECT_TRUE(all_same<FeatureSample>(all, again));
  EXPECT_TRUE(all_same<EncoderSample>(all, again));
  const auto no_wheels = with(", wheels: false");
  EXPECT_TRUE(only<EncoderSample>(no_wheels).empty());
  EXPECT_TRUE(all_same<ImuSample>(all, no_wheels));
  EXPECT_TRUE(all_same<FeatureSample>(all, no_wheels));
  const auto no_imu = with(", imu: false");
  EXPECT_TRUE(only<ImuSample>(no_imu).empty());
  EXPECT_TRUE(all_same<FeatureSample>(all, no_imu));
  EXPECT_TRUE(all_same<EncoderSample>(all, no_imu));
  const auto faulty = with(", outlier_probability: 0.2, slip_start_s: [1], sigma_px: 2");
  EXPECT_TRUE(all_same<ImuSample>(all, faulty));
  EXPECT_FALSE(all_same<EncoderSample>(all, faulty));
  EXPECT_FALSE(all_same<FeatureSample>(all, faulty));
  const auto other = with("", 2);
  EXPECT_FALSE(all_same<ImuSample>(all, other));
  EXPECT_FALSE(all_same<FeatureSample>(all, other));
  EXPECT_FALSE(all_same<EncoderSample>(all, other));
  const auto blind =
      play(*make_sensor("{type: simulator, " + std::string(kSwerve) +
                        ", features: 0, duration_s: 5, t_OtoI_s: 0.01, "
                        "sigma_gyro_bias_rad_per_s: 0.01, true_intrinsics_scale: 1}"));
  EXPECT_TRUE(only<FeatureSample>(blind).empty());
  EXPECT_TRUE(all_same<ImuSample>(all, blind));
  EXPECT_TRUE(all_same<EncoderSample>(all, blind));
  EXPECT_EQ(only<StateSample>(all).size(), only<StateSample>(blind).size());
}

TEST(Simulator, IsExactWhenThatIsAskedForWhateverItsParametersSay) {
  const std::string rest = "duration_s: 3, n_cameras: 2, features: 30, pose_rate_hz: 5, ";
  const auto sensor = make_sensor(
      section_of(rest +
                 "true_intrinsics_scale: 1, sigma_gyro_bias_rad_per_s: 0.01, "
                 "outlier_probability: 0.1, slip_start_s: [1], drive_resolution_rad_per_s: 0.1, "
                 "pose_outlier_probability: 0.3, feature_outlier_probability: 0.1, "
                 "feature_dropout_probability: 0.1" +
                 kWrongCameras),
      1, true);
  EXPECT_TRUE(sensor->can_be_exact());
  const auto exact = play(*sensor);
  const auto quiet = play(*make_sensor(section_of(rest + "noise: false")));
  EXPECT_EQ(calibration_of(exact), calibration_of(quiet));
  EXPECT_TRUE(all_same<ImuSample>(exact, quiet));
  EXPECT_TRUE(all_same<EncoderSample>(exact, quiet));
  EXPECT_TRUE(all_same<FeatureSample>(exact, quiet));
  EXPECT_TRUE(all_same<PoseSample>(exact, quiet));
}

TEST(Simulator, NamesTheKindsOfSamplesThatItIsConfiguredToYield) {
  const auto kinds = [](const std::string& rest) {
    return kinds_of(*make_sensor(section_of("duration_s: 1" + rest)));
  };
  using Kinds = std::set<std::string>;
  EXPECT_EQ(kinds(""),
            (Kinds{"true calibration", "reference states", "imu", "encoders", "tracks"}));
  EXPECT_EQ(kinds(", features: 0, wheels: false, imu: false, pose_rate_hz: 1"),
            (Kinds{"true calibration", "reference states", "poses"}));
  EXPECT_EQ(kinds(", features: 0, imu: false, wheel_set: back"),
            (Kinds{"true calibration", "encoders"}));
}

TEST(Simulator, SaysWhatItRefusesAndWhere) {
  const auto refusal = [](const std::string& rest, const std::string& robot = kSwerve) {
    const std::string text = error_of(section_of(rest, robot));
    return text.substr(std::min(text.find("sensor."), text.size()));
  };
  EXPECT_EQ(refusal("p_IinO_m: [1, 2]"),
            "sensor.p_IinO_m: needs 3 numbers, not 2 (where the IMU sits on the base, m)");
  EXPECT_EQ(refusal("landmark_min_m: 8"), "sensor.landmark_max_m: is less than landmark_min_m");
  EXPECT_EQ(refusal("n_cameras: 2, camera_clock_error_s: [0, 0, 0]"),
            "sensor.camera_clock_error_s: needs one number, or one for each of the 2 cameras, not "
            "3");
  EXPECT_EQ(refusal("slip_wheel: 5"), "sensor.slip_wheel: 5 is not one of the robot's 4 wheels");
  EXPECT_EQ(
      refusal("n_cameras: 3").substr(0, 44),
      "sensor.n_cameras: there are only 2 in " + std::string(VIWO_TEST_SOURCE_DIR).substr(0, 6));
  EXPECT_EQ(refusal("motion: lateral, features: 0", kDifferential).substr(0, 58),
            "sensor.motion: this base cannot follow motion 'lateral' (v");
  EXPECT_NE(error_of("{type: simulator, " + std::string(kSwerve) + "}")
                .find("cameras: a file is needed, or features: 0"),
            std::string::npos);
}

}  // namespace
}  // namespace viwo

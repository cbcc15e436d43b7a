// IMU and cameras on a recorded motion: a recording written here, and the real ones where they are
// at hand.
#include <cmath>
#include <cstdio>

#include "support.hpp"

namespace viwo {
namespace {

const std::string kCameras =
    std::string("cameras: ") + VIWO_TEST_SOURCE_DIR + "/configs/cameras/pinhole.yaml";

/// A circle of 1 m radius at 0.2 rad/s, at 50 Hz for `duration_s`, tilted by 10 mrad about x and
/// rising: what planar mode leaves out. After a second there is none for `gap_s`.
std::filesystem::path write_circle(double duration_s, int gap_s = 0) {
  const auto file = std::filesystem::path(::testing::TempDir()) /
                    ("viwo_circle_" + std::to_string(::getpid()) + ".csv");
  std::ofstream out(file);
  out << "time;.header.seq;.header.stamp.secs;.header.stamp.nsecs;.header.frame_id;"
         ".pose.position.x;.pose.position.y;.pose.position.z;.pose.orientation.x;"
         ".pose.orientation.y;.pose.orientation.z;.pose.orientation.w\n";
  for (int k = 0; k <= std::lround(duration_s * 50.); ++k) {
    const double a = 0.2 * 0.02 * k;
    char row[300];
    std::snprintf(row, sizeof row,
                  "2024/05/03/12:34:34.000000;%d;%d;%d;world;%.9f;%.9f;%.9f;%.12f;%.12f;%.12f;"
                  "%.12f\n",
                  k, 1000 + k / 50 + (k < 50 ? 0 : gap_s), (k % 50) * 20000000, std::sin(a),
                  1. - std::cos(a), 0.1 * a, std::cos(0.5 * a) * std::sin(0.005),
                  std::sin(0.5 * a) * std::sin(0.005), std::sin(0.5 * a) * std::cos(0.005),
                  std::cos(0.5 * a) * std::cos(0.005));
    out << row;
  }
  return file;
}

std::string config(const std::filesystem::path& file, const std::string& rest) {
  return "{type: recorded_motion_simulator, path: " + file.string() + ", " + kCameras + ", " +
         rest + "}";
}

TEST(RecordedMotionSimulator, AnImuOnARecordedCircleReadsItsRateAndAcceleration) {
  const auto file = write_circle(20.);
  const auto all = play(
      *make_sensor(config(file, "noise: false, features: 20, p_IinO_m: [0, 0, 0], planar: true")));
  const auto imu = only<ImuSample>(all);
  EXPECT_EQ(imu.front().t_ns, 1'000'300'000'000);  // one knot spacing in
  EXPECT_EQ(imu.size(), 3880U);                    // and one before the end
  for (std::size_t k = 200; k + 200 < imu.size(); ++k) {
    EXPECT_NEAR(imu[k].gyro_rad_per_s[2], 0.2, 1e-6);
    EXPECT_EQ(imu[k].gyro_rad_per_s[0], 0.);
    EXPECT_NEAR(imu[k].accel_m_per_s2[0], 0., 1e-5);
    EXPECT_NEAR(imu[k].accel_m_per_s2[1], 0.04, 1e-5);
    EXPECT_EQ(imu[k].accel_m_per_s2[2], 9.81);
  }
  const auto images = only<FeatureSample>(all);
  EXPECT_EQ(images.size(), 194U);
  EXPECT_EQ(images[0].points.size(), 20U);
  for (const StateSample& state : only<StateSample>(all)) {
    const double a = 0.2 * seconds_between(1'000'000'000'000, state.t_ns);
    EXPECT_NEAR(state.p_IinG_m[0], std::sin(a), 1e-6);
    EXPECT_NEAR(state.p_IinG_m[1], 1. - std::cos(a), 1e-6);
    EXPECT_EQ(state.p_IinG_m[2], 0.);
    EXPECT_NEAR(state.v_IinG_m_per_s[0], 0.2 * std::cos(a), 1e-4);
  }
}

TEST(RecordedMotionSimulator, InSpaceItKeepsTiltAndHeightAndTheOffsetMovesItsStamps) {
  const auto file = write_circle(10.);
  const auto all = play(*make_sensor(config(
      file, "noise: false, features: 0, p_IinO_m: [0, 0, 0], planar: false, time_offset_s: -0.5")));
  const auto imu = only<ImuSample>(all);
  EXPECT_EQ(imu.front().t_ns, 999'800'000'000);
  for (std::size_t k = 200; k + 200 < imu.size(); ++k) {
    // Yaw at a constant rate about the vertical, on a body that is rolled by 10 mrad.
    EXPECT_NEAR(imu[k].gyro_rad_per_s[1], 0.2 * std::sin(0.01), 1e-6);
    EXPECT_NEAR(imu[k].gyro_rad_per_s[2], 0.2 * std::cos(0.01), 1e-6);
  }
  const StateSample last = only<StateSample>(all).back();
  const double t = seconds_between(999'500'000'000, last.t_ns);
  EXPECT_NEAR(last.p_IinG_m[2], 0.1 * 0.2 * t, 1e-6);
}

TEST(RecordedMotionSimulator, IsExactWhenThatIsAskedForAndTellsTheTruthOfItsCameras) {
  const auto file = write_circle(5.);
  const std::string wrong =
      "features: 20, camera_clock_error_s: [0.01], sigma_true_camera_focal_px: 5";
  const auto sensor = make_sensor(config(file, wrong), 1, true);
  EXPECT_TRUE(sensor->can_be_exact());
  const auto exact = play(*sensor);
  const auto quiet = play(*make_sensor(config(file, "features: 20, noise: false")));
  ASSERT_EQ(exact.size(), quiet.size());
  const auto a = only<FeatureSample>(exact), b = only<FeatureSample>(quiet);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    EXPECT_EQ(a[k].t_ns, b[k].t_ns);
    EXPECT_EQ(a[k].points.back().u_px, b[k].points.back().u_px);
  }
  EXPECT_EQ(only<CalibrationSample>(exact).size(), 15U);
  const auto truth = play_only<CalibrationSample>(config(file, wrong));
  ASSERT_EQ(truth.size(), 15U);
  EXPECT_EQ(truth[6].name, "cam0.fx");
  EXPECT_NE(truth[6].value, only<CalibrationSample>(exact)[6].value);
  EXPECT_EQ(truth[14].name, "cam0.t_CtoI");
  EXPECT_EQ(truth[14].value, 0.01);
}

TEST(RecordedMotionSimulator, RefusesWhatItCannotRead) {
  EXPECT_NE(error_of(config("/nonexistent.csv", "features: 0")).find("/nonexistent.csv"),
            std::string::npos);
  EXPECT_NE(error_of(config(write_circle(0.), "features: 0")).find("at least two poses"),
            std::string::npos);
  EXPECT_EQ(error_of(config(write_circle(2., 5), "features: 0")), "");
  EXPECT_NE(error_of(config(write_circle(2., 1000000000), "features: 0"))
                .find("no poses for 1000000000.0 s after"),
            std::string::npos);
}

TEST(RecordedMotionSimulator, RunsOnAllRealRecordings) {
  const auto folder = std::filesystem::path(VIWO_TEST_SHARED_DIR) / "data/4wis4wid";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no recordings in " << folder;
  for (const int run : {1, 2, 3, 6, 7, 8, 11, 12, 13, 16, 17, 18, 21, 22, 23, 26, 27, 28}) {
    const auto file = folder / ("abs_" + std::to_string(run) + ".csv.gz");
    const auto all = play(*make_sensor(config(file, "noise: false, features: 50")));
    const auto imu = only<ImuSample>(all);
    EXPECT_GT(imu.size(), 8000U) << run;
    for (const ImuSample& sample : imu) {
      // A robot that drives at 0.05 m/s; it starts and stops within a tenth of a second.
      EXPECT_LT(std::hypot(sample.accel_m_per_s2[0], sample.accel_m_per_s2[1]), 0.5) << run;
      EXPECT_LT(std::abs(sample.gyro_rad_per_s[2]), 0.4) << run;
    }
    for (const FeatureSample& image : only<FeatureSample>(all)) {
      ASSERT_EQ(image.points.size(), 50U) << run;
    }
  }
}

}  // namespace
}  // namespace viwo

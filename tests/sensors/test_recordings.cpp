// The real recordings, where they are at hand: counts, order of the wheels, plausible numbers.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>

#include "support.hpp"

namespace viwo {
namespace {

class Recordings : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(VIWO_TEST_SHARED_DIR) / "data/4wis4wid";
    if (!std::filesystem::exists(folder_ / "odom_1.csv.gz")) {
      GTEST_SKIP() << "no recordings in " << folder_;
    }
  }

  /// Wheels FL, BL, BR, FR.
  std::string encoders(int run, const std::string& rest = "") const {
    return "{type: ros_text_encoders, path: " +
           (folder_ / ("odom_" + std::to_string(run) + ".csv.gz")).string() +
           ", drive: [FL_Wheel, BL_Wheel, BR_Wheel, FR_Wheel]"
           ", steer: [FL_Position, BL_Position, BR_Position, FR_Position]" +
           rest + "}";
  }

  std::string poses(int run, const std::string& rest = "") const {
    return "{type: ros_text_pose, path: " +
           (folder_ / ("abs_" + std::to_string(run) + ".csv.gz")).string() + rest + "}";
  }

  static double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  }

  static std::vector<double> drive(const std::vector<EncoderSample>& samples, std::size_t wheel) {
    std::vector<double> out;
    for (const EncoderSample& sample : samples) out.push_back(sample.drive_rad_per_s[wheel]);
    return out;
  }

  std::filesystem::path folder_;
};

TEST_F(Recordings, ForwardRunHasSteadyStampsAndTheExpectedRates) {
  const auto samples = play_only<EncoderSample>(encoders(1));
  ASSERT_EQ(samples.size(), 5642U);  // 5643 messages, differences between them
  std::vector<double> lengths;
  for (const EncoderSample& sample : samples) {
    lengths.push_back(seconds_between(sample.begin_ns, sample.end_ns));
  }
  EXPECT_NEAR(median(lengths), 0.016, 1e-4);
  EXPECT_LT(*std::max_element(lengths.begin(), lengths.end()), 0.03);
  // Over 0.8 s the resolution of the angles is 0.002 rad/s.
  const auto smooth = play_only<EncoderSample>(encoders(1, ", stride: 50"));
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(median(drive(smooth, i)), 1.97, 0.01) << i;
}

TEST_F(Recordings, VelocitiesAgreeWithDifferencesButForTheirTruncation) {
  const auto positions = play_only<EncoderSample>(encoders(1, ", stride: 10"));
  const auto velocities = play_only<EncoderSample>(encoders(1, ", drive_input: velocity"));
  ASSERT_EQ(positions.size(), 564U);
  ASSERT_EQ(velocities.size(), 5643U);
  for (std::size_t i = 0; i < 4; ++i) {
    const double by_position = median(drive(positions, i));
    const double by_velocity = median(drive(velocities, i));
    EXPECT_GE(by_position - by_velocity, -0.001) << i;
    EXPECT_LE(by_position - by_velocity, 0.025) << i;  // one step of the velocity
  }
}

TEST_F(Recordings, SteeringAnglesTellTheWheelsApart) {
  const auto crab = play_only<EncoderSample>(encoders(6));
  const auto spin = play_only<EncoderSample>(encoders(21));
  const double quarter = std::numbers::pi / 4.;
  // Counter-clockwise on the spot: each wheel stands square to its arm, rolling either way.
  const double across[4] = {-quarter, quarter, -quarter, quarter};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(crab[crab.size() / 2].steer_rad[i], 2. * quarter, 0.02) << i;
    EXPECT_NEAR(spin[spin.size() / 2].steer_rad[i], across[i], 0.02) << i;
  }
  EXPECT_LT(median(drive(spin, 0)), -0.5);  // FL and BL roll backwards
  EXPECT_LT(median(drive(spin, 1)), -0.5);
  EXPECT_GT(median(drive(spin, 2)), 0.5);
  EXPECT_GT(median(drive(spin, 3)), 0.5);
}

TEST_F(Recordings, BothClocksAgreeToMilliseconds) {
  const auto by_stamp = play_only<EncoderSample>(encoders(1, ", drive_input: velocity"));
  const auto by_reception =
      play_only<EncoderSample>(encoders(1, ", drive_input: velocity, clock: reception"));
  ASSERT_EQ(by_stamp.size(), by_reception.size());
  std::vector<double> ahead;
  for (std::size_t k = 0; k < by_stamp.size(); ++k) {
    ahead.push_back(seconds_between(by_reception[k].t_ns, by_stamp[k].t_ns));
  }
  EXPECT_NEAR(median(ahead), 0., 0.005);  // hours if the offset from UTC were wrong
}

TEST_F(Recordings, TruthCoversTheForwardRunAndItsGapIsCounted) {
  const auto sensor = make_sensor(poses(1));
  const auto samples = only<PoseSample>(play(*sensor));
  ASSERT_EQ(samples.size(), 5488U);
  EXPECT_NEAR(samples.front().p_BinW_m[0], 0., 1e-3);
  EXPECT_NEAR(std::hypot(samples.back().p_BinW_m[0], samples.back().p_BinW_m[1]), 4.07, 0.05);
  EXPECT_NEAR(samples.front().q_BtoW_xyzw[3], 1., 1e-6);
  EXPECT_THAT(rejections_of(*sensor),
              ::testing::ElementsAre(::testing::StartsWith("gap longer than 0.2 s | 1 | ")));
}

TEST_F(Recordings, AllRunsCanBeRead) {
  for (const int run : {1, 2, 3, 6, 7, 8, 11, 12, 13, 16, 17, 18, 21, 22, 23, 26, 27, 28}) {
    EXPECT_GT(play_only<EncoderSample>(encoders(run)).size(), 2000U) << run;
    EXPECT_GT(play_only<PoseSample>(poses(run)).size(), 2000U) << run;
  }
}

}  // namespace
}  // namespace viwo

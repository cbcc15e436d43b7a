// Trajectories in the TUM format.
#include <random>

#include "log_files.hpp"
#include "viwo/log/tum.hpp"

namespace viwo::log {
namespace {

class TumTest : public InFolder {
 protected:
  std::string message(const std::string& line) const {
    const auto file = write("bad.tum", "# comment\n1 0 0 0 0 0 0 1\n" + line + "\n");
    const std::string text = error_of([&] { read_tum(file); });
    EXPECT_EQ(text.rfind(file.string(), 0), 0U) << text;
    return text.substr(std::min(text.size(), file.string().size()));
  }
};

TEST_F(TumTest, ReadsStampsExactlyAndQuaternionsInTheirOrder) {
  const Trajectory read = read_tum(write_gz("a.tum.gz",
                                            "# t x y z qx qy qz qw\n\n"
                                            "1403636579.763555527 1 2 3 0 0 0.6 0.8\n"
                                            " 1403636579.763555528\t4 5 6 1 0 0 0 \n"));
  ASSERT_EQ(read.size(), 2U);
  EXPECT_EQ(read[0].t_ns, 1403636579763555527);
  EXPECT_EQ(read[1].t_ns, 1403636579763555528);
  EXPECT_EQ(read[0].p_BinW, Eigen::Vector3d(1., 2., 3.));
  EXPECT_EQ(read[0].q_BtoW.z(), 0.6);
  EXPECT_EQ(read[0].q_BtoW.w(), 0.8);
  EXPECT_NEAR(yaw(read[0]), 2. * std::asin(0.6), 1e-15);
}

TEST_F(TumTest, WrittenTrajectoriesReadBackToTheSameBits) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-10., 10.);
  Trajectory written;
  for (std::int64_t i = 0; i < 200; ++i) {
    StampedPose pose;
    pose.t_ns = -1'500'000'007 + i * 33'333'333;
    pose.p_BinW << uniform(random), uniform(random), uniform(random);
    pose.q_BtoW =
        Eigen::Quaterniond(uniform(random), uniform(random), uniform(random), uniform(random))
            .normalized();
    written.push_back(pose);
  }
  write_tum(folder_ / "a.tum", written);
  const Trajectory read = read_tum(folder_ / "a.tum");
  ASSERT_EQ(read.size(), written.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].t_ns, written[i].t_ns);
    EXPECT_EQ(read[i].p_BinW, written[i].p_BinW);
    EXPECT_EQ(read[i].q_BtoW.coeffs(), written[i].q_BtoW.coeffs());
  }
}

TEST_F(TumTest, WritesSecondsWithNineDecimals) {
  Trajectory trajectory(2);
  trajectory[0].t_ns = -7;
  trajectory[0].p_BinW << 0.1, -2., 0.;
  trajectory[1].t_ns = 1'000'000'042;
  write_tum(folder_ / "a.tum", trajectory);
  EXPECT_EQ(text_of(folder_ / "a.tum"),
            "# t[s] x[m] y[m] z[m] qx qy qz qw\n"
            "-0.000000007 0.1 -2 0 0 0 0 1\n"
            "1.000000042 0 0 0 0 0 0 1\n");
}

TEST_F(TumTest, NormalisesWhatWasRounded) {
  const Trajectory read = read_tum(write("a.tum", "0 0 0 0 0 0 0.6002 0.8\n"));
  EXPECT_NEAR(read.at(0).q_BtoW.norm(), 1., 1e-15);
}

TEST_F(TumTest, SaysLineAndWhatIsWrong) {
  EXPECT_EQ(message("2 0 0 0 0 0 0"),
            ":3  expected 8 numbers 't x y z qx qy qz qw', found 7 fields");
  EXPECT_EQ(message("2,0,0,0,0,0,0,1"),
            ":3  expected 8 numbers 't x y z qx qy qz qw', found 1 field");
  EXPECT_EQ(message("2 0 0 0 0 0 0 1 5"),
            ":3  expected 8 numbers 't x y z qx qy qz qw', found 9 fields");
  EXPECT_EQ(message("two 0 0 0 0 0 0 1"), ":3  column 't': 'two' is no time in seconds");
  EXPECT_EQ(message("2 0 0 zero 0 0 0 1"), ":3  column 'z': 'zero' is not a number");
  EXPECT_EQ(message("2 0 nan 0 0 0 0 1"), ":3  column 'y': 'nan' is not finite");
  EXPECT_EQ(message("2 0 1e160 0 0 0 0 1"), ":3  position beyond 1e9 m");
  EXPECT_EQ(message("2 0 0 0 0 0 0 0.5"), ":3  the quaternion has the norm 0.5, not 1");
  EXPECT_EQ(message("1 0 0 0 0 0 0 1"), ":3  the stamp is not after the previous one");
  const auto file = write("comments.tum", "# nothing\n");
  EXPECT_EQ(error_of([&] { read_tum(file); }), file.string() + "  holds no pose");
}

TEST_F(TumTest, AFailedWriteIsAnError) {
  EXPECT_EQ(error_of<std::runtime_error>([] { write_tum("/dev/full", Trajectory(1)); }),
            "cannot write /dev/full: No space left on device");
}

TEST(Interpolation, IsLinearInPositionAndSlerpInOrientation) {
  const auto turned = [](double angle) {
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()));
  };
  const Trajectory trajectory = {{0, {0., 0., 0.}, turned(0.)},
                                 {1'000'000'000, {2., -4., 0.}, turned(1.2)},
                                 {3'000'000'000, {2., 0., 0.}, turned(0.)}};
  const auto quarter = interpolate(trajectory, 250'000'000, 1.5);
  ASSERT_TRUE(quarter.has_value());
  EXPECT_TRUE(quarter->p_BinW.isApprox(Eigen::Vector3d(0.5, -1., 0.), 1e-15));
  EXPECT_NEAR(yaw(*quarter), 0.3, 1e-15);
  EXPECT_EQ(interpolate(trajectory, 3'000'000'000, 1.5)->p_BinW.x(), 2.);
  EXPECT_FALSE(interpolate(trajectory, 2'000'000'000, 1.5).has_value());  // a gap of 2 s
  EXPECT_FALSE(interpolate(trajectory, -1, 1.5).has_value());
  EXPECT_FALSE(interpolate(trajectory, 3'000'000'001, 1.5).has_value());
  EXPECT_FALSE(interpolate({}, 0, 1.5).has_value());
}

}  // namespace
}  // namespace viwo::log

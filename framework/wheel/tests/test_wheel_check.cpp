// Which wheel lies.
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "viwo/wheel/preintegration.hpp"
#include "viwo/wheel/wheel_check.hpp"
#include "wheel_fixture.hpp"

namespace viwo {
namespace {

using testing::load_model;
using testing::sample_motion;
using testing::swerve;
using testing::with_noise;

constexpr double kProbability = 1e-6;

Twist curvy(double t) {
  return {0.5 + 0.2 * std::cos(0.9 * t), 0.2 * std::sin(1.3 * t), 0.5 * std::sin(0.8 * t)};
}

/// Half a minute with the noise of the model, times `scale`.
std::vector<EncoderSample> drive(const WheelModel& model, unsigned seed, double scale,
                                 const std::function<Twist(double)>& motion) {
  std::mt19937_64 rng(seed);
  std::vector<EncoderSample> noisy;
  for (const EncoderSample& clean : sample_motion(model, motion, 30., 50.)) {
    noisy.push_back(
        with_noise(model, motion(1e-9 * static_cast<double>(clean.t_ns)), clean, scale, rng));
  }
  return noisy;
}

using Fault = std::function<void(EncoderSample&)>;

/// Runs the check over a drive in which `fault` befalls the samples from 10 s to 20 s.
struct Checked {
  Checked(const std::string& yaml, const Fault& fault, double scale = 1.,
          const Intrinsics& off = Intrinsics(), double prior = 0.,
          const std::function<Twist(double)>& motion = curvy)
      : model(load_model(yaml)), check(model, kProbability) {
    const int n = model->n_intrinsics();
    Intrinsics x = model->nominal();
    if (off.size() > 0) x += off;
    IntrinsicMatrix P = IntrinsicMatrix::Zero(n, n);
    P.diagonal() = prior * model->prior_sigma().cwiseAbs2();
    check.set_calibration(x, P);
    for (EncoderSample y : drive(*model, 3, scale, motion)) {
      const bool is_faulty = y.t_ns >= 10'000'000'000 && y.t_ns < 20'000'000'000;
      if (is_faulty && fault) fault(y);
      check.check(y);
      (is_faulty ? during : outside).push_back(y);
    }
    check.rejections(rejections);
  }

  static int count(const std::vector<EncoderSample>& samples, std::uint32_t drives,
                   std::uint32_t steers) {
    int n = 0;
    for (const EncoderSample& y : samples) n += y.bad_drives == drives && y.bad_steers == steers;
    return n;
  }

  std::shared_ptr<const WheelModel> model;
  WheelCheck check;
  std::vector<EncoderSample> during, outside;
  std::vector<RejectionCount> rejections;
};

TEST(WheelCheck, LeavesAloneWheelsWithTheNoiseThatIsConfigured) {
  const Checked checked(swerve("four_wis_wid"), nullptr);
  EXPECT_TRUE(checked.rejections.empty());
  EXPECT_NEAR(checked.check.noise().found(), 1., 0.03);
}

TEST(WheelCheck, LeavesOutTheWheelThatLiesForAsLongAsItDoes) {
  const std::vector<std::pair<std::string, Fault>> faults = {
      {"slips", [](EncoderSample& y) { y.drive_rad_per_s[2] *= 1.5; }},
      {"is blocked", [](EncoderSample& y) { y.drive_rad_per_s[2] = 0.; }},
      {"spikes", [](EncoderSample& y) { y.drive_rad_per_s[2] = 1e20; }},
      {"spikes to the end of numbers", [](EncoderSample& y) { y.drive_rad_per_s[2] = -1e300; }},
      {"runs backwards", [](EncoderSample& y) { y.drive_rad_per_s[2] *= -1.; }}};
  for (const auto& [name, fault] : faults) {
    SCOPED_TRACE(name);
    const Checked checked(swerve("four_wis_wid"), fault);
    EXPECT_GT(Checked::count(checked.during, 4, 0), 490);
    EXPECT_EQ(Checked::count(checked.outside, 0, 0), 1000);
    ASSERT_EQ(checked.rejections.size(), 1u);
    EXPECT_EQ(checked.rejections[0].reason,
              "drive 3 left out of a sample: the other wheels contradict it (its cable, sign, "
              "unit, or the order of the joints)");
    EXPECT_EQ(checked.rejections[0].first, "t = 10.010 s .. t = 19.990 s");
    EXPECT_NEAR(checked.check.noise().found(), 1., 0.05);
  }
}

// Rows of several wheels share the noise of a steering encoder, not what they lie.
TEST(WheelCheck, LeavesOutADriveOfACarAlone) {
  for (const char* steering : {"centre", "both"}) {
    SCOPED_TRACE(steering);
    const auto fault = [](EncoderSample& y) { y.drive_rad_per_s[1] *= 2.; };
    const Checked checked(
        std::string("{type: ackermann, wheel_base_m: 0.5, track_m: 0.4, radius_m: [0.1], "
                    "wheel_speeds: all, steering: ") +
            steering + "}",
        fault, 1., {}, 0., [](double t) { return Twist(0.8, 0., 0.3 * std::sin(0.8 * t)); });
    EXPECT_GT(Checked::count(checked.during, 2, 0), 480);
    EXPECT_EQ(Checked::count(checked.outside, 0, 0), 1000);
  }
}

TEST(WheelCheck, KnowsASteeringEncoderFromADrive) {
  const Checked checked(swerve("four_wis_wid"), [](EncoderSample& y) { y.steer_rad[1] += 0.3; });
  EXPECT_GT(Checked::count(checked.during, 0, 2), 400);
  EXPECT_EQ(Checked::count(checked.outside, 0, 0), 1000);
}

TEST(WheelCheck, GivesTheTwistOfTheThreeOthers) {
  const auto model = load_model(swerve("four_wis_wid"));
  WheelCheck check(model, kProbability);
  check.set_calibration(model->nominal(), IntrinsicMatrix::Zero(16, 16));
  TwistSolver solver(model, {.noise_weighted = true});
  TwistSolution of_three, of_four;
  for (EncoderSample y : sample_motion(*model, curvy, 5., 20.)) {
    const Twist truth = curvy(1e-9 * static_cast<double>(y.t_ns));
    y.drive_rad_per_s[1] += 7.;
    ASSERT_EQ(solver.solve(y, of_four), Status::kOk);
    check.check(y);
    ASSERT_EQ(y.bad_drives, 2u);
    ASSERT_EQ(solver.solve(y, of_three), Status::kOk);
    EXPECT_LT((of_three.xi - truth).norm(), 1e-9);
    EXPECT_GT((of_four.xi - truth).norm(), 0.01);
    EXPECT_EQ(solver.parity().dof(), 3);
    EXPECT_LT(solver.parity().chi2(), 1e-9);
  }
}

TEST(WheelCheck, DoesNotBlameAWheelForACalibrationThatMayBeOff) {
  Intrinsics off = Intrinsics::Zero(16);
  off[0] = 0.0003, off[13] = 0.01;  // a radius and a steering offset by their prior sigma
  const Checked checked(swerve("four_wis_wid"), nullptr, 1., off, 1.);
  EXPECT_EQ(Checked::count(checked.outside, 0, 0), 1000);
  // Were it taken for known, wheels would be blamed, or the noise.
  const Checked sure(swerve("four_wis_wid"), nullptr, 1., off, 0.);
  EXPECT_TRUE(Checked::count(sure.outside, 0, 0) < 1000 || sure.check.noise().found() > 1.5);
}

TEST(WheelCheck, FindsThatAllWheelsAreWorseThanConfigured) {
  const Checked checked(swerve("four_wis_wid"), nullptr, 20.);
  int late = 0;
  for (std::size_t i = 500; i < 1000; ++i) {
    const EncoderSample& y = checked.outside[i];
    late += y.bad_drives != 0 || y.bad_steers != 0;
  }
  EXPECT_LT(late, 5);
  EXPECT_NEAR(checked.check.noise().scale(), 20., 3.);
}

TEST(WheelCheck, LeavesOutASampleOfWhichNobodyIsToBlameIfItIsAlone) {
  const Fault three_wheels = [](EncoderSample& y) {
    y.drive_rad_per_s[0] += 5., y.drive_rad_per_s[1] -= 3., y.drive_rad_per_s[2] += 8.;
  };
  int n = 0;
  const Checked alone(swerve("four_wis_wid"), [&](EncoderSample& y) {
    if (n++ % 50 == 0) three_wheels(y);
  });
  EXPECT_EQ(Checked::count(alone.during, 0xf, 0xf), 10);
  EXPECT_EQ(Checked::count(alone.during, 0, 0), 490);
  ASSERT_EQ(alone.rejections.size(), 1u);
  EXPECT_EQ(alone.rejections[0].count, 10);
  // Where it goes on the noise is found, and nothing more is left out.
  const Checked lasting(swerve("four_wis_wid"), three_wheels);
  EXPECT_LT(Checked::count(lasting.during, 0xf, 0xf), 3);
  EXPECT_GT(lasting.check.noise().found(), 20.);
}

TEST(WheelCheck, SaysNothingWhereNobodyCanTell) {
  // Four drives alone have one contradiction: it fits each of them.
  const Checked checked(swerve("four_wis_wid_drive_only"),
                        [](EncoderSample& y) { y.drive_rad_per_s[2] = 0.; });
  EXPECT_EQ(Checked::count(checked.during, 0, 0), 500);
}

}  // namespace
}  // namespace viwo

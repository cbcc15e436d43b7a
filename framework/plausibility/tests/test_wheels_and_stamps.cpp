// Faults of wheels, and of the stamps of any sensor, told from samples alone.
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "faulty_samples.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/plausibility/slip.hpp"

namespace viwo {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using testing::found;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::robot;
using testing::scale_drives;

TEST(Plausibility, NamesDrivesThatAreAllReversed) {
  EXPECT_THAT(found({.wheels = [](EncoderSample& s) { scale_drives(s, -1.); }}),
              ElementsAre("wheels0: drives turn and accelerate opposite to the IMU: sign of all "
                          "drives"));
}

TEST(Plausibility, NamesTheLeftAndTheRightOfASkidSteerThatAreExchanged) {
  EXPECT_THAT(
      found(robot("viwo_skid_steer"),
            {.wheels =
                 [](EncoderSample& s) { std::swap(s.drive_rad_per_s[0], s.drive_rad_per_s[1]); }}),
      ElementsAre("wheels0: turn opposite to the IMU, and accelerate with it: drives on the left "
                  "and on the right are exchanged"));
}

TEST(Plausibility, NamesDrivesInOtherUnits) {
  EXPECT_THAT(
      found({.wheels = [](EncoderSample& s) { scale_drives(s, 30. / std::numbers::pi); }}),
      ElementsAre("wheels0: turn 9.55 times as fast as the gyro: drives are in revolutions per "
                  "minute"));
  EXPECT_THAT(found({.wheels = [](EncoderSample& s) { scale_drives(s, 180. / std::numbers::pi); }}),
              ElementsAre("wheels0: turn 57.3 times as fast as the gyro: drives are in deg/s"));
  EXPECT_THAT(
      found({.wheels = [](EncoderSample& s) { scale_drives(s, 0.5 / std::numbers::pi); }}),
      ElementsAre("wheels0: turn 0.159 times as fast as the gyro: drives are in revolutions per "
                  "second"));
}

TEST(Plausibility, NamesAScaleThatIsOffWithoutACause) {
  EXPECT_THAT(found({.wheels = [](EncoderSample& s) { scale_drives(s, 2.); }}),
              ElementsAre("imu0: the gyro turns 0.5 times as fast as the wheels (correlation "
                          "1): unit or scale of the drives, radii and track of the kinematics, "
                          "or scale of the gyro"));
  // Where radii are hardly known that is no contradiction.
  const RunSetup hardly_known = robot("viwo_swerve", {"kinematics.prior_sigma_radius_m=0.01"});
  EXPECT_THAT(found(hardly_known, {.wheels = [](EncoderSample& s) { scale_drives(s, 2.); }}),
              IsEmpty());
}

TEST(Plausibility, NamesOneDriveThatIsReversed) {
  EXPECT_THAT(
      found({.wheels = [](EncoderSample& s) { s.drive_rad_per_s[1] *= -1.; }}),
      ElementsAre("wheels0: drive_2 turns opposite to what the other wheels say: its sign"));
}

TEST(Plausibility, NamesTwoDrivesThatAreExchanged) {
  EXPECT_THAT(
      found({.wheels =
                 [](EncoderSample& s) { std::swap(s.drive_rad_per_s[0], s.drive_rad_per_s[2]); }}),
      ElementsAre("wheels0: drives contradict each other, and do not with drive_1 and "
                  "drive_3 exchanged: their order"));
}

TEST(Plausibility, NamesSteeringAnglesInDegrees) {
  EXPECT_THAT(
      found({.wheels =
                 [](EncoderSample& s) {
                   for (double& angle : s.steer_rad) angle *= 180. / std::numbers::pi;
                 }}),
      ElementsAre("wheels0: wheels contradict each other, and do not if the steering angles are "
                  "in degrees"));
}

TEST(Plausibility, NamesSteeringAnglesThatAreReversed) {
  EXPECT_THAT(found({.wheels =
                         [](EncoderSample& s) {
                           for (double& angle : s.steer_rad) angle *= -1.;
                         }}),
              ElementsAre("wheels0: wheels contradict each other, and do not with all steering "
                          "angles reversed: their sign, or left and right of the wheels are "
                          "exchanged"));
}

/// Two wheels cannot contradict each other.
TEST(Plausibility, NamesADriveThatOnlyTheGyroKnowsIsReversed) {
  const auto found_with = [](double left, double right) {
    return found(robot("viwo_skid_steer"), {.wheels = [=](EncoderSample& wheels) {
                   wheels.drive_rad_per_s[0] *= left;
                   wheels.drive_rad_per_s[1] *= right;
                 }});
  };
  EXPECT_THAT(found_with(1., -1.), ElementsAre(AllOf(HasSubstr("drive_2 turns opposite"),
                                                     HasSubstr("variance of the gyro's rate"))));
  EXPECT_THAT(found_with(-1., 1.), ElementsAre(HasSubstr("drive_1 turns opposite")));
  // That may be the gyro's sign as well.
  EXPECT_THAT(found_with(-1., -1.), ElementsAre(HasSubstr("sign of all drives")));
}

// One of two drives, of which nothing else of the wheels knows.
TEST(Plausibility, NamesAWheelThatSlippedForAWhile) {
  const auto slips_for = [](double slip_s, double factor) {
    return found(robot("viwo_skid_steer"), {.wheels = [=](EncoderSample& s) {
                   const double t_s = 1e-9 * static_cast<double>(s.t_ns);
                   if (t_s > 12. && t_s < 12. + slip_s) s.drive_rad_per_s[0] *= factor;
                 }});
  };
  EXPECT_THAT(slips_for(3., 1.5),
              ElementsAre(AllOf(HasSubstr("wheels0: turns otherwise than imu0 for "),
                                HasSubstr(" rad in all"), HasSubstr("slipped"))));
  EXPECT_THAT(slips_for(3., 1.), IsEmpty());
  EXPECT_THAT(slips_for(20., 1.5), ::testing::Not(Contains(HasSubstr("slipped"))));
}

// A counter that runs over.
TEST(Plausibility, NamesSpeedsThatNoBaseHas) {
  const auto texts = found(robot("viwo_skid_steer"), {.wheels = [k = 0](EncoderSample& s) mutable {
                             if (++k == 500) s.drive_rad_per_s[1] -= 1e4;
                           }});
  EXPECT_THAT(texts, ElementsAre(HasSubstr("wheels0: 1 sample says that the base goes ")));
}

TEST(FindSlip, TellsWhenHowLongAndByHowMuch) {
  std::vector<TurnWindow> windows;
  for (int i = 0; i < 100; ++i) {
    const double rate = std::sin(0.1 * i);
    // Another width of the base, and a bias.
    TurnWindow window{i * to_ns(kTurnWindow_s), 1.3 * rate + 0.02, rate, 0.5};
    if (i >= 60 && i < 64) window.wheels += 0.8;
    windows.push_back(window);
  }
  const auto slip = find_slip(windows);
  ASSERT_TRUE(slip);
  EXPECT_EQ(slip->from_ns, 60 * to_ns(kTurnWindow_s));
  EXPECT_EQ(slip->length_s, 2.);
  EXPECT_NEAR(slip->turn_rad, -1.3 * 0.8 * 2., 0.05);
  EXPECT_TRUE(slip->is_fault());
  // With a hole in the middle it is two that are shorter.
  windows.erase(windows.begin() + 62);
  const auto shorter = find_slip(windows);
  ASSERT_TRUE(shorter);
  EXPECT_EQ(shorter->length_s, 1.);
  EXPECT_FALSE(find_slip(std::span(windows).first(39)));
}

// What lasts is no slip. One of two drives has other counts than the other, or is not read: the
// faster the base goes, the more it turns by the wheels.
TEST(FindDisagreement, TellsHowMuchOfTheTimeAndByHowMuch) {
  const auto found_with = [](double by_speed, std::size_t from) {
    std::vector<TurnWindow> windows;
    for (std::size_t i = 0; i < 100; ++i) {
      const double rate = 0.4 * std::sin(0.1 * static_cast<double>(i)), speed = 0.5;
      const double off = i >= from ? by_speed * speed : 0.;
      windows.push_back({static_cast<std::int64_t>(i) * to_ns(kTurnWindow_s), 1.1 * rate + 0.02,
                         rate + off, speed});
    }
    return find_disagreement(windows, 0.15);
  };
  const auto all = found_with(1., 0);
  ASSERT_TRUE(all);
  // A bias and a factor take a part of it.
  EXPECT_GT(all->part, 0.5);
  EXPECT_GT(all->median_rad_per_s, 0.2);
  EXPECT_LT(all->median_rad_per_s, 0.5);
  const auto half = found_with(1., 50);
  ASSERT_TRUE(half);
  EXPECT_NEAR(half->part, 0.5, 0.2);
  EXPECT_FALSE(found_with(1., 70));  // slip, perhaps
  EXPECT_FALSE(found_with(0., 0));   // another width, and a bias
}

// Wheels that are late by a window turn as the gyro does.
TEST(FindDisagreement, IsNoLag) {
  std::vector<TurnWindow> windows;
  const auto rate = [](int i) { return 1.2 * std::sin(0.9 * i); };
  for (int i = 0; i < 100; ++i) {
    windows.push_back({i * to_ns(kTurnWindow_s), rate(i), rate(i - 1), 0.5});
  }
  EXPECT_FALSE(find_disagreement(windows, 0.15));
  for (TurnWindow& window : windows) window.wheels *= -1.;
  EXPECT_TRUE(find_disagreement(windows, 0.15));
  // Quick turns are near to something a window later, each to something else.
  for (int i = 0; i < 100; ++i) {
    TurnWindow& window = windows[static_cast<std::size_t>(i)];
    window.gyro = 0.8 * std::sin(0.36 * i);
    window.wheels = 0.4 * std::sin(0.36 * i) + 0.3 * std::sin(0.44 * i + 2.);
  }
  EXPECT_TRUE(find_disagreement(windows, 0.15));
}

TEST(Plausibility, NamesWheelsThatHaveLittleInCommonWithTheGyro) {
  const auto with = [](double factor) {
    return found(robot("viwo_skid_steer", {"placeholders.motion=figure_eight"}),
                 {.wheels = [=](EncoderSample& s) {
                   for (int i = 0; i < s.n_drive; i += 2) {
                     s.drive_rad_per_s[static_cast<std::size_t>(i)] *= factor;
                   }
                 }});
  };
  EXPECT_THAT(with(0.), Contains(HasSubstr("turn otherwise than imu0 for ")));
  EXPECT_THAT(with(1.), IsEmpty());
}

TEST(Plausibility, NamesTheLagOfTheWheels) {
  const auto late_by = [](std::int64_t late_ns, double shaken_rad_per_s) {
    return found({.imu =
                      [&](ImuSample& s) {
                        const double t_s = 1e-9 * static_cast<double>(s.t_ns);
                        s.gyro_rad_per_s[2] += shaken_rad_per_s * std::sin(50. * t_s);
                      },
                  .wheels =
                      [&](EncoderSample& s) {
                        for (std::int64_t* t_ns : {&s.t_ns, &s.begin_ns, &s.end_ns}) {
                          *t_ns += late_ns;
                        }
                      }});
  };
  EXPECT_THAT(late_by(100'000'000, 0.),
              ElementsAre(::testing::MatchesRegex(
                  "wheels0: lags behind imu0 by (9[0-9]|10[0-9]) ms, beside the 5 ms of t_OtoI_s "
                  "\\(\\+- 10 ms\\) - wheels\\.t_OtoI_s: -0\\.(09[0-9]*|08[0-9]|1[0-9]*)")));
  // So late that the two rates are hardly alike, on a base that shakes.
  EXPECT_THAT(late_by(400'000'000, 0.1),
              ElementsAre(::testing::MatchesRegex(
                  "wheels0: lags behind imu0 by (39[0-9]|40[0-9]) ms, beside the 5 ms of "
                  "t_OtoI_s \\(\\+- 10 ms\\) - wheels\\.t_OtoI_s: -0\\.(39[0-9]*|4)")));
}

TEST(Plausibility, NamesStampsOfAnotherUnit) {
  const auto found_with = [](std::int64_t times) {
    return found({.wheels = [times](EncoderSample& wheels) {
      wheels.t_ns *= times;
      wheels.begin_ns *= times;
      wheels.end_ns *= times;
    }});
  };
  EXPECT_THAT(found_with(1000),
              Contains(HasSubstr("wheels0: a sample every 10 s: its stamps are of another unit")));
}

TEST(Plausibility, NamesNoLagOfAClockThatWasSetOnTheWay) {
  const auto set_by = [](std::int64_t step_ns) {
    return found({.imu = [step_ns](ImuSample& s) {
      if (s.t_ns > 15'000'000'000) s.t_ns += step_ns;
    }});
  };
  EXPECT_THAT(set_by(-1'000'000'000), IsEmpty());
  EXPECT_THAT(set_by(1'000'000'000),
              ElementsAre("imu0: no samples for 1 s from t = 15.000 s: look at its cable, driver, "
                          "bus and clock, or at what has recorded it"));
}

TEST(Plausibility, NamesTheSensorWhoseClockIsAnother) {
  constexpr std::int64_t kYearsNs = 1'700'000'000'000'000'000;
  const auto later = [](auto& sample) {
    sample.t_ns += kYearsNs;
    if constexpr (requires { sample.begin_ns; }) {
      sample.begin_ns += kYearsNs;
      sample.end_ns += kYearsNs;
    }
  };
  const std::string cause =
      " those of the IMU: of another clock, or of another recording - none of its samples can be "
      "used";
  EXPECT_THAT(found({.wheels = later}),
              ElementsAre("wheels0: its stamps are 1.7e+09 s ahead of" + cause));
  EXPECT_THAT(found({.images = later}),
              ElementsAre("images0: its stamps are 1.7e+09 s ahead of" + cause));
  EXPECT_THAT(found({.imu = later}),
              ::testing::IsSupersetOf({"wheels0: its stamps are 1.7e+09 s behind" + cause,
                                       "images0: its stamps are 1.7e+09 s behind" + cause}));
}

TEST(Plausibility, NamesStampsThatAreNotInNanoseconds) {
  EXPECT_THAT(
      found({.imu = [](ImuSample& s) { s.t_ns /= 1000; }}),
      ::testing::Contains(HasSubstr("imu0: a sample every 5e-06 s: its stamps are of another "
                                    "unit")));
}

}  // namespace
}  // namespace viwo

// Wheels that contradict each other while the base goes straight on, its steering at rest.
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "encoder_check.hpp"
#include "simulated.hpp"

namespace viwo {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// What is found of ten seconds along `angle_rad` of a base with four steered wheels, with a fault.
Findings driven(double angle_rad, const std::function<void(EncoderSample&)>& fault) {
  const RunSetup setup = read_run(testing::simulated("circle"), testing::registry());
  EncoderCheck check({"wheels0", "wheels0"}, wheels_alone(setup));
  std::mt19937_64 engine(1);
  std::normal_distribution<double> noise(0., 0.02);
  for (std::int64_t k = 0; k < 1000; ++k) {
    EncoderSample sample;
    sample.begin_ns = 10'000'000 * k;
    sample.t_ns = sample.end_ns = sample.begin_ns + 10'000'000;
    sample.n_drive = sample.n_steer = 4;
    const double rate = 10. + 3. * std::sin(0.01 * static_cast<double>(k));
    for (std::size_t i = 0; i < 4; ++i) {
      sample.drive_rad_per_s[i] = rate + noise(engine);
      sample.steer_rad[i] = angle_rad + 0.1 * noise(engine);
    }
    fault(sample);
    check.add(sample);
  }
  Findings findings;
  check.findings(0, findings);
  return findings;
}

std::vector<std::string> texts(const Findings& findings) {
  std::vector<std::string> texts;
  for (const Finding& finding : findings) texts.push_back(finding.text);
  return texts;
}

constexpr double kCrab_rad = std::numbers::pi / 5.;

TEST(EncoderCheck, FindsNothingInWheelsThatAgree) {
  EXPECT_THAT(driven(0., [](EncoderSample&) {}), IsEmpty());
  EXPECT_THAT(driven(kCrab_rad, [](EncoderSample&) {}), IsEmpty());
}

/// No angles at all would fit as well: that is no reason to say nothing.
TEST(EncoderCheck, NamesASteeringThatIsReversedThoughItStays) {
  EXPECT_THAT(
      texts(driven(kCrab_rad, [](EncoderSample& s) { s.steer_rad[1] *= -1.; })),
      ElementsAre("wheels0: steer_2 turns opposite to what the other wheels say: its sign"));
}

TEST(EncoderCheck, DoesNotTakeAnglesForDegreesWhereNoneFitAsWell) {
  EXPECT_THAT(texts(driven(kCrab_rad,
                           [k = 0](EncoderSample& s) mutable {
                             s.steer_rad[2] = 2. * std::sin(0.01 * ++k);  // whatever it is
                           })),
              ElementsAre(HasSubstr("contradict each other grossly")));
}

/// With 0.1 rad/s and more of a sample the wheels of a base that stands seem to turn, each by
/// itself.
TEST(EncoderCheck, TakesNoNoiseForDrivingThatContradictsItself) {
  for (const double speed : {0., 0.5}) {  // rad/s
    std::mt19937_64 engine(2);
    std::normal_distribution<double> noise(0., 0.3);
    EXPECT_THAT(driven(0.,
                       [&](EncoderSample& s) {
                         for (std::size_t i = 0; i < 4; ++i) {
                           s.drive_rad_per_s[i] = speed + noise(engine);
                         }
                       }),
                IsEmpty())
        << speed;
  }
}

/// A count or none in a sample, by chance in others of each wheel.
TEST(EncoderCheck, TakesNoStepsOfACounterForContradictions) {
  constexpr double kCount_rad = 2. * std::numbers::pi / 1320., kRate_rad_per_s = 0.2, kDt_s = 0.01;
  std::array<std::int64_t, 4> before{};
  EXPECT_THAT(driven(0.,
                     [&, k = 0](EncoderSample& s) mutable {
                       ++k;
                       for (std::size_t i = 0; i < 4; ++i) {
                         const double angle_rad = kRate_rad_per_s * kDt_s * k + 0.001 * double(i);
                         const auto count = std::llround(angle_rad / kCount_rad);
                         s.drive_rad_per_s[i] =
                             kCount_rad / kDt_s * static_cast<double>(count - before[i]);
                         before[i] = count;
                       }
                     }),
              IsEmpty());
}

TEST(EncoderCheck, DoubtsWheelsOfWhichOneIsNotReadHoweverSlowTheyAre) {
  for (const double slower : {1., 0.1}) {
    const auto findings = [slower](std::int64_t from) {
      return driven(0., [slower, from, k = std::int64_t{0}](EncoderSample& s) mutable {
        for (std::size_t i = 0; i < 4; ++i) s.drive_rad_per_s[i] *= slower;
        if (++k > from) s.drive_rad_per_s[2] = 0.;
      });
    };
    for (const std::int64_t from : {0, 200}) {
      ASSERT_EQ(findings(from).size(), 1U) << slower;
      EXPECT_THAT(findings(from)[0].text, HasSubstr("contradict each other grossly"));
      EXPECT_TRUE(findings(from)[0].is_doubt);
    }
    EXPECT_THAT(findings(500), IsEmpty());  // for a while, as wheels that slip
  }
}

TEST(EncoderCheck, NamesASteeringThatIsReversedOnASlowBase) {
  EXPECT_THAT(texts(driven(kCrab_rad,
                           [](EncoderSample& s) {
                             for (std::size_t i = 0; i < 4; ++i) s.drive_rad_per_s[i] *= 0.05;
                             s.steer_rad[1] *= -1.;
                           })),
              ElementsAre(HasSubstr("steer_2 turns opposite")));
}

TEST(EncoderCheck, TellsTheUnitOfTheSteeringFromWhatItHasBeenTakenFor) {
  const Intrinsics x_WI = read_run(testing::simulated("circle"), testing::registry()).x_WI;
  constexpr double kDegree = std::numbers::pi / 180., kTurn = 2. * std::numbers::pi;
  const auto found = [&x_WI](double scale) {
    return driven(0., [&x_WI, scale, k = 0](EncoderSample& s) mutable {
      const double omega = 0.6 * std::sin(0.01 * ++k);
      for (Eigen::Index i = 0; i < 4; ++i) {  // r_1 .., x_1 .., y_1 ..
        const Eigen::Vector2d v(0.5 - omega * x_WI[8 + i], omega * x_WI[4 + i]);
        const auto wheel = static_cast<std::size_t>(i);
        s.drive_rad_per_s[wheel] = v.norm() / x_WI[i];
        s.steer_rad[wheel] = scale * std::atan2(v.y(), v.x());
      }
    });
  };
  EXPECT_THAT(found(1.), IsEmpty());
  const Findings degrees = found(kTurn);
  ASSERT_THAT(texts(degrees), ElementsAre(HasSubstr("in radians, and are taken for turns")));
  EXPECT_THAT(degrees[0].remedies.at(0).value, HasSubstr("[0.15915494"));
  EXPECT_THAT(texts(found(1. / kTurn)), ElementsAre(EndsWith("in turns")));
  EXPECT_THAT(texts(found(360.)), ElementsAre(HasSubstr("in degrees, and are taken for turns")));
  EXPECT_THAT(texts(found(1. / kDegree)), ElementsAre(EndsWith("in degrees")));
}

TEST(EncoderCheck, NamesADriveWithAnotherGear) {
  const Findings twice = driven(0., [](EncoderSample& s) { s.drive_rad_per_s[3] *= 2.; });
  ASSERT_THAT(texts(twice), ElementsAre(HasSubstr("drive_4 turns 2 times as fast")));
  EXPECT_EQ(twice[0].remedies.at(0).value, "[1, 1, 1, 0.5]");
  const Findings half = driven(0., [](EncoderSample& s) { s.drive_rad_per_s[0] *= 0.5; });
  ASSERT_THAT(texts(half), ElementsAre(HasSubstr("drive_1 turns 0.5 times as fast")));
  EXPECT_EQ(half[0].remedies.at(0).key, "sensors.wheels0.drive_scale");
  EXPECT_EQ(half[0].remedies.at(0).value, "[2, 1, 1, 1]");
}

}  // namespace
}  // namespace viwo

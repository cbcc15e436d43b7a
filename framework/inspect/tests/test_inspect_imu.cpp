// Faults of stamps and of the IMU, put into simulated recordings.
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "inspected.hpp"
#include "viwo/config/overrides.hpp"

namespace viwo::inspect {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::int64_t kSecond = 1'000'000'000;

/// A robot that stands still.
RunSetup standing(double duration_s) {
  return simulated("viwo_swerve",
                   {"placeholders.motion=straight", "sensors.simulator0.speed_m_per_s=0",
                    "sensors.simulator0.ground=flat", "updates.visual_features.enabled=false",
                    "sensors.simulator0.features=0",
                    "sensors.simulator0.duration_s=" + std::to_string(duration_s)});
}

TEST(InspectStamps, TellsRateAndGapsAndWhatTheFilterCannotDoWithout) {
  const Inspection clean = inspected(swerve(), {});
  EXPECT_THAT(faults_of(clean), IsEmpty());
  const Finding stamps = finding_of(clean, "imu0", "stamps");
  EXPECT_NEAR(figure_of(stamps, "rate"), 200., 0.01);
  EXPECT_EQ(figure_of(stamps, "gaps"), 0.);
  const Inspection gap =
      inspected(swerve(), {.imu = [](ImuSample& s) {
                  return s.t_ns < 10 * kSecond || s.t_ns > 10 * kSecond + kSecond / 10;
                }});
  EXPECT_THAT(faults_of(gap), ElementsAre("imu0 stamps"));
  EXPECT_EQ(figure_of(finding_of(gap, "imu0", "stamps"), "missing samples"), 21.);
  EXPECT_NEAR(figure_of(finding_of(gap, "imu0", "stamps"), "longest interval"), 0.11, 1e-9);
  // Wheels may well be without for as long.
  const Inspection of_wheels =
      inspected(swerve(), {.wheels = [](EncoderSample& s) {
                  return s.t_ns < 10 * kSecond || s.t_ns > 10 * kSecond + kSecond / 10;
                }});
  EXPECT_THAT(faults_of(of_wheels), IsEmpty());
  EXPECT_EQ(finding_of(of_wheels, "wheels0", "stamps").severity, Severity::kNote);
}

TEST(InspectStamps, TellsJitter) {
  EXPECT_EQ(finding_of(inspected(swerve(), {}), "imu0", "jitter").what, "");
  std::mt19937 random(1);
  const Inspection shaken = inspected(swerve(), {.imu = [&random](ImuSample& s) {
                                        s.t_ns += static_cast<std::int64_t>(random() % 4'000'000);
                                        return true;
                                      }});
  const Finding jitter = finding_of(shaken, "imu0", "jitter");
  EXPECT_EQ(jitter.severity, Severity::kNote);
  EXPECT_NEAR(figure_of(jitter, "jitter"), 7e-3, 1e-3);  // of the triangle of two such
}

TEST(InspectStamps, TellsSamplesThatAreMissingFromJitter) {
  int i = 0;
  std::mt19937 random(1);
  int dropped = 0;
  const Inspection thinned = inspected(swerve(), {.imu = [&](ImuSample&) {
                                         const bool is_kept = ++i < 10 || random() % 10 > 0;
                                         if (!is_kept) ++dropped;
                                         return is_kept;
                                       }});
  EXPECT_EQ(finding_of(thinned, "imu0", "jitter").what, "");
  // But for those after the last.
  EXPECT_NEAR(figure_of(finding_of(thinned, "imu0", "stamps"), "missing samples"), dropped, 3.);
  EXPECT_NEAR(figure_of(finding_of(thinned, "imu0", "stamps"), "rate"), 200., 0.01);
}

TEST(InspectStamps, TellsWhatNothingTakes) {
  RunSetup run = changed(swerve(), {});
  EXPECT_EQ(finding_of(inspect(run), "wheels0", "unused").what, "");
  // A run of camera and IMU, whose recording has wheels, too.
  RunSetup without = changed(swerve(), {});
  without.filter->wheels.clear();
  const Finding unused = finding_of(inspect(without), "wheels0", "unused");
  EXPECT_EQ(unused.severity, Severity::kNote);
  EXPECT_THAT(unused.what, HasSubstr("no wheels take it"));
}

TEST(InspectStamps, TellsSensorsThatHaveLittleTimeInCommon) {
  const auto later = [](StateSample& s) { return s.t_ns > 37 * kSecond; };
  const auto sooner = [](FeatureSample& s) { return s.t_ns < 38 * kSecond; };
  EXPECT_THAT(faults_of(inspected(swerve(), {.states = later})), IsEmpty());
  const Inspection few = inspected(swerve(), {.images = sooner, .states = later});
  EXPECT_THAT(faults_of(few), Contains("recording overlap"));
}

TEST(InspectStamps, TellsASensorThatEndsEarly) {
  const auto until = [](std::int64_t end_s) {
    return inspected(swerve(),
                     {.wheels = [=](EncoderSample& s) { return s.t_ns < end_s * kSecond; }});
  };
  EXPECT_EQ(finding_of(until(25), "recording", "overlap").severity, Severity::kNote);
  const Inspection early = until(6);
  EXPECT_THAT(faults_of(early), Contains("recording overlap"));
  EXPECT_THAT(finding_of(early, "recording", "overlap").what, HasSubstr("wheels0 ends first"));
}

TEST(InspectStamps, TellsIntervalsThatNoRunTakes) {
  RunSetup slow = setup_of(testing::configuration("runs/simulated_swerve.yaml"));
  std::int64_t last_ns = -kSecond;
  const Inspection reference = inspected(std::move(slow), {.poses = [&last_ns](PoseSample& s) {
                                           if (s.t_ns - last_ns < 8 * kSecond / 10) return false;
                                           last_ns = s.t_ns;
                                           return true;
                                         }});
  EXPECT_THAT(faults_of(reference), ElementsAre("poses0 stamps"));
  EXPECT_EQ(remedy_of(finding_of(reference, "poses0", "stamps"), "evaluation.reference_max_gap_s"),
            "2");
  const auto times = [](std::int64_t factor, std::int64_t by) {
    RunSetup setup = simulated("viwo_skid_steer", {"sensors.simulator0.duration_s=10"});
    config::set_path(setup.resolved, "sensors.wheels0",
                     config::parse("{max_gap_s: 0.5}", "resolved"));
    return inspected(std::move(setup), {.wheels = [factor, by](EncoderSample& s) {
                       for (std::int64_t* t_ns : {&s.t_ns, &s.begin_ns, &s.end_ns}) {
                         *t_ns = *t_ns * factor / by;
                       }
                       return true;
                     }});
  };
  EXPECT_THAT(finding_of(times(1000, 1), "wheels0", "stamps").what,
              HasSubstr("takes each interval of"));
  EXPECT_THAT(finding_of(times(1, 1000), "wheels0", "stamps").what,
              HasSubstr("no sensor of a robot gives a sample every"));
}

// What begins first may begin with a stamp that is none.
TEST(InspectStamps, DoesNotTakeOneStampForTheTimeOfTheRecording) {
  bool is_first = true;
  const Inspection stray = inspected(swerve(), {.wheels = [&is_first](EncoderSample& s) {
                                       if (is_first) s.t_ns = s.begin_ns = s.end_ns = -5 * kSecond;
                                       is_first = false;
                                       return true;
                                     }});
  EXPECT_THAT(faults_of(stray), IsEmpty());
  EXPECT_GT(figure_of(finding_of(stray, "wheels0", "stamps"), "longest interval"), 5.);
}

/// Damaged in the middle: once, and for good.
class Damaged : public testing::InMemory {
 public:
  using InMemory::InMemory;
  void rejections(std::vector<RejectionCount>& out) const override {
    out.push_back({"bytes that are no record: the rest is not read", 1, "byte 77"});
  }
};

TEST(InspectStamps, TellsOfDamageBehindWhichNothingIsRead) {
  RunSetup setup = changed(swerve(), {});
  std::vector<Measurement> samples;
  for (SensorEntry& entry : setup.sensors) {
    if (entry.name != "wheels0") continue;
    for (Measurement m; entry.sensor.object->next(m) == Status::kOk;) samples.push_back(m);
    entry.sensor.object =
        std::make_shared<Damaged>(SampleTypes{&sample_type<EncoderSample>()}, samples);
  }
  EXPECT_THAT(faults_of(inspect(setup)), ElementsAre("wheels0 rejected"));
}

/// Ends with a fault, and had some samples rejected.
class Poor : public testing::InMemory {
 public:
  using InMemory::InMemory;
  Status next(Measurement& out) override {
    const Status status = InMemory::next(out);
    if (status == Status::kEnd) throw InputError("data.csv:77  not a number: '12.x4'");
    return status;
  }
  void rejections(std::vector<RejectionCount>& out) const override {
    out.push_back({"stamp not after the previous one", 40, "data.csv:5"});
  }
};

TEST(InspectStamps, TellsWhatAReaderHasRejectedAndWhereItBrokeOff) {
  RunSetup setup = simulated("viwo_swerve", {"updates.visual_features.enabled=false"});
  std::vector<Measurement> samples, of_imu;
  for (Measurement m; setup.sensors.front().sensor.object->next(m) == Status::kOk;) {
    if (m.get_if<ImuSample>() != nullptr) of_imu.push_back(m);
    if (m.get_if<EncoderSample>() != nullptr) samples.push_back(m);
  }
  samples.resize(samples.size() / 2);
  testing::set_sensors(
      setup,
      {{"imu0",
        std::make_shared<testing::InMemory>(SampleTypes{&sample_type<ImuSample>()}, of_imu)},
       {"wheels0", std::make_shared<Poor>(SampleTypes{&sample_type<EncoderSample>()}, samples)}});
  const Inspection inspection = inspect(setup);
  EXPECT_THAT(faults_of(inspection), Contains("wheels0 rejected"));
  EXPECT_THAT(finding_of(inspection, "wheels0", "rejected").what,
              HasSubstr("40 samples are not used: stamp not after the previous one"));
  EXPECT_THAT(finding_of(inspection, "wheels0", "readable").what, HasSubstr("'12.x4'"));
}

TEST(InspectImu, ThatIsNotReadIsSaidSoWhereWheelsTurnTheBase) {
  const auto held = [](RunSetup setup) {
    const ImuSample first{.accel_m_per_s2 = {0.1, 0.2, 9.8}};
    return inspected(std::move(setup), {.imu = [=](ImuSample& s) {
                       s.gyro_rad_per_s = first.gyro_rad_per_s;
                       s.accel_m_per_s2 = first.accel_m_per_s2;
                       return true;
                     }});
  };
  for (const char* robot : {"viwo_swerve", "viwo_ackermann", "viwo_skid_steer"}) {
    const Inspection unread = held(simulated(robot, {"sensors.simulator0.duration_s=20"}));
    EXPECT_THAT(finding_of(unread, "imu0", "channel").what, HasSubstr("it is not read")) << robot;
  }
  EXPECT_THAT(faults_of(held(simulated("viwo_ackermann", {"placeholders.motion=straight"}))),
              ::testing::Not(Contains("imu0 channel")));
}

TEST(InspectImu, TellsGravityAtRest) {
  const Inspection clean = inspected(standing(10.), {});
  EXPECT_THAT(faults_of(clean), IsEmpty());
  const Finding gravity = finding_of(clean, "imu0", "gravity");
  EXPECT_NEAR(figure_of(gravity, "gravity"), 9.81, 0.06);  // with a bias of 0.02 per axis
  EXPECT_NEAR(figure_of(gravity, "up, z"), 1., 1e-3);
  const auto scaled = [](double factor) {
    return inspected(standing(10.), {.imu = [factor](ImuSample& s) {
                       scale(s.accel_m_per_s2, factor);
                       return true;
                     }});
  };
  const Inspection off = scaled(1.03);
  EXPECT_THAT(faults_of(off), ElementsAre("imu0 gravity"));
  EXPECT_NEAR(std::stod(remedy_of(finding_of(off, "imu0", "gravity"),
                                  "estimator.sigma_start_accel_bias_m_per_s2")),
              0.5 * 0.03 * 9.81, 0.04);
  EXPECT_THAT(faults_of(scaled(1. / 9.80665)), Contains("imu0 gravity"));
}

TEST(InspectImu, WritesGravityWhereThatOfThePlaceIsAnother) {
  RunSetup setup = simulated(
      "viwo_swerve",
      {"placeholders.motion=straight", "sensors.simulator0.speed_m_per_s=0",
       "updates.visual_features.enabled=false", "sensors.simulator0.features=0",
       "sensors.simulator0.duration_s=10", "sensors.simulator0.ground=flat",
       "sensors.simulator0.sigma_accel_bias_m_per_s2=0", "estimator.gravity_m_per_s2=9.83",
       "estimator.sigma_start_accel_bias_m_per_s2=0.002"});
  const Finding gravity = finding_of(inspect(setup), "imu of simulator0", "gravity");
  EXPECT_EQ(gravity.severity, Severity::kFault) << gravity.what;
  EXPECT_NEAR(std::stod("0" + remedy_of(gravity, "estimator.gravity_m_per_s2")), 9.81, 0.005);
}

TEST(InspectImu, TellsABiasOfTheGyroBeyondItsPrior) {
  const Inspection off = inspected(standing(10.), {.imu = [](ImuSample& s) {
                                     s.gyro_rad_per_s[1] += 0.1;
                                     return true;
                                   }});
  EXPECT_THAT(faults_of(off), ElementsAre("imu0 gyro bias"));
  EXPECT_NEAR(std::stod(remedy_of(finding_of(off, "imu0", "gyro bias"),
                                  "estimator.sigma_start_gyro_bias_rad_per_s")),
              0.05, 0.01);
}

TEST(InspectImu, TellsChannelsThatNeverChangeAndThatAreReadTwice) {
  EXPECT_THAT(faults_of(inspected(swerve(), {.imu =
                                                 [](ImuSample& s) {
                                                   s.gyro_rad_per_s[0] = 0.;
                                                   return true;
                                                 }})),
              ElementsAre("imu0 channel"));
  const Inspection twice = inspected(swerve(), {.imu = [](ImuSample& s) {
                                       s.accel_m_per_s2[1] = s.accel_m_per_s2[0];
                                       return true;
                                     }});
  EXPECT_THAT(finding_of(twice, "imu0", "channel").what,
              HasSubstr("accelerometer's y and the accelerometer's x are the same number"));
}

TEST(InspectImu, FindsTheGyroInDegreesByTheWheels) {
  EXPECT_THAT(faults_of(inspected(swerve(), {.imu =
                                                 [](ImuSample& s) {
                                                   scale(s.gyro_rad_per_s, 180. / std::numbers::pi);
                                                   return true;
                                                 }})),
              Contains("imu0 rate"));
}

TEST(InspectImu, FindsTheGyroInDegreesOrReversedByTheTiltOfTheAccelerometer) {
  if (!std::filesystem::exists(shared_data())) GTEST_SKIP() << shared_data() << " is not there";
  const auto times = [](double factor) {
    return inspected(setup_of(testing::configuration("runs/euroc_board.yaml")),
                     {.imu = [factor](ImuSample& s) {
                       scale(s.gyro_rad_per_s, factor);
                       return true;
                     }});
  };
  const Finding clean = finding_of(times(1.), "imu0", "tilt");
  EXPECT_EQ(clean.severity, Severity::kFits) << clean.what;
  EXPECT_NE(clean.what, "");
  EXPECT_THAT(finding_of(times(180. / std::numbers::pi), "imu0", "tilt").what,
              HasSubstr("it is in deg/s"));
  EXPECT_THAT(finding_of(times(-1.), "imu0", "tilt").what, HasSubstr("(-x, -y, -z)"));
  const Inspection swapped = inspected(setup_of(testing::configuration("runs/euroc_board.yaml")),
                                       {.imu = [](ImuSample& s) {
                                         std::swap(s.gyro_rad_per_s[0], s.gyro_rad_per_s[1]);
                                         return true;
                                       }});
  EXPECT_THAT(finding_of(swapped, "imu0", "tilt").what, HasSubstr("(y, x, z)"));
}

TEST(InspectNoise, TellsWhiteNoiseAndItsRatioToTheConfiguration) {
  const Inspection clean = inspected(standing(20.), {});
  EXPECT_NEAR(figure_of(finding_of(clean, "imu0", "gyro noise"), "found by configured"), 1., 0.25);
  EXPECT_NEAR(figure_of(finding_of(clean, "imu0", "accelerometer noise"), "found by configured"),
              1., 0.25);
  EXPECT_THAT(faults_of(clean), IsEmpty());
  std::mt19937 random(1);
  std::normal_distribution<double> draw(0., 10. * 1.6968e-4 * std::sqrt(200.));
  const Inspection noisy = inspected(standing(20.), {.imu = [&](ImuSample& s) {
                                       for (double& rate : s.gyro_rad_per_s) rate += draw(random);
                                       return true;
                                     }});
  EXPECT_THAT(faults_of(noisy), ElementsAre("imu0 gyro noise"));
  EXPECT_NEAR(std::stod(remedy_of(finding_of(noisy, "imu0", "gyro noise"),
                                  "imu.sigma_gyro_rad_per_s_sqrt_hz")),
              1.7e-3, 0.4e-3);
}

TEST(InspectNoise, TellsTheRandomWalkWhereTheRestIsLongEnoughAndHowLongThatIs) {
  const Finding brief = finding_of(inspected(standing(20.), {}), "imu0", "gyro walk");
  EXPECT_EQ(brief.severity, Severity::kNote);
  // Ten times sqrt(3) N / K.
  EXPECT_NEAR(figure_of(brief, "rest that is needed"), 10. * std::sqrt(3.) * 1.7e-4 / 1.94e-5, 40.);
  const auto walks = [](double times) {
    double bias = 0.;
    std::mt19937 random(2);
    std::normal_distribution<double> draw;
    const double sigma = times * 3e-3 * std::sqrt(0.005);
    return finding_of(inspected(standing(100.), {.imu =
                                                     [&](ImuSample& s) {
                                                       bias += sigma * draw(random);
                                                       s.accel_m_per_s2[0] += bias;
                                                       return true;
                                                     }}),
                      "imu0", "accelerometer walk");
  };
  EXPECT_EQ(walks(0.).severity, Severity::kFits) << walks(0.).what;
  const Finding worse = walks(10.);
  EXPECT_EQ(worse.severity, Severity::kFault) << worse.what;
  EXPECT_NEAR(std::stod("0" + remedy_of(worse, "imu.sigma_accel_walk_m_per_s3_sqrt_hz")), 0.03,
              0.015);
}

}  // namespace
}  // namespace viwo::inspect

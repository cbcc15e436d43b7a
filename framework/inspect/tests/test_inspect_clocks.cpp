// Clocks and axes of wheels, cameras and poses against the gyro.
#include <cmath>
#include <cstdint>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "inspected.hpp"
#include "viwo/math/arrays.hpp"

namespace viwo::inspect {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using ::testing::Not;

template <class T>
void shift(T& sample, double seconds) {
  const auto ns = static_cast<std::int64_t>(std::llround(1e9 * seconds));
  sample.t_ns += ns;
  if constexpr (requires { sample.begin_ns; }) {
    sample.begin_ns += ns;
    sample.end_ns += ns;
  }
}

TEST(InspectClocks, FindsTheLagOfTheWheelsAndWritesTheClock) {
  const Finding clean = finding_of(inspected(swerve(), {}), "wheels0", "clock");
  EXPECT_EQ(clean.severity, Severity::kFits) << clean.what;
  EXPECT_NEAR(figure_of(clean, "lag"), 0., 2e-3);
  for (const double late_s : {0.06, -0.3}) {
    const Inspection late = inspected(swerve(), {.wheels = [late_s](EncoderSample& s) {
                                        shift(s, late_s);
                                        return true;
                                      }});
    EXPECT_THAT(faults_of(late), ElementsAre("wheels0 clock"));
    EXPECT_NEAR(std::stod(remedy_of(finding_of(late, "wheels0", "clock"), "wheels.t_OtoI_s")),
                0.005 - late_s, 2e-3);
  }
}

TEST(InspectClocks, FindsWheelsThatAreSecondsLate) {
  for (const double late_s : {1.2, -4.}) {
    const Inspection late = inspected(swerve(), {.wheels = [late_s](EncoderSample& s) {
                                        shift(s, late_s);
                                        return true;
                                      }});
    const Finding clock = finding_of(late, "wheels0", "clock");
    EXPECT_EQ(clock.severity, Severity::kFault) << clock.what;
    EXPECT_NEAR(figure_of(clock, "lag"), late_s, 0.06) << clock.what;
    // Later than the filter waits for them.
    const std::string wait = remedy_of(clock, "estimator.max_wait_s");
    ASSERT_EQ(wait.empty(), late_s < 0.) << wait;
    if (late_s > 0.) {
      EXPECT_NEAR(std::stod(wait), late_s + 0.2, 0.06);
    }
  }
}

TEST(InspectClocks, FindsAClockThatWasSet) {
  const Inspection set = inspected(simulated("viwo_ackermann"), {.wheels = [](EncoderSample& s) {
                                     if (s.t_ns > 30'000'000'000) shift(s, 0.5);
                                     return true;
                                   }});
  EXPECT_THAT(faults_of(set), Contains("wheels0 clock"));
  const Finding clock = finding_of(set, "wheels0", "clock");
  EXPECT_THAT(clock.what, HasSubstr("was set"));
  EXPECT_NEAR(figure_of(clock, "change"), 0.5, 0.01);
}

TEST(InspectClocks, FindsAClockThatCountsOtherSeconds) {
  for (const double drift : {0.01, -0.004}) {
    const Inspection found =
        inspected(swerve(), {.wheels = [drift](EncoderSample& s) {
                    for (std::int64_t* stamp : {&s.t_ns, &s.begin_ns, &s.end_ns}) {
                      *stamp += std::llround(drift * static_cast<double>(*stamp - 20'000'000'000));
                    }
                    return true;
                  }});
    const Finding clock = finding_of(found, "wheels0", "clock");
    EXPECT_EQ(clock.severity, Severity::kFault) << clock.what;
    EXPECT_THAT(clock.what, HasSubstr("one of the two counts other seconds"));
    EXPECT_NEAR(figure_of(clock, "drift"), drift, 0.2 * std::abs(drift));
  }
}

TEST(InspectClocks, FindsAGyroWhoseColumnsAreExchangedOnABaseThatStaysLevel) {
  const auto level = [] {
    return simulated("viwo_swerve",
                     {"sensors.simulator0.duration_s=40", "sensors.simulator0.ground=flat"});
  };
  const Inspection exchanged = inspected(level(), {.imu = [](ImuSample& s) {
                                           std::swap(s.gyro_rad_per_s[0], s.gyro_rad_per_s[2]);
                                           return true;
                                         }});
  EXPECT_THAT(faults_of(exchanged), ElementsAre("imu0 columns"));
  EXPECT_THAT(
      finding_of(exchanged, "imu0", "columns").what,
      AllOf(HasSubstr("its +x axis turns as wheels0 does"), HasSubstr("along its +z axis")));
}

class InspectRealCamera : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(shared_data())) GTEST_SKIP() << shared_data() << " is not there";
  }
  static RunSetup board(std::vector<std::string> assignments = {}) {
    return setup_of(testing::configuration("runs/euroc_board.yaml"), std::move(assignments));
  }
};

TEST_F(InspectRealCamera, FindsTheLagOfItsTracks) {
  EXPECT_THAT(faults_of(inspected(board(), {})), IsEmpty());
  const Inspection late = inspected(board(), {.images = [](FeatureSample& s) {
                                      shift(s, 0.06);
                                      return true;
                                    }});
  EXPECT_THAT(faults_of(late), ElementsAre("images0, camera 0 clock", "images0, camera 1 clock"));
  const Finding clock = finding_of(late, "images0, camera 0", "clock");
  EXPECT_NEAR(figure_of(clock, "lag"), 0.06, 0.01);
  EXPECT_NE(remedy_of(clock, "timeshift_cam_imu"), "");
}

TEST_F(InspectRealCamera, FindsAxesThatAreNotThoseOfTheCalibration) {
  // x to the right and y down: an image that is turned by half a turn.
  const Inspection turned = inspected(board(), {.images = [](FeatureSample& s) {
                                        for (FeaturePoint& point : s.points) {
                                          point.u_px = 751. - point.u_px;
                                          point.v_px = 479. - point.v_px;
                                        }
                                        return true;
                                      }});
  EXPECT_THAT(faults_of(turned), Contains("images0, camera 0 axes"));
  EXPECT_NEAR(figure_of(finding_of(turned, "images0, camera 0", "axes"), "angle"), 180., 5.);
}

TEST_F(InspectRealCamera, ComesWithAReferenceWhoseBodyMustBeTheImu) {
  const Inspection turned =
      inspected(board(), {.states = [](StateSample& s) {
                  const Eigen::Quaterniond q =
                      to_quaternion(s.q_ItoG_xyzw) *
                      Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2., Eigen::Vector3d::UnitX()));
                  s.q_ItoG_xyzw = {q.x(), q.y(), q.z(), q.w()};
                  return true;
                }});
  EXPECT_THAT(faults_of(turned), ElementsAre("states0 axes"));
  EXPECT_NEAR(figure_of(finding_of(turned, "states0", "axes"), "angle"), 90., 3.);
}

TEST_F(InspectRealCamera, NamesAGyroThatBothCamerasAndReferenceContradict) {
  const Inspection turned = inspected(board(), {.imu = [](ImuSample& s) {
                                        for (double& rate : s.gyro_rad_per_s) rate = -rate;
                                        return true;
                                      }});
  EXPECT_THAT(faults_of(turned),
              IsSupersetOf({"images0, camera 0 axes", "images0, camera 1 axes", "imu0 axes"}));
  EXPECT_THAT(faults_of(turned), Not(Contains("states0 axes")));
}

TEST_F(InspectRealCamera, TellsHowGoodTheReferenceIsByTheGyro) {
  // Found from corners of a board, each image by itself.
  const auto sigma = [](const Inspection& inspection) {
    return figure_of(finding_of(inspection, "states0", "orientation noise"), "sigma");
  };
  const double as_it_is = sigma(inspected(board(), {}));
  EXPECT_GT(as_it_is, 1e-3);
  EXPECT_LT(as_it_is, 5e-3);
  std::mt19937_64 engine(1);
  std::normal_distribution<double> noise(0., 0.02);
  const double worse = sigma(inspected(
      board(), {.states = [&](StateSample& s) {
        const Eigen::Quaterniond q =
            to_quaternion(s.q_ItoG_xyzw) *
            Eigen::Quaterniond(1., 0.5 * noise(engine), 0.5 * noise(engine), 0.5 * noise(engine))
                .normalized();
        s.q_ItoG_xyzw = {q.x(), q.y(), q.z(), q.w()};
        return true;
      }}));
  EXPECT_NEAR(worse, 0.02, 2e-3);
}

TEST_F(InspectRealCamera, FindsThatItWasFrozen) {
  std::map<int, std::vector<FeaturePoint>> last;
  const Inspection frozen =
      inspected(board(), {.images = [&last](FeatureSample& s) {
                  const double t_s = 1e-9 * static_cast<double>(s.t_ns % 1'000'000'000'000);
                  static const double begin_s = t_s;
                  auto& points = last[s.camera];
                  const bool freezes = t_s > begin_s + 20. && t_s < begin_s + 23.;
                  if (freezes) s.points = points;
                  points = s.points;
                  return true;
                }});
  EXPECT_THAT(faults_of(frozen), Contains("images0, camera 0 tracks"));
}

TEST(InspectCameras, FindsPointsThatAreElsewhereInTheNextImage) {
  EXPECT_NE(finding_of(inspected(swerve(), {}), "images0, camera 0", "tracks").severity,
            Severity::kFault);
  // A tenth of the numbers of an image are exchanged.
  const Inspection exchanged = inspected(swerve(), {.images = [](FeatureSample& s) {
                                           for (std::size_t i = 20; i < s.points.size(); i += 20) {
                                             std::swap(s.points[i].id, s.points[i - 10].id);
                                           }
                                           return true;
                                         }});
  EXPECT_THAT(faults_of(exchanged),
              ElementsAre("images0, camera 0 tracks", "images0, camera 1 tracks"));
}

/// On a circle nothing but noise tells an axis.
TEST(InspectPoses, SaysNothingOfAxesThatNoMotionTells) {
  for (const char* const motion : {"circle", "stationary"}) {
    const Inspection found =
        inspected(simulated("viwo_swerve", {"sensors.simulator0.duration_s=20",
                                            std::string("sensors.simulator0.motion=") + motion}),
                  {});
    EXPECT_THAT(faults_of(found), ::testing::Not(Contains(HasSubstr("axes")))) << motion;
  }
}

TEST(InspectPoses, FindsTheLagOfAReferenceAndWritesIt) {
  const auto planar = [] { return setup_of(testing::configuration("runs/simulated_swerve.yaml")); };
  const Finding clean = finding_of(inspected(planar(), {}), "poses0", "clock");
  EXPECT_EQ(clean.severity, Severity::kFits) << clean.what;
  const Inspection late = inspected(planar(), {.poses = [](PoseSample& s) {
                                      shift(s, 0.08);
                                      return true;
                                    }});
  EXPECT_THAT(faults_of(late), ElementsAre("poses0 clock"));
  EXPECT_NEAR(
      std::stod(remedy_of(finding_of(late, "poses0", "clock"), "odometry.reference_time_offset_s")),
      0.08, 3e-3);
}

TEST(InspectPoses, FindsAReferenceThatTurnsTheOtherWay) {
  const Inspection inverted = inspected(
      setup_of(testing::configuration("runs/simulated_swerve.yaml")), {.poses = [](PoseSample& s) {
        for (std::size_t i = 0; i < 3; ++i) s.q_BtoW_xyzw[i] *= -1.;
        return true;
      }});
  EXPECT_THAT(finding_of(inverted, "poses0", "clock").what, HasSubstr("turns opposite to wheels0"));
}

}  // namespace
}  // namespace viwo::inspect

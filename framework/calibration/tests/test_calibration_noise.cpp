// What a fit takes for the noise of the wheels and of the reference, and what it must not.
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "message_of.hpp"
#include "simulated_calibration.hpp"

namespace viwo {
namespace {

using namespace calibration;
using testing::error_of;
using testing::fit_all;
using testing::setup_of;
using testing::truth_of;

/// Two redundant residuals are no measure of a noise that three thousand samples show.
TEST(ParityScale, OfOneRecordingIsThatOfItsNoise) {
  for (const char* motion : {"icr_sweep", "figure_eight"}) {
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      const double scale = fit_all(setup_of({motion}, seed)).noise.parity_scale;
      EXPECT_GT(scale, 0.8) << motion << " " << seed;
      EXPECT_LT(scale, 1.25) << motion << " " << seed;
    }
  }
}

/// Each by itself is well explained.
TEST(ParityScale, OfRobotsThatAreNotTheSameIsWhatTheyDifferBy) {
  CalibrationSetup both = setup_of({"icr_sweep", "figure_eight"}, 1);
  both.recordings.push_back(setup_of({"icr_sweep"}, 2).recordings.front());
  EXPECT_GT(fit_all(both).noise.parity_scale, 3.);
}

/// The rows are weighed where the wheels are, not where they were thought to be.
TEST(ParityScale, DoesNotKnowHowFarTheZerosWereOff) {
  const std::vector<std::string> far{"kinematics.steer_offset_rad=[0.03, -0.02, 0.04, -0.03]",
                                     "kinematics.prior_sigma_steer_offset_rad=0.03"};
  const auto near = fit_all(setup_of({"icr_sweep", "figure_eight"}, 1));
  const auto off = fit_all(setup_of({"icr_sweep", "figure_eight"}, 1, far));
  EXPECT_NEAR(off.noise.parity_scale, near.noise.parity_scale, 0.03);
}

/// Of few segments some leave next to nothing by chance: they are not the surest.
TEST(SegmentChoice, IsNotOfTheLuckiest) {
  double squares = 0.;
  int beyond = 0;
  constexpr int kSeeds = 16;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    CalibrationSetup setup;
    setup.name = "test";
    RunSetup run = read_run(
        config::parse("sensors: {s: {type: simulator, motion: figure_eight, duration_s: 44, "
                      "features: 0, pose_rate_hz: 20, sigma_pose_position_m: 0.003, "
                      "sigma_pose_orientation_rad: 0.002, true_intrinsics_scale: 1, robot: &robot "
                      "{type: differential, radius_left_m: 0.05, radius_right_m: 0.05, baseline_m: "
                      "0.3, prior_sigma_baseline_m: 0.01}}}\nkinematics: *robot\n",
                      "run.yaml"),
        testing::registry(), seed);
    RunData data = collect(run);
    const Recording label{"drive", {}};
    MotionReference reference = motion_reference(label, run, data, ReferenceKind::kPoses);
    setup.recordings.push_back({label, std::move(run), std::move(data), std::move(reference)});
    const CalibrationResult result = calibrate(setup);
    const Intrinsics truth = truth_of(setup, seed).x_WI;
    EXPECT_TRUE(result.all.noise.yaw_is_found && result.all.noise.position_is_found);
    for (const CalibrationEstimate& one : result.lengths) {
      if (one.residuals <= 6) {
        EXPECT_FALSE(one.noise.yaw_is_found) << one.residuals;
      }
    }
    for (int i = 0; i < 3; ++i) {
      const double off = (result.all.x_WI[i] - truth[i]) / result.all.sigma[i];
      squares += off * off / (3. * kSeeds);
      if (std::abs(off) > 3.5) ++beyond;
    }
  }
  EXPECT_LT(squares, 2.);
  EXPECT_GT(squares, 0.3);
  EXPECT_EQ(beyond, 0);
}

class Holes : public ::testing::Test {
 protected:
  Holes() {
    setup_.name = "test";
    setup_.options.segments = Segments::kLength;
    setup_.options.segment_s = 2.;
    const std::string base =
        "{type: differential, radius_left_m: 0.05, radius_right_m: 0.05, "
        "baseline_m: 0.3, prior_sigma_baseline_m: 0.01}";
    RunSetup run = read_run(
        config::parse("sensors: {s: {type: simulator, motion: figure_eight, duration_s: 60, "
                      "features: 0, robot: &robot " +
                          base + "}}\nkinematics: *robot\n",
                      "run.yaml"),
        testing::registry());
    RunData data = collect(run);
    setup_.recordings.push_back({{"drive", {}}, std::move(run), std::move(data), {}});
  }

  RunData& data() { return setup_.recordings.front().data; }
  void compare(const std::map<std::string, std::string>& labels = {}) {
    CalibrationRecording& recording = setup_.recordings.front();
    recording.motion =
        motion_reference({"drive", labels}, recording.setup, recording.data, ReferenceKind::kGyro);
  }
  template <Sample T>
  void cut(double from_s, double to_s) {
    std::string sensor;
    for (const Recorded::Track& track : data().recorded.tracks()) {
      if (track.samples->type() == sample_type<T>()) sensor = track.sensor;
    }
    std::vector<T> kept;
    const auto samples = data().recorded.of<T>();
    for (const T& sample : samples) {
      const double t_s = seconds_between(samples.front().t_ns, sample.t_ns);
      if (t_s < from_s || t_s > to_s) kept.push_back(sample);
    }
    data().recorded.set(sensor, kept);
  }

  CalibrationSetup setup_;
};

TEST_F(Holes, AreNoMeasurements) {
  compare();
  const CalibrationEstimate whole = fit_all(setup_);
  EXPECT_EQ(whole.with_holes, 0);
  cut<ImuSample>(20.5, 25.5);
  cut<EncoderSample>(40.5, 45.5);
  compare();
  const CalibrationEstimate cut = fit_all(setup_);
  EXPECT_EQ(cut.with_holes, 4) << "one that has no end in the hole of the gyro, and three";
  EXPECT_LT(cut.noise.yaw_rad, 1.5 * whole.noise.yaw_rad);
  const Intrinsics off = (cut.x_WI - whole.x_WI).cwiseAbs();
  EXPECT_LT((off - 2. * whole.sigma).maxCoeff(), 0.);
  EXPECT_LT((cut.sigma - 1.5 * whole.sigma).maxCoeff(), 0.);
}

TEST_F(Holes, LeaveNothingToCompareWithWhatWasMeasuredByHand) {
  cut<EncoderSample>(40.5, 45.5);
  compare({{"distance_m", "12"}});
  EXPECT_THAT(error_of([&] { fit_all(setup_); }),
              ::testing::HasSubstr("distance_m and turn_deg are of a whole drive, and the wheels "
                                   "turned unseen for 5 s, 40.5 s after the begin"));
  setup_.options.segments = Segments::kWhole;
  compare();
  EXPECT_THAT(error_of([&] { fit_all(setup_); }), ::testing::HasSubstr("choose shorter ones"));
}

}  // namespace
}  // namespace viwo

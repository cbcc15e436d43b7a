// A calibration that misleads says so.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "joint_search.hpp"
#include "unknown_swerve.hpp"

namespace viwo {
namespace {

using namespace calibration;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A differential drive on a figure eight with a gyro, whose nominal values may be wrong.
CalibrationSetup differential(const std::string& nominal) {
  return testing::gyro_setup(
      "type: differential, radius_left_m: 0.05, radius_right_m: 0.05, baseline_m: 0.3",
      "type: differential, baseline_m: 0.3, " + nominal, 1);
}

const std::string kRight = "radius_left_m: 0.05, radius_right_m: 0.05";

TEST(Judgement, TrustsWhatIsRight) {
  CalibrationSetup setup = differential(kRight);
  const CalibrationResult result = calibrate(setup);
  EXPECT_THAT(result.doubts, IsEmpty());
  EXPECT_THAT(result.warnings, IsEmpty());
  EXPECT_FALSE(result.lengths.empty());
}

TEST(Judgement, DoubtsAFitOfFewResiduals) {
  CalibrationSetup setup = differential(kRight);
  setup.options.segments = Segments::kWhole;
  EXPECT_THAT(calibrate(setup).doubts, Contains(HasSubstr("only 1 residuals for 4 unknowns")));
}

TEST(Judgement, DoubtsAChangeThatThePriorExcludes) {
  CalibrationSetup setup = differential(kRight);
  testing::scale_drives(setup, 1.1);
  const CalibrationResult result = calibrate(setup);
  EXPECT_THAT(result.doubts, Contains(HasSubstr("prior sigmas from its nominal value")));
}

TEST(Judgement, DoubtsAMirroredBaseWhichBoundsExclude) {
  CalibrationSetup setup = differential(kRight + ", prior_sigma_radius_m: 0.1");
  reverse_drives(setup, {-1, -1});
  const CalibrationResult result = calibrate(setup);
  const WheelModel& model = *setup.recordings[0].setup.model;
  for (const char* name : {"r_left", "r_right", "baseline"}) {
    EXPECT_GE(result.all.x_WI[model.find(name)], 0.) << name;
  }
  EXPECT_FALSE(result.is_trusted());
}

}  // namespace
}  // namespace viwo

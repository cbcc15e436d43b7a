// The delivered configuration for KAIST Complex Urban on a sequence whose motion is known.
#include <fstream>

#include "support.hpp"
#include "test_sequence.hpp"

namespace viwo {
namespace {

/// The wheels alone, as in docs/datasets.md.
const std::string kWheels =
    "name: kaist_wheels\n"
    "sensors:\n"
    "  kaist0: {type: kaist_urban, path: kaist/urban28-pankyo, imu: false, images: false}\n"
    "kinematics:\n"
    "  {type: differential, radius_left_m: 0.3117395, radius_right_m: 0.311403,\n"
    "   baseline_m: 1.52439}\n";

class KaistUrbanRun : public CommandLineTest {
 protected:
  void write_sequence() const { sequence_.write(at("kaist/urban28-pankyo")); }
  double ate(const char* key) const { return summary().at("accuracy").at(key).get<double>(); }

  kaist::TestSequence sequence_;
};

TEST_F(KaistUrbanRun, WheelsAloneFollowTheGlobalPose) {
  sequence_.duration_s = 30.;
  write_sequence();
  write("wheels.yaml", kWheels);
  expect_done({"run", "wheels.yaml", "--out", "out"});
  EXPECT_EQ(summary().at("status"), "ok");
  EXPECT_DOUBLE_EQ(summary().at("duration_s").get<double>(), 30.);
  // Sixty metres; a count is half a millimetre at the wheel, and a third of a milliradian of yaw.
  EXPECT_LT(ate("ate_m"), 5e-4);
  EXPECT_LT(ate("ate_deg"), 0.02);

  // Wheels that are one percent larger: the circle of 10 m radius is so, too.
  expect_done(
      {"run", "wheels.yaml", "--out", "out", "--set", "sensors.kaist0.encoder_resolution=4055"});
  EXPECT_GT(ate("ate_m"), 0.05);
}

TEST_F(KaistUrbanRun, InTheDarkWheelsAndImuFollowTheGlobalPose) {
  sequence_.duration_s = 6.;
  sequence_.n_images = 58;
  sequence_.width_px = 1280;
  sequence_.height_px = 560;
  write_sequence();
  const std::string config = std::string(VIWO_TEST_SOURCE_DIR) + "/configs/runs/kaist_urban.yaml";
  const Outcome outcome =
      viwo({"run", config, "--out", "out", "--set", "placeholders.data=" + at("kaist").string()});
  EXPECT_EQ(outcome.code, 1);
  ASSERT_EQ(summary().at("doubts").size(), 1U);
  EXPECT_NE(summary().at("doubts")[0].get<std::string>().find("image without contrast"),
            std::string::npos);
  EXPECT_LT(ate("ate_m"), 0.02);
  EXPECT_LT(ate("ate_deg"), 1.);
}

}  // namespace
}  // namespace viwo

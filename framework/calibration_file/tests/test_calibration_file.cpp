// calibration.yaml: written, read back, and refused where something in it is wrong.
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "in_folder.hpp"
#include "message_of.hpp"
#include "peak_memory.hpp"
#include "simulated.hpp"
#include "viwo/calibration_file/calibration_file.hpp"

namespace viwo {
namespace {

using ::testing::AllOf;
using testing::error_of;
using ::testing::HasSubstr;
using testing::registry;

class CalibrationFileTest : public testing::InFolder {
 protected:
  /// Error of reading such a file, without its name.
  std::string error_of_file(const std::string& text) {
    return without_name(error_of([&] { read(text); }));
  }
  CalibrationFile read(const std::string& text) {
    std::ofstream(file_) << text;
    return read_calibration(file_);
  }
  /// Error of a run of two sides that starts from it.
  std::string error_of_run(const std::string& text, const std::string& key = "calibration") {
    std::ofstream(file_) << text;
    auto run = config::parse(kRun, "run.yaml");
    config::set_path(run, key, config::Node::scalar_of(file_.string()));
    return without_name(error_of([&] { read_run(run, registry()); }));
  }

  std::string without_name(std::string text) const {
    for (std::size_t i = 0; (i = text.find(file_.string(), i)) != std::string::npos;) {
      text.replace(i, file_.string().size(), "F");
    }
    return text;
  }

  static constexpr const char* kRun =
      "sensors: {s: {type: planar_simulator, motion: circle, robot: &robot {type: differential, "
      "radius_left_m: 0.05, radius_right_m: 0.05, baseline_m: 0.4}}}\nkinematics: *robot\n";
  const std::filesystem::path file_ = folder_ / "calibration.yaml";
};

const std::string kTwoSidesHead = "model: differential\ntwist: plain\nintrinsics:\n";
const std::string kTwoSides = kTwoSidesHead +
                              "  r_left: {estimate: 0.051, sigma: 0.001, unit: m}\n"
                              "  r_right: {estimate: 0.049, sigma: 0.001}\n"
                              "  baseline: {estimate: 0.41, sigma: 0.01}\n";

TEST_F(CalibrationFileTest, ComesBackToTheBit) {
  CalibrationFile file =
      read(kTwoSides +
           "status: doubtful\nreasons: ['a: b']\nwheel_sets: {back: differential}\n"
           "mount: {theta_ItoO_x: {estimate: 0.1, sigma: 0.3, nominal: 0.2, unit: rad}}\n"
           "clock: {t_OtoI: {estimate: 0.3333333333333333, sigma: 0}}\n"
           "cameras: {cam0.fx: {estimate: 300, sigma: 1}}\n"
           "camera_models: {cam0: {distortion_model: equidistant, resolution: [640, 480], "
           "line_delay_nanoseconds: 20000}}\n"
           "correlations: {r_left: [], baseline: [-0.1], theta_ItoO_x: [0.3, 0.7]}\n");
  EXPECT_EQ(file.correlations.matrix(1, 2), 0.7);
  EXPECT_EQ(file.correlations.matrix(1, 0), -0.1);
  const std::string text = calibration_text(file, "a test");
  EXPECT_EQ(calibration_text(read(text), "a test"), text);
  EXPECT_EQ(read(text).clock[0].estimate, 0.3333333333333333);
  EXPECT_DOUBLE_EQ(read(text).camera_models[0].line_delay_s, 2e-5);
  EXPECT_EQ(read(text).reasons[0], "a: b");
}

TEST_F(CalibrationFileTest, RefusesWhatIsWrongWithItsPlace) {
  EXPECT_EQ(error_of_file("model: differential\nintrinsics: {}\n"),
            "F:1:1  'twist' is missing: model, twist and intrinsics belong together");
  EXPECT_EQ(error_of_file(kTwoSides + "mount: {p_IinO_w: {estimate: 0, sigma: 0}}\n"),
            "F:7:9  mount: unknown parameter 'p_IinO_w' - did you mean 'p_IinO_x'?");
  EXPECT_EQ(error_of_file(kTwoSides + "mounts: {}\n"),
            "F:7:1  calibration: unknown key 'mounts' - did you mean 'mount'?");
  EXPECT_THAT(error_of_file(kTwoSidesHead + "  r_left: {estimate: 0.05, sigma: -1}\n"),
              HasSubstr("F:4:35  intrinsics.r_left.sigma: -1 violates 0 <= sigma <= 1e+09"));
  EXPECT_EQ(error_of_file(kTwoSides + "camera_models: {cam1: {}}\n"),
            "F:7:17  camera_models: 'cam1' stands where cam0 should; cameras are counted from cam0 "
            "without gaps");
  const std::string rows = kTwoSides + "correlations:\n  r_left: []\n";
  EXPECT_EQ(error_of_file(rows + "  r_right: [0.1, 0.2]\n"),
            "F:9:12  correlations.r_right: expected a list of 1 numbers, one for each of the rows "
            "before it");
  EXPECT_EQ(error_of_file(rows + "  r_right: [1.1]\n"),
            "F:9:13  correlations.r_right: a correlation is a number from -1 to 1");
  EXPECT_EQ(error_of_file(rows + "  left: [0.1]\n"),
            "F:9:3  correlations: 'left' is none of the parameters that have a sigma");
  EXPECT_THAT(error_of_file(rows + "  r_right: [0.9]\n  baseline: [0.9, -0.9]\n"),
              HasSubstr("F:8:3  correlations: no such correlations exist"));
}

TEST_F(CalibrationFileTest, RefusesWhatIsNoNameOrNoNumberOfARobot) {
  EXPECT_EQ(error_of_file("model: \"a\\nb\"\ntwist: plain\nintrinsics: {}\n"),
            "F:1:8  model: 'a?b' is no name: letters, digits, _ . + -");
  EXPECT_EQ(error_of_file(kTwoSides + "  'x\"/><y z=\"': {estimate: 1, sigma: 0}\n"),
            "F:7:3  intrinsics: 'x\"/><y z=\"' is no name: letters, digits, _ . + -");
  EXPECT_THAT(error_of_file(kTwoSides + "  x: {estimate: 1, sigma: 0, unit: \"m\\n\"}\n"),
              HasSubstr("F:7:3  intrinsics.x.unit: 'm?' is no name"));
  EXPECT_THAT(error_of_file(kTwoSides + "wheel_sets: {'a b': 'c d'}\n"),
              AllOf(HasSubstr("wheel_sets: 'a b' is no name"), HasSubstr("'c d' is no name")));
  EXPECT_THAT(error_of_file(kTwoSides + "  x: {estimate: .inf, sigma: 0}\n"),
              HasSubstr("F:7:17  intrinsics.x.estimate"));
  EXPECT_EQ(error_of_file(kTwoSides + "drive_signs: [1, 0.5]\n"),
            "F:7:14  drive_signs: 1 or -1 each");
  EXPECT_EQ(error_of_file("status: ok\n"), "F:1:1  there is nothing of a calibration in this file");
}

TEST_F(CalibrationFileTest, TakesNoPlaceForCorrelationsThatAreNotThere) {
  std::string entries = kTwoSides, rows = "correlations:\n";
  for (int i = 0; i < 9000; ++i) {
    const std::string name = "e" + std::to_string(i);
    entries += "  " + name + ": {estimate: 1, sigma: 1}\n";
    rows += "  " + name + ": []\n";
  }
  const long before_mb = testing::peak_mb();
  const std::string error = error_of_file(entries + rows);
  EXPECT_LT(testing::peak_mb() - before_mb, 300) << "a matrix of them all has 648 MB";
  EXPECT_THAT(error, HasSubstr("correlations.e1: expected a list of 1 numbers"));
}

TEST_F(CalibrationFileTest, MustFitTheRunThatTakesIt) {
  EXPECT_EQ(error_of_run(kTwoSides), "");
  EXPECT_EQ(error_of_run(kTwoSides, "kinematics.calibration"), "");
  EXPECT_EQ(error_of_run("model: skid_steer\ntwist: plain\nintrinsics: {}\n"),
            "F:1:8  this calibration is for the model 'skid_steer', the run has 'differential'");
  EXPECT_EQ(error_of_run(kTwoSidesHead + "  r_left: {estimate: -0.05, sigma: 0.001, unit: m}\n"
                                         "  r_rihgt: {estimate: 0.05, sigma: 0.001}\n"
                                         "  baseline: {estimate: 410, sigma: 1, unit: mm}\n"),
            "F:4:3  intrinsic 'r_right' is missing\n"
            "F:4:22  r_left: -0.05 is beyond what the model 'differential' takes, 0 to inf m\n"
            "F:5:3  the model 'differential' has no intrinsic 'r_rihgt' - did you mean 'r_right'?\n"
            "F:6:24  baseline: its unit is 'mm', not 'm'");
  EXPECT_EQ(error_of_run(kTwoSides + "drive_signs: [1, -1, 1]\n"),
            "F  'drive_signs' has 3 signs, but kinematics 'differential' has 2 drives");
  EXPECT_EQ(error_of_run("cameras: {cam0.fx: {estimate: 300, sigma: 1}}\n"),
            "F:1:1  this calibration has nothing that the run has");
  EXPECT_EQ(
      error_of_run("cameras: {cam0.fx: {estimate: 300, sigma: 1}}\n", "kinematics.calibration"),
      "F:1:1  this calibration has nothing of wheels");
  EXPECT_EQ(error_of_run("status: failed\nreasons: [no turns]\n"),
            "F:1:9  this calibration is not to be used: what it is from has failed (no turns) - "
            "calibrate again, or, if you know it to be right, write status: doubtful");
}

TEST_F(CalibrationFileTest, IsNamedOnce) {
  std::ofstream(file_) << kTwoSides;
  auto run = config::parse(kRun, "run.yaml");
  const auto path = config::Node::scalar_of(file_.string());
  config::set_path(run, "calibration", path);
  config::set_path(run, "kinematics.calibration", path);
  EXPECT_THAT(error_of([&] { read_run(run, registry()); }),
              HasSubstr("kinematics.calibration: the run has a key 'calibration', too"));
}

TEST_F(CalibrationFileTest, IsMissedWhereItIsNamed) {
  for (const char* key : {"calibration", "kinematics.calibration"}) {
    auto run = config::parse(kRun, "run.yaml");
    config::set_path(run, key, config::Node::scalar_of("/no/such.yaml", {"run.yaml", 7, 8}));
    EXPECT_EQ(error_of([&] { read_run(run, registry()); }),
              "run.yaml:7:8  " + std::string(key) + ": no such file: /no/such.yaml");
  }
}

TEST_F(CalibrationFileTest, GivesTheReferenceItsPlaceAndClock) {
  std::ofstream(file_) << kTwoSides
                       << "reference:\n  x_OinB: {estimate: 0.1, sigma: 0.01}\n"
                          "  y_OinB: {estimate: 0.2, sigma: 0.01}\n"
                          "  yaw_OinB: {estimate: 0.3, sigma: 0.01}\n"
                          "  t_OtoB: {estimate: 0.04, sigma: 0.01}\n";
  auto run = config::parse(kRun, "run.yaml");
  config::set_path(run, "calibration", config::Node::scalar_of(file_.string()));
  const RunSetup setup = read_run(run, registry());
  EXPECT_EQ(setup.extrinsics, PlanarExtrinsics(0.1, 0.2, 0.3));
  EXPECT_EQ(setup.reference_time_offset_s, 0.04);
  EXPECT_EQ(setup.x_WI[0], 0.051);
  EXPECT_EQ(setup.sigma[2], 0.01);
  config::set_path(run, "odometry.reference_time_offset_s", config::Node::scalar_of("0.5"));
  EXPECT_EQ(read_run(run, registry()).reference_time_offset_s, 0.5) << "what is written counts";
  // The resolved configuration is the same run.
  const auto resolved = config::parse(config::to_yaml(setup.resolved), "resolved.yaml");
  EXPECT_EQ(read_run(resolved, registry()).reference_time_offset_s, 0.04);
  EXPECT_EQ(read_run(resolved, registry()).x_WI, setup.x_WI);
}

}  // namespace
}  // namespace viwo

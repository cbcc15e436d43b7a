// The delivered configurations for EuRoC and TUM-VI on sequences in exactly their files.
#include <array>

#include <gmock/gmock.h>

#include "asl_sequence.hpp"
#include "registry.hpp"
#include "support.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/log/kalibr.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const std::string kConfigs = std::string(VIWO_TEST_SOURCE_DIR) + "/configs/";

using AslDatasets = CommandLineTest;

template <class Sample>
std::vector<Sample> play(const std::string& yaml) {
  config::Errors errors;
  const auto sensor =
      testing::registry().make_sensor(config::parse(yaml, "test"), "sensor", 1, errors);
  errors.throw_if_any();
  std::vector<Sample> out;
  for (Measurement m; sensor.object->next(m) == Status::kOk;) out.push_back(*m.get_if<Sample>());
  return out;
}

TEST_F(AslDatasets, ImuRowsOfEurocAreRead) {
  write("data.csv", AslSequence::kImuHeader +
                        std::string("\r\n1403715273262142976,-0.0020943951023931952,"
                                    "0.017453292519943295,0.077492618788550629,9.0874956666666655,"
                                    "0.13075533333333333,-3.6938381666666662\r\n"));
  const auto imu = play<ImuSample>("{type: asl_imu, path: " + at("data.csv").string() + "}");
  ASSERT_EQ(imu.size(), 1U);
  EXPECT_EQ(imu[0].t_ns, 1'403'715'273'262'142'976);
  EXPECT_EQ(imu[0].gyro_rad_per_s,
            (std::array{-0.0020943951023931952, 0.017453292519943295, 0.077492618788550629}));
  EXPECT_EQ(imu[0].accel_m_per_s2,
            (std::array{9.0874956666666655, 0.13075533333333333, -3.6938381666666662}));
}

TEST_F(AslDatasets, StatesOfEurocAreRead) {
  write("data.csv", AslSequence::kStateHeader +
                        std::string("\r\n1403715274302142976,0.878612,2.142470,0.947262,0.060514,"
                                    "-0.828459,-0.058956,-0.553641,0.009474,-0.014009,-0.002145,"
                                    "-0.002229,0.020700,0.076350,-0.012492,0.547666,0.069073\r\n"));
  const std::string path = ", path: " + at("data.csv").string() + "}";
  const auto states = play<StateSample>("{type: asl_state" + path);
  ASSERT_EQ(states.size(), 1U);
  EXPECT_EQ(states[0].t_ns, 1'403'715'274'302'142'976);
  EXPECT_EQ(states[0].p_IinG_m, (std::array{0.878612, 2.142470, 0.947262}));
  EXPECT_NEAR(states[0].q_ItoG_xyzw[3], 0.060514, 1e-6);  // of unit norm to six digits
  EXPECT_NEAR(states[0].q_ItoG_xyzw[0], -0.828459, 1e-6);
  EXPECT_EQ(states[0].v_IinG_m_per_s, (std::array{0.009474, -0.014009, -0.002145}));
  EXPECT_EQ(states[0].gyro_bias_rad_per_s, (std::array{-0.002229, 0.0207, 0.07635}));
  EXPECT_EQ(states[0].accel_bias_m_per_s2, (std::array{-0.012492, 0.547666, 0.069073}));
  const auto poses = play<PoseSample>("{type: asl_pose" + path);
  ASSERT_EQ(poses.size(), 1U);
  EXPECT_EQ(poses[0].q_BtoW_xyzw, states[0].q_ItoG_xyzw);
}

TEST_F(AslDatasets, MotionCaptureOfTumViIsRead) {
  write("data.csv", AslSequence::kMocapHeader +
                        std::string("\n1520530308199447626,0.6,-0.8,1.25,0.5,-0.5,0.5,-0.5\n"));
  const auto poses = play<PoseSample>("{type: asl_pose, path: " + at("data.csv").string() + "}");
  ASSERT_EQ(poses.size(), 1U);
  EXPECT_EQ(poses[0].t_ns, 1'520'530'308'199'447'626);
  EXPECT_EQ(poses[0].p_BinW_m, (std::array{0.6, -0.8, 1.25}));
  EXPECT_EQ(poses[0].q_BtoW_xyzw, (std::array{-0.5, 0.5, -0.5, 0.5}));
}

/// Origin of camera 0 in camera 1 [m].
Eigen::Vector3d p_C0inC1(const std::vector<CameraView>& cameras) {
  const Eigen::Matrix3d R_C0toC1 = cameras[1].R_ItoC * cameras[0].R_ItoC.transpose();
  return cameras[1].p_IinC - R_C0toC1 * cameras[0].p_IinC;
}

TEST_F(AslDatasets, CamerasOfTheConfigurationsAreThosePublished) {
  const auto euroc = log::read_kalibr_cameras(kConfigs + "cameras/euroc.yaml");
  ASSERT_EQ(euroc.size(), 2U);
  EXPECT_NEAR(p_C0inC1(euroc).norm(), 0.11, 1e-3);  // 11 cm
  const auto kaist = log::read_kalibr_cameras(kConfigs + "cameras/kaist_urban.yaml");
  ASSERT_EQ(kaist.size(), 2U);
  EXPECT_NEAR(p_C0inC1(kaist).x(), -0.475143600050775,
              1e-9);  // the baseline of the calibration folder
  // Both look forward (x of the IMU); the right camera is on the right (-y).
  for (const CameraView& camera : kaist) EXPECT_GT(camera.R_ItoC(2, 0), 0.999);
  const Eigen::Vector3d right = -kaist[1].R_ItoC.transpose() * kaist[1].p_IinC;
  EXPECT_NEAR(right.y(), 0.2474 - 0.4751, 2e-3);
}

TEST_F(AslDatasets, TheConfigurationForEurocFollowsItsFiles) {
  const AslSequence sequence(log::read_kalibr_cameras(kConfigs + "cameras/euroc.yaml"), 6.);
  const fs::path mav0 = at("euroc/V1_01_easy/mav0");
  sequence.write_imu(mav0);
  sequence.write_states(mav0);
  sequence.write_images(mav0);
  const std::string set = "placeholders.data=" + at("euroc").string();
  expect_done({"run", kConfigs + "runs/euroc.yaml", "--out", "out", "--set", set});
  const nlohmann::json json = summary();
  EXPECT_EQ(json.at("status"), "ok");
  EXPECT_GT(json.at("updates").at("visual_features").at("applied").get<int>(), 100);
  EXPECT_LT(json.at("accuracy").at("ate_m").get<double>(), 0.03) << json.at("accuracy");
  EXPECT_LT(json.at("accuracy").at("ate_deg").get<double>(), 1.);

  fs::rename(mav0 / "cam1", mav0 / "camera1");
  const Outcome outcome =
      viwo({"run", kConfigs + "runs/euroc.yaml", "--out", "none", "--set", set});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("TMP/euroc/V1_01_easy/mav0/cam1"));
}

/// A camera chain as dso/camchain.yaml of TUM-VI: Kalibr's file, with the dataset's intrinsics.
const std::string kTumViCameras = R"(cam0:
  T_cam_imu:
  - [-0.999525, 0.029615, -0.008522, 0.047280]
  - [0.007502, -0.034397, -0.999380, -0.047443]
  - [-0.029890, -0.998969, 0.034159, -0.068200]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [0.0034823894022493434, 0.0007150348452162257, -0.0020532361418706202,
    0.00020293673591811182]
  distortion_model: equidistant
  intrinsics: [190.97847715128717, 190.9733070521226, 254.93170605935475, 256.8974428996504]
  resolution: [512, 512]
  rostopic: /cam0/image_raw
cam1:
  T_cam_imu:
  - [-0.999511, 0.030299, -0.007722, -0.053697]
  - [0.008104, 0.012512, -0.999889, -0.046132]
  - [-0.030199, -0.999463, -0.012751, -0.071493]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: pinhole
  distortion_coeffs: [0.0034003170790442797, 0.001766278153469831, -0.00266312569781606,
    0.0003299517423931039]
  distortion_model: equidistant
  intrinsics: [190.44236969414825, 190.4344384721956, 252.59949716835982, 254.91723064636983]
  resolution: [512, 512]
  rostopic: /cam1/image_raw
)";

TEST_F(AslDatasets, TheConfigurationForTumViFollowsItsFiles) {
  const std::string folder = "tum_vi/dataset-room1_512_16";
  write(folder + "/dso/camchain.yaml", kTumViCameras);
  const AslSequence sequence(log::read_kalibr_cameras(at(folder + "/dso/camchain.yaml")), 6.);
  sequence.write_imu(at(folder + "/mav0"));
  sequence.write_mocap(at(folder + "/mav0"));
  sequence.write_images(at(folder + "/mav0"));
  expect_done({"run", kConfigs + "runs/tum_vi.yaml", "--out", "out", "--set",
               "placeholders.data=" + at("tum_vi").string()});
  const nlohmann::json json = summary();
  EXPECT_EQ(json.at("status"), "ok");
  EXPECT_GT(json.at("updates").at("visual_features").at("applied").get<int>(), 100);
  EXPECT_LT(json.at("accuracy").at("ate_m").get<double>(), 0.03) << json.at("accuracy");
  EXPECT_LT(json.at("accuracy").at("ate_deg").get<double>(), 1.);
}

}  // namespace
}  // namespace viwo

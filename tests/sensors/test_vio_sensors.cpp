// The sensors of a visual-inertial system: tables of a log folder, and CSV exports of others.
#include <chrono>
#include <cmath>

#include <Eigen/Geometry>
#include <gmock/gmock.h>

#include "support.hpp"

namespace viwo {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class VioSensors : public SensorsInFolder {
 protected:
  std::string vio(const std::string& rest = "") const {
    return "{type: vio_csv, folder: " + folder_.string() + rest + "}";
  }

  void write_vio() const {
    write("imu.csv",
          "t,wx,wy,wz,ax,ay,az\n1521753106.7364275,1,2,3,4,5,6\n1521753106.7414277,1,2,3,4,5,7\n");
    write("features.csv",
          "t,cam_id,feat_id,u,v\n1521753106.7364275,1,7,10.5,20\n1521753106.7364275,0,7,1,2\n"
          "1521753106.7364275,1,8,11,21\n1521753106.74,0,9,3,4\n");
    write("groundtruth.csv", std::string(kStateHeader) +
                                 "1521753106.7364275,0.6,0,0,0.8,1,2,3,4,5,6,7,8,9,10,11,12\n"
                                 "1521753106.7414277,0.6,0,0,0.8,1,2,3,4,5,6,7,8,9,10,11,13\n");
  }

  static constexpr const char* kStateHeader =
      "t,qx,qy,qz,qw,px,py,pz,vx,vy,vz,bgx,bgy,bgz,bax,bay,baz\n";
};

std::vector<std::string> kinds(const std::vector<Measurement>& measurements) {
  std::vector<std::string> out;
  for (const Measurement& m : measurements) {
    if (m.get_if<StateSample>() != nullptr) out.emplace_back("state");
    if (m.get_if<ImuSample>() != nullptr) out.emplace_back("imu");
    if (const auto* image = m.get_if<FeatureSample>()) {
      out.push_back("image " + std::to_string(image->camera));
    }
  }
  return out;
}

TEST_F(VioSensors, LogTablesPlayTheirMeasurements) {
  const auto imu = play_only<ImuSample>(
      "{type: asl_imu, path: " +
      write("imu.csv",
            "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
            "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n"
            "1403636579758555392,-0.1,0.2,0.07,9.08,0.1,-3.6\n") +
      "}");
  ASSERT_EQ(imu.size(), 1U);
  EXPECT_EQ(imu[0].t_ns, 1403636579758555392);
  EXPECT_EQ(imu[0].gyro_rad_per_s, (std::array{-0.1, 0.2, 0.07}));
  EXPECT_EQ(imu[0].accel_m_per_s2, (std::array{9.08, 0.1, -3.6}));

  const auto images = play_only<FeatureSample>(
      "{type: asl_features, path: " +
      write("features.csv", "timestamp_ns,camera,id,u,v\n1,0,7,1,2\n1,1,7,3,4\n2,0,,,\n") + "}");
  ASSERT_EQ(images.size(), 3U);
  EXPECT_EQ(images[1].points.at(0).u_px, 3.);
  EXPECT_TRUE(images[2].points.empty());

  const auto states = play_only<StateSample>(
      "{type: asl_state, path: " +
      write("truth.csv",
            "#timestamp,p_RS_R_x,p_RS_R_y,p_RS_R_z,q_RS_w,q_RS_x,q_RS_y,q_RS_z,v_RS_R_x,v_RS_R_y,"
            "v_RS_R_z,b_w_RS_S_x,b_w_RS_S_y,b_w_RS_S_z,b_a_RS_S_x,b_a_RS_S_y,b_a_RS_S_z\n"
            "5,1,2,3,0.8,0.6,0,0,4,5,6,7,8,9,10,11,12\n") +
      "}");
  ASSERT_EQ(states.size(), 1U);
  EXPECT_EQ(states[0].q_ItoG_xyzw, (std::array{0.6, 0., 0., 0.8}));
  EXPECT_EQ(states[0].v_IinG_m_per_s, (std::array{4., 5., 6.}));
  EXPECT_EQ(states[0].gyro_bias_rad_per_s, (std::array{7., 8., 9.}));
  EXPECT_EQ(states[0].accel_bias_m_per_s2, (std::array{10., 11., 12.}));

  const auto truth = play_only<CalibrationSample>(
      "{type: asl_calibration, path: " +
      write("calibration.csv", "timestamp_ns,name,value\n0,r_1,0.5\n0,t_OtoI,0.01\n") + "}");
  ASSERT_EQ(truth.size(), 2U);
  EXPECT_EQ(truth[1].name, "t_OtoI");
  EXPECT_EQ(truth[1].value, 0.01);
}

TEST_F(VioSensors, LogTablesFailAtConstructionAndReportWhatTheyDropped) {
  const auto path = write("f.csv", "timestamp_ns,camera,id,u,v\n1,0,7,1,2\n1,0,7,1,2\n");
  EXPECT_THAT(
      error_of("{type: asl_features, path: " + path + "}"),
      HasSubstr(path + "  1 of 2 data rejected, allowed is a fraction of 0.1: point whose id the "
                       "image already has (1, first at f.csv:3)"));
  const auto sensor =
      make_sensor("{type: asl_features, max_rejected_fraction: 0.5, path: " + path + "}");
  EXPECT_THAT(rejections_of(*sensor),
              ElementsAre("point whose id the image already has | 1 | f.csv:3"));
}

TEST_F(VioSensors, VioCsvMergesInTimeOrderWithExactStamps) {
  write_vio();
  const auto all = play(*make_sensor(vio()));
  EXPECT_THAT(kinds(all),
              ElementsAre("state", "imu", "image 1", "image 0", "image 0", "state", "imu"));
  EXPECT_EQ(stamp_ns(all[0]), 1'521'753'106'736'427'500);
  EXPECT_EQ(stamp_ns(all[3]), 1'521'753'106'736'427'500);
  EXPECT_EQ(stamp_ns(all[4]), 1'521'753'106'740'000'000);
  EXPECT_EQ(stamp_ns(all[6]), 1'521'753'106'741'427'700);
  const auto& state = *all[0].get_if<StateSample>();
  EXPECT_EQ(state.q_ItoG_xyzw, (std::array{0.6, 0., 0., 0.8}));
  EXPECT_EQ(state.p_IinG_m, (std::array{1., 2., 3.}));
  EXPECT_EQ(state.v_IinG_m_per_s, (std::array{4., 5., 6.}));
  EXPECT_EQ(state.gyro_bias_rad_per_s, (std::array{7., 8., 9.}));
  EXPECT_EQ(state.accel_bias_m_per_s2, (std::array{10., 11., 12.}));
  const auto& imu = *all[6].get_if<ImuSample>();
  EXPECT_EQ(imu.gyro_rad_per_s, (std::array{1., 2., 3.}));
  EXPECT_EQ(imu.accel_m_per_s2, (std::array{4., 5., 7.}));
  const auto& image = *all[2].get_if<FeatureSample>();
  ASSERT_EQ(image.points.size(), 2U);
  EXPECT_EQ(image.points[1].id, 8);
  EXPECT_EQ(image.points[1].u_px, 11.);
  EXPECT_EQ(image.points[1].v_px, 21.);
}

TEST_F(VioSensors, VioCsvReadsWhatIsSwitchedOn) {
  write_vio();
  EXPECT_THAT(kinds(play(*make_sensor(vio(", features: false, truth: false")))),
              ElementsAre("imu", "imu"));
  EXPECT_THAT(kinds(play(*make_sensor(vio(", imu: false, truth: false")))),
              ElementsAre("image 1", "image 0", "image 0"));
  EXPECT_THAT(kinds_of(*make_sensor(vio())), ElementsAre("imu", "reference states", "tracks"));
  EXPECT_THAT(kinds_of(*make_sensor(vio(", imu: false, truth: false"))), ElementsAre("tracks"));
  std::filesystem::remove(folder_ / "imu.csv");
  std::filesystem::remove(folder_ / "features.csv");
  EXPECT_THAT(kinds(play(*make_sensor(vio(", imu: false, features: false")))),
              ElementsAre("state", "state"));
  EXPECT_THAT(error_of(vio(", imu: false, features: false, truth: false")),
              HasSubstr("sensor.folder: nothing to read: imu, features and truth are all false"));
  EXPECT_THAT(error_of(vio()), HasSubstr((folder_ / "imu.csv").string() +
                                         "  cannot be read: No such file or directory"));
}

TEST_F(VioSensors, VioCsvTakesTheInitialStateWhereThereIsNoTruth) {
  write_vio();
  std::filesystem::remove(folder_ / "groundtruth.csv");
  write("init_state.csv",
        std::string(kStateHeader) + "1521753106.7,0.6,0,0,0.8,9,2,3,4,5,6,7,8,9,10,11,12\n");
  const auto states = play_only<StateSample>(vio());
  ASSERT_EQ(states.size(), 1U);
  EXPECT_EQ(states[0].p_IinG_m[0], 9.);
}

TEST_F(VioSensors, VioCsvRefusesBrokenTables) {
  write_vio();
  const auto imu = write("imu.csv", "t,wx,wy,wz,ax,ay,az\nnow,1,2,3,4,5,6\n");
  EXPECT_THAT(error_of(vio()), HasSubstr(imu + ":2  column 't': 'now' is no time in seconds"));
  write("imu.csv", "t,wx,wy,wz,ax,ay\n");
  EXPECT_THAT(error_of(vio()), HasSubstr(imu + ":1  no column 'az' - did you mean 'wz'?"));
  write("imu.csv", "t,wx,wy,wz,ax,ay,az\n1,1,2,3,4,5,6\n0.5,1,2,3,4,5,6\n");
  EXPECT_THAT(error_of(vio()),
              HasSubstr("1 of 2 data rejected, allowed is a fraction of 0.1: stamp not after the "
                        "previous one (1, first at imu.csv:3)"));
  write("imu.csv", "t,wx,wy,wz,ax,ay,az\n1,nan,2,3,4,5,6\n");
  EXPECT_THAT(error_of(vio()), HasSubstr("value that is not finite (1, first at imu.csv:2)"));
  write("imu.csv", "");
  EXPECT_THAT(error_of(vio()), HasSubstr(imu + ":1  the file is empty"));
  write_vio();
  write("groundtruth.csv",
        std::string(kStateHeader) + "1,0.6,0,0,0.7,1,2,3,4,5,6,7,8,9,10,11,12\n");
  EXPECT_THAT(error_of(vio()),
              HasSubstr("quaternion that is not of unit norm (1, first at groundtruth.csv:2)"));
}

class OpenVinsSim : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(VIWO_TEST_SHARED_DIR) / "data/openvins_sim" / GetParam();
    if (!std::filesystem::exists(folder_ / "imu.csv.gz")) {
      GTEST_SKIP() << "no recordings in " << folder_;
    }
    const auto begin = std::chrono::steady_clock::now();
    sensor_ = make_sensor("{type: vio_csv, folder: " + folder_.string() + "}");
    seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    all_ = play(*sensor_);
  }
  bool stereo() const { return std::string(GetParam()) == "stereo"; }

  std::filesystem::path folder_;
  std::shared_ptr<Sensor> sensor_;
  std::vector<Measurement> all_;
  double seconds_ = 0.;
};

TEST_P(OpenVinsSim, HasTheExpectedCountsAndFirstValues) {
  RecordProperty("load_s", std::to_string(seconds_));
  const auto imu = only<ImuSample>(all_);
  const auto images = only<FeatureSample>(all_);
  const auto states = only<StateSample>(all_);
  EXPECT_EQ(imu.size(), 24000U);
  EXPECT_EQ(states.size(), 24000U);
  EXPECT_EQ(images.size(), stereo() ? 2398U : 1199U);
  std::size_t points = 0;
  for (const FeatureSample& image : images) points += image.points.size();
  EXPECT_EQ(points, stereo() ? 599497U : 299747U);
  EXPECT_THAT(rejections_of(*sensor_), ElementsAre());
  EXPECT_EQ(imu[0].t_ns, 1'521'753'106'736'427'500);
  EXPECT_EQ(imu[1].t_ns, 1'521'753'106'741'427'700);
  EXPECT_EQ(imu[0].gyro_rad_per_s[0], -0.15840140594325761);
  EXPECT_EQ(imu[0].accel_m_per_s2[2], -2.5355232790697668);
  EXPECT_EQ(images[0].t_ns, 1'521'753'106'831'427'300);
  EXPECT_EQ(images[0].points[0].id, stereo() ? 10714 : 3142);
  EXPECT_EQ(images[0].points[0].v_px, stereo() ? 413.185333 : 208.064087);
  EXPECT_EQ(states[0].t_ns, imu[0].t_ns);
  EXPECT_EQ(states[0].p_IinG_m[0], 0.28393817205645194);
}

TEST_P(OpenVinsSim, TheStatesExplainTheInertialMeasurements) {
  // With the quaternion the wrong way round, gravity alone would be off by metres per second
  // squared.
  const auto imu = only<ImuSample>(all_);
  const auto states = only<StateSample>(all_);
  ASSERT_EQ(imu.size(), states.size());
  const auto vector = [](const std::array<double, 3>& v) {
    return Eigen::Vector3d(v[0], v[1], v[2]);
  };
  const auto rotation = [](const StateSample& state) {
    return Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(state.q_ItoG_xyzw.data()));
  };
  double accel2 = 0., gyro2 = 0.;
  for (std::size_t k = 1; k + 1 < states.size(); ++k) {
    const StateSample& before = states[k - 1];
    const StateSample& now = states[k];
    const StateSample& after = states[k + 1];
    const double dt = seconds_between(before.t_ns, after.t_ns);
    const Eigen::Vector3d a_IinG =
        (vector(after.v_IinG_m_per_s) - vector(before.v_IinG_m_per_s)) / dt;
    const Eigen::Vector3d f = rotation(now).conjugate() * (a_IinG + Eigen::Vector3d(0., 0., 9.81));
    const Eigen::AngleAxisd turn(rotation(before).conjugate() * rotation(after));
    accel2 += (vector(imu[k].accel_m_per_s2) - vector(now.accel_bias_m_per_s2) - f).squaredNorm();
    gyro2 += (vector(imu[k].gyro_rad_per_s) - vector(now.gyro_bias_rad_per_s) -
              turn.angle() / dt * turn.axis())
                 .squaredNorm();
  }
  const double n = 3. * static_cast<double>(states.size() - 2);
  EXPECT_LT(std::sqrt(accel2 / n), 0.05);
  EXPECT_LT(std::sqrt(gyro2 / n), 0.005);
}

INSTANTIATE_TEST_SUITE_P(Sets, OpenVinsSim, ::testing::Values("mono", "stereo"),
                         [](const auto& set) { return std::string(set.param); });

}  // namespace
}  // namespace viwo

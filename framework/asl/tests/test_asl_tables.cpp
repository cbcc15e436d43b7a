// IMU, feature, state and calibration tables of log folders: round trip.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "asl_tables.hpp"
#include "viwo/asl/asl.hpp"

namespace viwo::log {
namespace {

constexpr std::int64_t kStart = 1'700'000'000'000'000'001;

TEST_F(AslTables, ImuSamplesReadBackToTheSameBits) {
  std::vector<Measurement> written;
  for (std::int64_t k = 0; k < 200; ++k) {
    ImuSample imu;
    imu.t_ns = kStart + k * 5'000'003;
    fill(imu.gyro_rad_per_s);
    fill(imu.accel_m_per_s2);
    written.emplace_back(imu);
  }
  write_log(written);
  const ImuRecording read = read_asl_imu(folder_ / "log/imu0", {});
  EXPECT_TRUE(read.rejections.empty());
  ASSERT_EQ(read.samples.size(), written.size());
  for (std::size_t k = 0; k < written.size(); ++k) {
    const auto& expected = *written[k].get_if<ImuSample>();
    EXPECT_EQ(read.samples[k].t_ns, expected.t_ns);
    EXPECT_EQ(read.samples[k].gyro_rad_per_s, expected.gyro_rad_per_s);
    EXPECT_EQ(read.samples[k].accel_m_per_s2, expected.accel_m_per_s2);
  }
}

TEST_F(AslTables, FixesReadBackToTheSameBitsAndTheirSpacingsAreNoGaps) {
  std::vector<Measurement> written;
  for (std::int64_t k = 0; k < 100; ++k) {
    GnssSample fix;
    fix.t_ns = kStart + k * 400'000'003;
    fix.latitude_deg = std::remainder(any(), 90.);
    fix.longitude_deg = any();
    fix.altitude_m = any();
    fill(fix.covariance_ENU_m2);
    written.emplace_back(fix);
  }
  write_log(written);
  const GnssRecording read = read_asl_gnss(folder_ / "log/gnss0", 0.1);
  EXPECT_TRUE(read.rejections.empty());
  ASSERT_EQ(read.samples.size(), written.size());
  for (std::size_t k = 0; k < written.size(); ++k) {
    const auto& expected = *written[k].get_if<GnssSample>();
    EXPECT_EQ(read.samples[k].t_ns, expected.t_ns);
    EXPECT_EQ(read.samples[k].latitude_deg, expected.latitude_deg);
    EXPECT_EQ(read.samples[k].longitude_deg, expected.longitude_deg);
    EXPECT_EQ(read.samples[k].altitude_m, expected.altitude_m);
    EXPECT_EQ(read.samples[k].covariance_ENU_m2, expected.covariance_ENU_m2);
  }
}

TEST_F(AslTables, StatesReadBackToTheSameBits) {
  std::vector<Measurement> written;
  for (std::int64_t k = 0; k < 200; ++k) {
    StateSample state;
    state.t_ns = kStart + k * 5'000'003;
    fill(state.q_ItoG_xyzw);
    double norm = 0.;
    for (const double c : state.q_ItoG_xyzw) norm += c * c;
    for (double& c : state.q_ItoG_xyzw) c /= std::sqrt(norm);
    fill(state.p_IinG_m);
    fill(state.v_IinG_m_per_s);
    fill(state.gyro_bias_rad_per_s);
    fill(state.accel_bias_m_per_s2);
    written.emplace_back(state);
  }
  write_log(written);
  const auto table = folder_ / "log/state_groundtruth_estimate0";
  const auto read = read_asl_states(table, {}).samples;
  const auto poses = read_asl_poses(table, {}).samples;
  ASSERT_EQ(read.size(), written.size());
  ASSERT_EQ(poses.size(), written.size());
  for (std::size_t k = 0; k < written.size(); ++k) {
    const auto& expected = *written[k].get_if<StateSample>();
    EXPECT_EQ(read[k].t_ns, expected.t_ns);
    EXPECT_EQ(read[k].q_ItoG_xyzw, expected.q_ItoG_xyzw);
    EXPECT_EQ(read[k].p_IinG_m, expected.p_IinG_m);
    EXPECT_EQ(read[k].v_IinG_m_per_s, expected.v_IinG_m_per_s);
    EXPECT_EQ(read[k].gyro_bias_rad_per_s, expected.gyro_bias_rad_per_s);
    EXPECT_EQ(read[k].accel_bias_m_per_s2, expected.accel_bias_m_per_s2);
    EXPECT_EQ(poses[k].q_BtoW_xyzw, expected.q_ItoG_xyzw);
    EXPECT_EQ(poses[k].p_BinW_m, expected.p_IinG_m);
  }
}

TEST_F(AslTables, ImagesReadBackToTheSameBitsAlsoWithoutPoints) {
  std::vector<Measurement> written;
  std::uniform_int_distribution<int> count(0, 3);
  std::uniform_int_distribution<std::int64_t> jump(1, 1'000'000'000'000);
  for (std::int64_t k = 0; k < 60; ++k) {
    for (const int camera : {2, 0}) {  // not sorted: the order must survive
      FeatureSample image{kStart + k * 100'000'007, camera, {}};
      std::int64_t id = -5;
      for (int i = count(random_); i > 0; --i) {
        image.points.push_back({id += jump(random_), any(), any()});
      }
      written.emplace_back(image);
    }
  }
  write_log(written);
  const FeatureRecording read = read_asl_features(folder_ / "log/features0", {});
  EXPECT_TRUE(read.rejections.empty());
  ASSERT_EQ(read.samples.size(), written.size());
  int empty = 0;
  for (std::size_t k = 0; k < written.size(); ++k) {
    const auto& expected = *written[k].get_if<FeatureSample>();
    EXPECT_EQ(read.samples[k].t_ns, expected.t_ns);
    EXPECT_EQ(read.samples[k].camera, expected.camera);
    ASSERT_EQ(read.samples[k].points.size(), expected.points.size());
    empty += expected.points.empty() ? 1 : 0;
    for (std::size_t i = 0; i < expected.points.size(); ++i) {
      EXPECT_EQ(read.samples[k].points[i].id, expected.points[i].id);
      EXPECT_EQ(read.samples[k].points[i].u_px, expected.points[i].u_px);
      EXPECT_EQ(read.samples[k].points[i].v_px, expected.points[i].v_px);
    }
  }
  EXPECT_GT(empty, 10);
}

TEST_F(AslTables, CalibrationReadsBackToTheSameBits) {
  std::vector<Measurement> written;
  for (const char* name : {"r_1", "t_OtoI", "p_IinO_x"}) {
    written.emplace_back(CalibrationSample{kStart, name, any()});
  }
  written.emplace_back(CalibrationSample{kStart + 5'000'000'000'000, "r_1", any()});
  write_log(written);
  const auto read = read_asl_calibration(folder_ / "log/calibration_groundtruth0", 0.);
  EXPECT_TRUE(read.rejections.empty());
  ASSERT_EQ(read.samples.size(), written.size());
  for (std::size_t k = 0; k < written.size(); ++k) {
    const auto& expected = *written[k].get_if<CalibrationSample>();
    EXPECT_EQ(read.samples[k].t_ns, expected.t_ns);
    EXPECT_EQ(read.samples[k].name, expected.name);
    EXPECT_EQ(read.samples[k].value, expected.value);
  }
}

TEST_F(AslTables, CellsAtMidPointsReadBackAlsoAroundAGapAndWithUnevenStamps) {
  std::vector<EncoderSample> cells;
  std::uniform_int_distribution<std::int64_t> spacing(7'000'000, 13'000'000);
  std::int64_t t_ns = kStart;
  for (int k = 0; k < 100; ++k) {
    EncoderSample sample;
    sample.t_ns = t_ns += k == 50 ? 1'000'000'000 : spacing(random_);
    sample.n_drive = 4;
    sample.n_steer = 4;
    for (std::size_t i = 0; i < 4; ++i) {
      sample.drive_rad_per_s[i] = std::remainder(any(), 1e4);  // faster is no drive
      sample.steer_rad[i] = any();
    }
    cells.push_back(sample);
  }
  const LogLimits limits;
  make_cells(cells, limits.max_gap_s);
  write_log({cells.begin(), cells.end()});
  const auto read = read_asl_encoders(folder_ / "log/wheels0", {}).samples;
  ASSERT_EQ(read.size(), cells.size());
  for (std::size_t k = 0; k < cells.size(); ++k) {
    EXPECT_EQ(read[k].t_ns, cells[k].t_ns);
    EXPECT_EQ(read[k].begin_ns, cells[k].begin_ns);
    EXPECT_EQ(read[k].end_ns, cells[k].end_ns);
    EXPECT_EQ(read[k].drive_rad_per_s, cells[k].drive_rad_per_s);
    EXPECT_EQ(read[k].steer_rad, cells[k].steer_rad);
  }
}

TEST_F(AslTables, WritesTheDocumentedTables) {
  write_log({ImuSample{5, {1., 2., 3.}, {4., 5., 9.81}}, FeatureSample{5, 1, {{17, 310.25, 200.5}}},
             FeatureSample{6, 0, {}}, CalibrationSample{0, "r_1", 0.0254}});
  EXPECT_EQ(text_of(folder_ / "log/imu0/data.csv"),
            "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
            "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n5,1,2,3,4,5,9.81\n");
  EXPECT_EQ(text_of(folder_ / "log/features0/data.csv"),
            "timestamp_ns,camera,id,u [px],v [px]\n5,1,17,310.25,200.5\n6,0,,,\n");
  EXPECT_EQ(text_of(folder_ / "log/calibration_groundtruth0/data.csv"),
            "timestamp_ns,name,value\n0,r_1,0.0254\n");
  write_log({CalibrationSample{0, "r_1", 0.0254}});  // a later log replaces all tables
  EXPECT_FALSE(std::filesystem::exists(folder_ / "log/imu0"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "log/features0"));
}

TEST_F(AslTables, RefusesToWriteWhatWouldNotReadBack) {
  EXPECT_EQ(error_of([&] {
              write_log({PoseSample{}, StateSample{}});
            }),
            "reference poses and reference states share a table of a log: keep the sensors of one "
            "kind only");
  for (const char* name : {"", "a,b", " a", "a\n"}) {
    EXPECT_NE(error_of<std::logic_error>([&] {
                write_log({CalibrationSample{0, name, 1.}});
              }),
              "")
        << name;
  }
}

TEST_F(AslTables, ALogOfPosesIsNoLogOfStates) {
  write_log({PoseSample{7, {1., 2., 3.}, {0., 0., 0.6, 0.8}}});
  const auto table = folder_ / "log/state_groundtruth_estimate0";
  EXPECT_EQ(read_asl_poses(table, {}).samples.size(), 1U);
  EXPECT_EQ(
      error_of([&] { read_asl_states(table, {}); }),
      (table / "data.csv").string() +
          "  1 of 1 data rejected, allowed is a fraction of 0.1: row that cannot be read "
          "(1, first at data.csv:2  column 'v_RS_R_x [m s^-1]': 'nan' is not finite (the poses "
          "alone are read by asl_pose))");
}

TEST_F(AslTables, GathersThePointsOfAlternatingCameras) {
  const auto file = write("f.csv",
                          "timestamp_ns,camera,id,u,v\n10,1,7,1,2\n10,0,7,3,4\n10,1,8,5,6\n"
                          "10,0,,,\n20,0,,,\n20,0,9,7,8\n");
  const auto images = read_asl_features(file, {}).samples;
  ASSERT_EQ(images.size(), 3U);
  EXPECT_EQ(images[0].camera, 1);
  ASSERT_EQ(images[0].points.size(), 2U);
  EXPECT_EQ(images[0].points[1].id, 8);
  EXPECT_EQ(images[0].points[1].v_px, 6.);
  EXPECT_EQ(images[1].camera, 0);
  EXPECT_EQ(images[1].points.size(), 1U);
  EXPECT_EQ(images[2].t_ns, 20);
  EXPECT_EQ(images[2].points.size(), 1U);
}

}  // namespace
}  // namespace viwo::log

// IMU, feature, state and calibration tables of log folders: round trip, refusals.
#include <cmath>
#include <fstream>
#include <random>

#include <gmock/gmock.h>

#include "log_files.hpp"
#include "viwo/asl/asl.hpp"

namespace viwo::log {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::int64_t kStart = 1'700'000'000'000'000'001;

class AslTables : public InFolder {
 protected:
  /// The message for a table of this text, without the file's name.
  template <class Read>
  std::string refusal(const std::string& text, Read&& read) const {
    const auto file = write("t.csv", text);
    const std::string what = message_of([&] { read(file); });
    EXPECT_TRUE(what.starts_with(file.string())) << what;
    return what.substr(std::min(what.size(), file.string().size()));
  }

  void write_log(const std::vector<Measurement>& measurements) const {
    AslWriter writer(folder_ / "log");
    for (const Measurement& measurement : measurements) EXPECT_TRUE(writer.write(measurement));
    writer.close();
  }

  std::mt19937_64 random_{7};
  /// Of all magnitudes, so that texts of every length occur.
  double any() {
    std::uniform_real_distribution<double> mantissa(-1., 1.);
    std::uniform_int_distribution<int> exponent(-60, 20);
    return std::ldexp(mantissa(random_), exponent(random_));
  }
  template <std::size_t N>
  void fill(std::array<double, N>& values) {
    for (double& value : values) value = any();
  }
};

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

TEST_F(AslTables, ALastLineThatIsCutShortIsCountedAndTheRestIsRead) {
  std::string text = "timestamp_ns,drive_1 [rad/s],steer_1 [rad]\n";
  for (int k = 1; k <= 20; ++k) text += std::to_string(k * 10'000'000) + ",1,0.25\n";
  const auto file = write("wheels.csv", text + "210000000,1");
  const EncoderRecording read = read_asl_encoders(file, {});
  EXPECT_EQ(read.samples.size(), 20U);
  ASSERT_EQ(read.rejections.size(), 1U);
  EXPECT_EQ(read.rejections[0].reason, "last line cut short");
  EXPECT_EQ(read.rejections[0].count, 1);
  EXPECT_EQ(read.rejections[0].first, "wheels.csv:22");
  const EncoderRecording whole = read_asl_encoders(write("wheels.csv", text + "210000000,1\n"), {});
  ASSERT_EQ(whole.rejections.size(), 1U);
  EXPECT_EQ(whole.rejections[0].reason, "row that cannot be read");
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
  EXPECT_EQ(content(folder_ / "log/imu0/data.csv"),
            "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
            "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n5,1,2,3,4,5,9.81\n");
  EXPECT_EQ(content(folder_ / "log/features0/data.csv"),
            "timestamp_ns,camera,id,u [px],v [px]\n5,1,17,310.25,200.5\n6,0,,,\n");
  EXPECT_EQ(content(folder_ / "log/calibration_groundtruth0/data.csv"),
            "timestamp_ns,name,value\n0,r_1,0.0254\n");
  write_log({CalibrationSample{0, "r_1", 0.0254}});  // a later log replaces all tables
  EXPECT_FALSE(std::filesystem::exists(folder_ / "log/imu0"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "log/features0"));
}

TEST_F(AslTables, NameTheColumnOfAStateThatIsNotFinite) {
  const std::string header =
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
      "q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], "
      "b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], "
      "b_a_RS_S_z [m s^-2]\n";
  const auto message = [&](const std::string& row) {
    const auto file = folder_ / "states.csv";
    std::ofstream(file) << header << row;
    return message_of([&] { read_asl_states(file, {}); });
  };
  EXPECT_THAT(message("5,1,2,3,1,0,0,0,1,nan,nan,0,0,0,0,0,0\n"),
              HasSubstr("column 'v_RS_R_y [m s^-1]': 'nan' is not finite (the poses alone are read "
                        "by asl_pose)"));
  EXPECT_THAT(message("5,1,inf,3,1,0,0,0,1,nan,nan,0,0,0,0,0,0\n"),
              HasSubstr("column 'p_RS_R_y [m]': 'inf' is not finite)"));
}

TEST_F(AslTables, RefusesToWriteWhatWouldNotReadBack) {
  EXPECT_EQ(message_of([&] {
              write_log({PoseSample{}, StateSample{}});
            }),
            "reference poses and reference states share a table of a log: keep the sensors of one "
            "kind only");
  for (const char* name : {"", "a,b", " a", "a\n"}) {
    EXPECT_NE(message_of<std::logic_error>([&] {
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
      message_of([&] { read_asl_states(table, {}); }),
      (table / "data.csv").string() +
          "  1 of 1 data rejected, allowed is a fraction of 0.1: row that cannot be read "
          "(1, first at data.csv:2  column 'v_RS_R_x [m s^-1]': 'nan' is not finite (the poses "
          "alone are read by asl_pose))");
}

constexpr const char* kImuHeader =
    "timestamp,w_RS_S_x,w_RS_S_y,w_RS_S_z,a_RS_S_x,a_RS_S_y,a_RS_S_z\n";

TEST_F(AslTables, RefusesBrokenImuTables) {
  const auto read = [](const auto& file) { read_asl_imu(file, {}); };
  const std::string header = kImuHeader;
  EXPECT_EQ(refusal("timestamp,w_RS_S_x,w_RS_S_y,w_RS_S_z,a_RS_x,a_RS_S_y,a_RS_S_z\n", read),
            ":1  no column 'a_RS_S_x [m s^-2]' - there are: timestamp, w_RS_S_x, w_RS_S_y, "
            "w_RS_S_z, a_RS_x, a_RS_S_y, a_RS_S_z");
  EXPECT_EQ(refusal("timestamp,w_RS_S_x [deg s^-1]\n", read),
            ":1  column 'w_RS_S_x [deg s^-1]' has another unit than 'w_RS_S_x [rad s^-1]'");
  EXPECT_EQ(
      refusal(header + "1,2,3,4,5,6,7\n2,2,3,4,5,6,fast\n", read),
      "  1 of 2 data rejected, allowed is a fraction of 0.1: row that cannot be read (1, first "
      "at t.csv:3  column 'a_RS_S_z': 'fast' is not a number)");
  EXPECT_EQ(
      refusal(header + "1,2,3,4,5,6\n", read),
      "  1 of 1 data rejected, allowed is a fraction of 0.1: row that cannot be read (1, first "
      "at t.csv:2  6 fields where the header has 7)");
  EXPECT_EQ(
      refusal(header + "1.5,2,3,4,5,6,7\n", read),
      "  1 of 1 data rejected, allowed is a fraction of 0.1: row that cannot be read (1, first "
      "at t.csv:2  column 'timestamp': '1.5' is not an integer)");
  EXPECT_EQ(refusal(header, read), "  holds no data after its header");
  EXPECT_EQ(refusal("", read), ":1  the file is empty");
}

TEST_F(AslTables, ImuRowsThatAreNotFiniteOrGoBackAreCounted) {
  std::string text = kImuHeader;
  for (int k = 0; k < 40; ++k) text += std::to_string(5'000'000 * k) + ",0,0,0,0,0,9.81\n";
  text += "100,0,0,0,0,0,9.81\n200000000,nan,0,0,0,0,9.81\n";  // lines 42 and 43
  text += "900000000,0,0,0,0,0,9.81\n";
  const ImuRecording read = read_asl_imu(write("imu.csv", text), {});
  EXPECT_EQ(read.samples.size(), 41U);
  ASSERT_EQ(read.rejections.size(), 3U);
  EXPECT_EQ(read.rejections[0].reason, "stamp not after the previous one");
  EXPECT_EQ(read.rejections[0].first, "imu.csv:42");
  EXPECT_EQ(read.rejections[1].reason, "value that is not finite");
  EXPECT_EQ(read.rejections[1].first, "imu.csv:43");
  EXPECT_EQ(read.rejections[2].reason, "gap longer than 0.2 s");
}

TEST_F(AslTables, ARowThatCannotBeReadIsCountedAndTheRestIsRead) {
  std::string text = kImuHeader;
  for (int k = 0; k < 40; ++k) {
    text += std::to_string(5'000'000 * k) + (k == 20 ? ",0,0x1,0,0,0,9.81\n" : ",0,0,0,0,0,9.81\n");
  }
  text += "200000000,0,0\n200000001,0,0,0,0,0,9.81\n";
  const ImuRecording read = read_asl_imu(write("imu.csv", text), {});
  EXPECT_EQ(read.samples.size(), 40U);
  ASSERT_EQ(read.rejections.size(), 1U);
  EXPECT_EQ(read.rejections[0].reason, "row that cannot be read");
  EXPECT_EQ(read.rejections[0].count, 2);
  EXPECT_EQ(read.rejections[0].first, "imu.csv:22  column 'w_RS_S_y': '0x1' is not a number");
}

TEST_F(AslTables, ReadsGzipAndRefusesATruncatedOne) {
  std::string text = kImuHeader;
  for (std::int64_t k = 0; k < 5000; ++k) {
    text += std::to_string(5'000'000 * k) + ",0," + std::to_string(any()) + ",0,0,0,9.81\n";
  }
  const auto file = write_gz("imu.csv.gz", text);
  EXPECT_EQ(read_asl_imu(file, {}).samples.size(), 5000U);
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  const std::string what = message_of([&] { read_asl_imu(file, {}); });
  EXPECT_THAT(what, ::testing::HasSubstr("the gzip data end early: the file is truncated"));
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

TEST_F(AslTables, PointsThatCannotBeUsedAreCountedByRow) {
  std::string text = "timestamp_ns,camera,id,u,v\n";
  for (int i = 0; i < 96; ++i) text += "10,0," + std::to_string(i) + ",1,2\n";
  text += "10,0,5,1,2\n10,0,200,nan,2\n9,0,201,1,2\n10,1,5,1,2\n";  // lines 98 to 101
  LogLimits limits;
  limits.max_rejected_fraction = 0.03;  // of 100 rows, not of one image
  const FeatureRecording read = read_asl_features(write("f.csv", text), limits);
  ASSERT_EQ(read.samples.size(), 2U);
  EXPECT_EQ(read.samples[0].points.size(), 96U);
  std::vector<std::string> counted;
  for (const auto& r : read.rejections) {
    counted.push_back(r.reason + " | " + std::to_string(r.count) + " | " + r.first);
  }
  EXPECT_THAT(counted, ElementsAre("point whose id the image already has | 1 | f.csv:98",
                                   "value that is not finite | 1 | f.csv:99",
                                   "stamp not after the previous one | 1 | f.csv:100"));
  limits.max_rejected_fraction = 0.029;
  EXPECT_THAT(message_of([&] { read_asl_features(folder_ / "f.csv", limits); }),
              ::testing::HasSubstr("3 of 100 data rejected"));
}

TEST_F(AslTables, RefusesBrokenFeatureAndCalibrationTables) {
  const auto features = [](const auto& file) { read_asl_features(file, {}); };
  const std::string header = "timestamp_ns,camera,id,u,v\n";
  EXPECT_EQ(refusal("timestamp_ns,camra,id,u,v\n", features),
            ":1  no column 'camera' - did you mean 'camra'?");
  EXPECT_EQ(
      refusal(header + "1,-1,1,2,3\n", features),
      "  1 of 1 data rejected, allowed is a fraction of 0.1: row that cannot be read (1, first "
      "at t.csv:2  column 'camera': '-1' is no camera: they are counted from 0 to 63)");
  EXPECT_EQ(
      refusal(header + "1,64,1,2,3\n", features),
      "  1 of 1 data rejected, allowed is a fraction of 0.1: row that cannot be read (1, first "
      "at t.csv:2  column 'camera': '64' is no camera: they are counted from 0 to 63)");
  EXPECT_EQ(
      refusal(header + "1,0,1,,3\n", features),
      "  1 of 1 data rejected, allowed is a fraction of 0.1: row that cannot be read (1, first "
      "at t.csv:2  column 'u': '' is not a number)");
  EXPECT_EQ(
      refusal(header + "1,0,,2,3\n", features),
      "  1 of 1 data rejected, allowed is a fraction of 0.1: row that cannot be read (1, first "
      "at t.csv:2  column 'id': '' is not an integer)");
  const auto calibration = [](const auto& file) { read_asl_calibration(file, 0.1); };
  EXPECT_EQ(refusal("timestamp_ns,name\n", calibration),
            ":1  no column 'value' - there are: timestamp_ns, name");
  EXPECT_EQ(
      refusal("timestamp_ns,name,value\n0,,1\n", calibration),
      "  1 of 1 data rejected, allowed is a fraction of 0.1: row that cannot be read (1, first "
      "at t.csv:2  column 'name': is empty)");
  EXPECT_EQ(refusal("timestamp_ns,name,value\n5,r_1,1\n4,r_1,1\n", calibration),
            "  1 of 2 data rejected, allowed is a fraction of 0.1: stamp not after the previous "
            "one (1, first at t.csv:3)");
}

TEST_F(AslTables, OneStampFarAheadIsCountedAndTheRestIsRead) {
  std::string text = kImuHeader;
  for (int k = 0; k < 40; ++k) {
    const std::int64_t t_ns = k == 20 ? 4'000'000'000'000'000'000 : 5'000'000 * k;
    text += std::to_string(t_ns) + ",0,0,0,0,0,9.81\n";
  }
  const ImuRecording read = read_asl_imu(write("imu.csv", text), {});
  EXPECT_EQ(read.samples.size(), 39U);
  ASSERT_EQ(read.rejections.size(), 1U);
  EXPECT_EQ(read.rejections[0].reason, "stamp far ahead of the previous one");
  EXPECT_EQ(read.rejections[0].first, "imu.csv:22");
}

TEST_F(AslTables, DataThatAreFarApartAreReadFromTheThirdOn) {
  std::string text = kImuHeader;
  for (int k = 0; k < 40; ++k) text += std::to_string(60'000'000'000 * k) + ",0,0,0,0,0,9.81\n";
  const ImuRecording read = read_asl_imu(write("imu.csv", text), {});
  EXPECT_EQ(read.samples.size(), 39U);
}

}  // namespace
}  // namespace viwo::log

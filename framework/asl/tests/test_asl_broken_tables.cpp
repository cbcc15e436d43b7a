// IMU, feature, state and calibration tables of log folders that are broken: what is refused, and
// what is counted.
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "asl_tables.hpp"
#include "viwo/asl/asl.hpp"

namespace viwo::log {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kImuHeader =
    "timestamp,w_RS_S_x,w_RS_S_y,w_RS_S_z,a_RS_S_x,a_RS_S_y,a_RS_S_z\n";

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

TEST_F(AslTables, NameTheColumnOfAStateThatIsNotFinite) {
  const std::string header =
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
      "q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], "
      "b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], "
      "b_a_RS_S_z [m s^-2]\n";
  const auto message = [&](const std::string& row) {
    const auto file = folder_ / "states.csv";
    std::ofstream(file) << header << row;
    return error_of([&] { read_asl_states(file, {}); });
  };
  EXPECT_THAT(message("5,1,2,3,1,0,0,0,1,nan,nan,0,0,0,0,0,0\n"),
              HasSubstr("column 'v_RS_R_y [m s^-1]': 'nan' is not finite (the poses alone are read "
                        "by asl_pose)"));
  EXPECT_THAT(message("5,1,inf,3,1,0,0,0,1,nan,nan,0,0,0,0,0,0\n"),
              HasSubstr("column 'p_RS_R_y [m]': 'inf' is not finite)"));
}

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
  const std::string what = error_of([&] { read_asl_imu(file, {}); });
  EXPECT_THAT(what, ::testing::HasSubstr("the gzip data end early: the file is truncated"));
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
  EXPECT_THAT(error_of([&] { read_asl_features(folder_ / "f.csv", limits); }),
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

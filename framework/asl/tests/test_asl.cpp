// Log folders: reading, rejecting, writing.
#include <memory>
#include <random>

#include <gmock/gmock.h>

#include "log_files.hpp"
#include "rejections.hpp"
#include "viwo/asl/asl.hpp"

namespace viwo::log {

/// As a plugin of somebody else has it.
struct RangeSample {
  std::int64_t t_ns = 0;
  double range_m = 0.;
};

}  // namespace viwo::log

VIWO_SAMPLE(viwo::log::RangeSample, "range", 1, &viwo::log::RangeSample::t_ns,
            &viwo::log::RangeSample::range_m);

namespace viwo::log {
namespace {

using ::testing::ElementsAre;

class AslTest : public InFolder {};

TEST_F(AslTest, ReadsEncoderRatesFromAFileOrItsFolder) {
  const auto file = write("wheels0/data.csv",
                          "timestamp_ns,drive_1 [rad/s],drive_2 [rad/s],steer_1 [rad]\n"
                          "1000,1,2,0.5\n2000,3,4,0.25\n");
  for (const auto& path : {file, folder_ / "wheels0"}) {
    const EncoderRecording read = read_asl_encoders(path, {});
    ASSERT_EQ(read.samples.size(), 2U);
    EXPECT_EQ(read.samples[0].n_drive, 2);
    EXPECT_EQ(read.samples[0].n_steer, 1);
    EXPECT_EQ(read.samples[1].t_ns, 2000);
    EXPECT_EQ(read.samples[1].begin_ns, 1500);
    EXPECT_EQ(read.samples[1].drive_rad_per_s[1], 4.);
    EXPECT_EQ(read.samples[1].steer_rad[0], 0.25);
    EXPECT_TRUE(read.rejections.empty());
  }
}

TEST_F(AslTest, AFolderGivesItsTablePlainOrGzippedButNotBoth) {
  const std::string text = "timestamp_ns,drive_1 [rad/s]\n1000,1\n2000,3\n";
  std::filesystem::create_directories(folder_ / "wheels0");
  write_gz("wheels0/data.csv.gz", text);
  const EncoderRecording read = read_asl_encoders(folder_ / "wheels0", {});
  ASSERT_EQ(read.samples.size(), 2U);
  EXPECT_EQ(read.samples[1].drive_rad_per_s[0], 3.);
  write("wheels0/data.csv", text);
  EXPECT_EQ(error_of([&] { read_asl_encoders(folder_ / "wheels0", {}); }),
            (folder_ / "wheels0").string() +
                "  holds both data.csv and data.csv.gz: name the file "
                "that is meant, or remove the other");
  EXPECT_EQ(read_asl_encoders(folder_ / "wheels0/data.csv.gz", {}).samples.size(), 2U);
}

TEST_F(AslTest, ReadsAnglesAndTheEurocStampColumn) {
  const auto file =
      write("w.csv", "#timestamp [ns],drive_1 [rad]\n0,1\n500000000,2\n1000000000,5\n");
  EncoderRecordingOptions options;
  options.drive_is_angle = true;
  options.limits.max_gap_s = 1.;
  const EncoderRecording read = read_asl_encoders(file, options);
  ASSERT_EQ(read.samples.size(), 2U);
  EXPECT_EQ(read.samples[1].t_ns, 750'000'000);
  EXPECT_EQ(read.samples[1].drive_rad_per_s[0], 6.);
  EXPECT_EQ(error_of([&] { read_asl_encoders(file, {}); }),
            file.string() +
                ":1  column 'drive_1 [rad]' has another unit than 'drive_1 [rad/s]': it is read "
                "with drive_input: angle");
}

TEST_F(AslTest, CountsWhatItDropsWithReasonAndFirstPlace) {
  std::string text = "timestamp_ns,drive_1\n";
  for (int i = 0; i < 30; ++i) text += std::to_string(1'000'000 * i) + ",1\n";
  text += "29000000,1\n28000000,1\n30000000,nan\n31000000,inf\n500000000,1\n";  // lines 32 to 36
  const auto file = write("w.csv", text);
  EncoderRecordingOptions options;
  options.limits.max_rejected_fraction = 0.12;  // 4 of 35
  const EncoderRecording read = read_asl_encoders(file, options);
  EXPECT_EQ(read.samples.size(), 31U);
  EXPECT_THAT(testing::rejections_of(read.rejections),
              ElementsAre("stamp not after the previous one | 2 | w.csv:32",
                          "value that is not finite | 2 | w.csv:34",
                          "gap longer than 0.2 s | 1 | w.csv:36"));
  options.limits.max_rejected_fraction = 0.11;
  EXPECT_EQ(error_of([&] { read_asl_encoders(file, options); }),
            file.string() +
                "  4 of 35 data rejected, allowed is a fraction of 0.11: stamp not after the "
                "previous one (2, first at w.csv:32); value that is not finite (2, first at "
                "w.csv:34)");
}

TEST_F(AslTest, RefusesTablesWithoutTheirColumnsOrData) {
  const auto message = [&](const std::string& text) {
    const auto file = write("w.csv", text);
    const std::string what = error_of([&] { read_asl_encoders(file, {}); });
    return what.substr(std::min(what.size(), file.string().size()));
  };
  EXPECT_EQ(message("time,drive_1\n"), ":1  no column 'timestamp_ns' - there are: time, drive_1");
  EXPECT_EQ(message("timestamp_ns,drve_1 [rad/s]\n"),
            ":1  no column 'drive_1 [rad/s]' - did you mean 'drve_1 [rad/s]'?");
  EXPECT_EQ(message("timestamp_ns,drive_1,drive_3\n"),
            ":1  no column 'drive_2 [rad/s]' - there are: timestamp_ns, drive_1, drive_3");
  EXPECT_EQ(message("timestamp_ns,drive_1\n"), "  holds no data after its header");
  EXPECT_EQ(message("timestamp_ns,drive_1\n1,x\n"),
            "  1 of 1 data rejected, allowed is a fraction of 0.1: row that cannot be read (1, "
            "first at w.csv:2  column 'drive_1': 'x' is not a number)");
  std::string nine = "timestamp_ns";
  for (int i = 1; i <= 9; ++i) nine += ",drive_" + std::to_string(i);
  EXPECT_EQ(message(nine + "\n"), ":1  9 columns 'drive_...', at most 8 are possible");
}

TEST_F(AslTest, OneAngleIsTooLittleForARate) {
  const auto file = write("w.csv", "timestamp_ns,drive_1\n1,1\n");
  EncoderRecordingOptions options;
  options.drive_is_angle = true;
  EXPECT_EQ(error_of([&] { read_asl_encoders(file, options); }),
            file.string() + "  has too few readings without a gap for a rate");
  const auto slow = write("slow.csv", "timestamp_ns,drive_1\n1,1\n800000001,2\n1600000001,3\n");
  options.limits.max_gap_s = 0.2;
  EXPECT_EQ(error_of([&] { read_asl_encoders(slow, options); }),
            slow.string() +
                "  has too few readings without a gap for a rate: they are 0.8 s apart, and "
                "max_gap_s is 0.2");
}

TEST_F(AslTest, ReadsEurocGroundTruthAndRejectsWrongQuaternions) {
  const auto file = write("gt.csv",
                          "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], "
                          "q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1]\n"
                          "5,1,2,3,0.8,0,0,0.6,9\n6,1,2,3,0.8,0,0,0.7,9\n7,1,2,3,1,0,0,0,9\n");
  LogLimits limits;
  limits.max_rejected_fraction = 0.5;
  const PoseRecording read = read_asl_poses(file, limits);
  ASSERT_EQ(read.samples.size(), 2U);
  EXPECT_EQ(read.samples[0].p_BinW_m, (std::array{1., 2., 3.}));
  EXPECT_EQ(read.samples[0].q_BtoW_xyzw, (std::array{0., 0., 0.6, 0.8}));
  EXPECT_THAT(testing::rejections_of(read.rejections),
              ElementsAre("quaternion that is not of unit norm | 1 | gt.csv:3"));
}

std::vector<Measurement> some_measurements() {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(-3., 3.);
  std::vector<Measurement> out;
  for (std::int64_t k = 0; k < 100; ++k) {
    EncoderSample sample;
    sample.t_ns = 1'700'000'000'000'000'000 + k * 10'000'000;
    sample.n_drive = 4;
    sample.n_steer = 3;
    for (std::size_t i = 0; i < 4; ++i) sample.drive_rad_per_s[i] = uniform(random) * 1e-5;
    for (std::size_t i = 0; i < 3; ++i) sample.steer_rad[i] = uniform(random);
    out.emplace_back(sample);
    PoseSample pose;
    pose.t_ns = sample.t_ns;
    for (double& value : pose.p_BinW_m) value = uniform(random);
    const double angle = uniform(random);
    pose.q_BtoW_xyzw = {0., 0., std::sin(0.5 * angle), std::cos(0.5 * angle)};
    out.emplace_back(pose);
  }
  return out;
}

TEST_F(AslTest, AWrittenLogReadsBackToTheSameBits) {
  const auto written = some_measurements();
  AslWriter writer(folder_ / "log");
  for (const Measurement& measurement : written) EXPECT_TRUE(writer.write(measurement));
  writer.close();
  const auto wheels = read_asl_encoders(folder_ / "log" / "wheels0", {}).samples;
  const auto poses = read_asl_poses(folder_ / "log" / "state_groundtruth_estimate0", {}).samples;
  ASSERT_EQ(wheels.size(), 100U);
  ASSERT_EQ(poses.size(), 100U);
  for (std::size_t i = 0; i < 100; ++i) {
    const auto& sample = *written[2 * i].get_if<EncoderSample>();
    EXPECT_EQ(wheels[i].t_ns, sample.t_ns);
    EXPECT_EQ(wheels[i].n_steer, 3);
    EXPECT_EQ(wheels[i].drive_rad_per_s, sample.drive_rad_per_s);
    EXPECT_EQ(wheels[i].steer_rad, sample.steer_rad);
    const auto& pose = *written[2 * i + 1].get_if<PoseSample>();
    EXPECT_EQ(poses[i].t_ns, pose.t_ns);
    EXPECT_EQ(poses[i].p_BinW_m, pose.p_BinW_m);
    EXPECT_EQ(poses[i].q_BtoW_xyzw, pose.q_BtoW_xyzw);
  }
}

TEST_F(AslTest, ALogThatIsNotClosedLeavesNothing) {
  {
    AslWriter writer(folder_ / "log");
    for (const Measurement& measurement : some_measurements()) {
      EXPECT_TRUE(writer.write(measurement));
    }
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "log"));
}

TEST_F(AslTest, ALogThatIsNotClosedLeavesTheEarlierOne) {
  const auto write_log = [&](std::int64_t t_ns) {
    auto writer = std::make_unique<AslWriter>(folder_ / "log");
    PoseSample pose;
    pose.t_ns = t_ns;
    EXPECT_TRUE(writer->write(pose));
    return writer;
  };
  write_log(7)->close();
  const auto table = folder_ / "log/state_groundtruth_estimate0/data.csv";
  const std::string earlier = text_of(table);
  write_log(8).reset();
  EXPECT_EQ(text_of(table), earlier);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "log/part"));
  // What a command that was killed leaves is replaced.
  write("log/part/wheels0/data.csv", "half");
  write_log(8)->close();
  EXPECT_NE(text_of(table), earlier);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "log/part"));
}

TEST_F(AslTest, WritesTheDocumentedColumns) {
  AslWriter writer(folder_ / "log");
  EncoderSample sample;
  sample.t_ns = 7;
  sample.n_drive = 2;
  sample.n_steer = 1;
  sample.drive_rad_per_s = {0.1, -2.};
  EXPECT_TRUE(writer.write(sample));
  PoseSample pose;
  pose.t_ns = 8;
  pose.p_BinW_m = {1., 2., 0.5};
  EXPECT_TRUE(writer.write(pose));
  writer.close();
  EXPECT_EQ(text_of(folder_ / "log/wheels0/data.csv"),
            "timestamp_ns,drive_1 [rad/s],drive_2 [rad/s],steer_1 [rad]\n7,0.1,-2,0\n");
  EXPECT_EQ(text_of(folder_ / "log/state_groundtruth_estimate0/data.csv"),
            "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], "
            "q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], "
            "b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], "
            "b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]\n"
            "8,1,2,0.5,1,0,0,0,nan,nan,nan,nan,nan,nan,nan,nan,nan\n");
}

TEST_F(AslTest, SaysThatAForeignKindOfSamplesHasNoTable) {
  AslWriter writer(folder_ / "log");
  EXPECT_FALSE(writer.write(RangeSample{7, 1.5}));
  writer.close();
  const std::filesystem::directory_iterator all(folder_ / "log");
  EXPECT_EQ(std::distance(begin(all), end(all)), 1);  // what says that it is one
}

TEST_F(AslTest, ReplacesAnEarlierLogCompletely) {
  for (const Measurement& first : some_measurements()) {
    AslWriter writer(folder_ / "log");
    EXPECT_TRUE(writer.write(first));
    writer.close();
    if (first.get_if<PoseSample>() != nullptr) break;
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "log" / "wheels0"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "log" / "state_groundtruth_estimate0"));
}

TEST_F(AslTest, RefusesAFolderThatHoldsSomethingElseAndLeavesItAlone) {
  const std::string log = (folder_ / "log").string();
  write("log/wheels0/data.csv", "mine");
  EXPECT_EQ(error_of([&] { AslWriter{log}; }),
            log +
                "  already holds wheels0, which is no part of a log written here: choose an "
                "empty folder");
  write("log/viwo_log.txt", "");
  write("log/wheels0/notes.txt", "mine");
  EXPECT_EQ(error_of([&] { AslWriter{log}; }),
            log +
                "  already holds wheels0/notes.txt, which is no part of a log written here: "
                "choose an empty folder");
  std::filesystem::remove(folder_ / "log/wheels0/notes.txt");
  write("log/thesis.tex", "mine");
  EXPECT_EQ(error_of([&] { AslWriter{log}; }),
            log +
                "  already holds thesis.tex, which is no part of a log written here: choose an "
                "empty folder");
  EXPECT_EQ(text_of(folder_ / "log/wheels0/data.csv"), "mine");
  const auto file = write("file", "mine");
  EXPECT_EQ(error_of([&] { AslWriter{file}; }), file.string() + "  is a file, not a folder");
}

}  // namespace
}  // namespace viwo::log

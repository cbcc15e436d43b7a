// Files that were made to take time, memory, or what lies beside the recording.
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "log_files.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/asl/asl_images.hpp"
#include "viwo/log/table_reader.hpp"

namespace viwo::log {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class HostileFile : public InFolder {};

/// Took a minute: each column was compared with all before it.
TEST_F(HostileFile, AHeaderHasAThousandColumnsAndNotAHundredThousand) {
  const auto header = [](int n) {
    std::string text = "timestamp_ns";
    for (int i = 1; i < n; ++i) text += ",c" + std::to_string(i);
    return text + "\n";
  };
  EXPECT_EQ(TableReader(write("a.csv", header(4096))).columns().size(), 4096U);
  const auto file = write("b.csv", header(90'000));
  const std::string what = file.string() + ":1  90000 columns, at most 4096 are read";
  EXPECT_EQ(error_of([&] { TableReader reader(file); }), what);
  EXPECT_EQ(error_of([&] { TableReader reader(file, TableLayout{}); }), what);
}

/// 1.5 MB became 6 GB of samples.
TEST_F(HostileFile, GzipDataDoNotBecomeAThousandTimesAsLong) {
  std::string text = "timestamp_ns,name,value\n";
  const std::string row = "1,r_1,0\n";
  for (int i = 0; i < 4'000'000; ++i) text += row;
  const auto file = write_gz("data.csv.gz", text);
  EXPECT_THAT(error_of([&] { read_asl_calibration(file, 1.); }),
              HasSubstr("  the gzip data become more than 100 times as long, as those of no "
                        "recording do"));
}

TEST_F(HostileFile, GzipDataOfARobotThatRestsAreRead) {
  std::string text = "timestamp_ns,drive_1 [rad/s],drive_2 [rad/s],drive_3 [rad/s]\n";
  for (int i = 0; i < 700'000; ++i) {
    text += std::to_string(1'700'000'000'000'000'000 + 5'000'000LL * i) + ",0,0,0\n";
  }
  ASSERT_GT(text.size(), 16U << 20U);
  const auto file = write_gz("data.csv.gz", text);
  EXPECT_EQ(read_asl_encoders(file, {}).samples.size(), 700'000U);
}

TEST_F(HostileFile, ACalibrationHasANameOnceAtAStamp) {
  const auto file = write("c.csv", "timestamp_ns,name,value\n1,r,1\n1,s,2\n1,r,3\n2,r,4\n");
  const CalibrationRecording read = read_asl_calibration(file, 0.5);
  EXPECT_EQ(read.samples.size(), 3U);
  ASSERT_EQ(read.rejections.size(), 1U);
  EXPECT_EQ(read.rejections[0].reason, "name that the stamp already has");
  EXPECT_EQ(read.rejections[0].first, "c.csv:4");
}

TEST_F(HostileFile, ImagesAreThoseOfTheRecording) {
  fs::create_directories(folder_ / "cam0/data");
  const auto outside = write("secret.png", "x");
  for (const std::string& name :
       {outside.string(), std::string("../../secret.png"), std::string("a/../../../secret.png")}) {
    write("cam0/data.csv", "#timestamp [ns],filename\n1," + name + "\n");
    const std::vector<fs::path> folders{folder_ / "cam0"};
    EXPECT_THAT(error_of([&] { read_asl_images(folders, {}); }),
                HasSubstr(" leads out of the folder of the images"))
        << name;
  }
}

}  // namespace
}  // namespace viwo::log

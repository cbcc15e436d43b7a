// Bad rows of a log are counted and reported; bad logs are refused. The log is one that the program
// wrote itself.
#include <cstdio>
#include <functional>
#include <sstream>

#include <zlib.h>

#include "support.hpp"

namespace viwo {
namespace {

constexpr const char* kWheels = "log/wheels0/data.csv";

class LogTest : public CommandLineTest {
 protected:
  void SetUp() override {
    write("run.yaml", kRun);
    expect_done({"simulate", "run.yaml", "--out", "log"});
    std::istringstream text(read(kWheels));
    for (std::string line; std::getline(text, line);) lines_.push_back(line);
    ASSERT_EQ(lines_.size(), static_cast<std::size_t>(kRunSamples) + 1);
    const std::string robot = kRun.substr(kRun.find("      type: four_wis_wid"));
    write("log.yaml",
          "sensors:\n"
          "  wheels0: {type: asl_encoders, path: log/wheels0}\n"
          "  truth: {type: asl_pose, path: log/state_groundtruth_estimate0}\n"
          "kinematics:\n" +
              robot.substr(0, robot.find("    duration_s")));
  }

  /// Line `number` of the log, counted from 1 as in messages; line 1 is the header.
  std::string& line(std::size_t number) { return lines_.at(number - 1); }

  /// Puts `text` into field `index` (0: the stamp) of a line.
  void set_field(std::size_t number, int index, const std::string& text) {
    std::string& row = line(number);
    std::size_t begin = 0;
    for (int i = 0; i < index; ++i) begin = row.find(',', begin) + 1;
    row.replace(begin, row.find(',', begin) - begin, text);
  }

  std::string text() const {
    std::string all;
    for (const std::string& row : lines_) all += row + "\n";
    return all;
  }

  void refuse(const std::string& message) const {
    write(kWheels, text());
    refuse_as_it_is(message);
  }

  void refuse_as_it_is(const std::string& message) const {
    expect_refused({"run", "log.yaml", "--out", "out"},
                   "log.yaml:2:12  sensors.wheels0 (asl_encoders): TMP/" + message);
  }

  /// The run is done; its summary and its output tell what was rejected.
  void expect_counted(int count, const std::string& reason, std::size_t first,
                      const std::string& what = "") const {
    write(kWheels, text());
    const Outcome outcome = expect_done({"run", "log.yaml", "--out", "out"});
    const std::string where = "data.csv:" + std::to_string(first) + what;
    EXPECT_NE(outcome.out.find("\nwheels0: " + std::to_string(count) + " x " + reason +
                               ", first at " + where + "\n"),
              std::string::npos)
        << outcome.out;
    const nlohmann::json expected = {
        {"wheels0", {{{"count", count}, {"first", where}, {"reason", reason}}}}};
    EXPECT_EQ(summary().at("rejected_measurements"), expected);
    EXPECT_NE(read("out/report.html").find(reason), std::string::npos);
  }

  std::vector<std::string> lines_;
};

TEST_F(LogTest, OfTheSimulatorGivesTheSameErrorsAsTheSimulator) {
  expect_done({"run", "run.yaml", "--out", "direct"});
  expect_done({"run", "log.yaml", "--out", "out"});
  const auto direct = summary("direct").at("accuracy");
  const auto read_back = summary("out").at("accuracy");
  EXPECT_GT(direct.at("end").at("m").get<double>(), 0.);
  EXPECT_EQ(read_back, direct);
  EXPECT_EQ(read("out/trajectory.tum"), read("direct/trajectory.tum"));
  EXPECT_TRUE(summary("out").at("rejected_measurements").empty());
}

TEST_F(LogTest, OfJointsThatAreMountedWronglyIsPutRightByTheInverse) {
  expect_done({"run", "log.yaml", "--out", "right"});
  expect_done({"simulate", "run.yaml", "--out", "log", "--set",
               "sensors.sim.drive_scale=[-1, 2, 0.5, 1]", "--set",
               "sensors.sim.drive_channel=[2, 1, 3, 4]", "--set",
               "sensors.sim.steer_scale=[1, 1, -1, 1]"});
  const Outcome wrong = viwo({"run", "log.yaml", "--out", "out"});
  EXPECT_EQ(wrong.code, 1);
  EXPECT_NE(wrong.out.find("the wheels contradict each other grossly"), std::string::npos);
  const auto end_m = [&](const char* folder) -> double {
    return summary(folder)["accuracy"]["end"]["m"];
  };
  EXPECT_GT(end_m("out"), 10. * end_m("right")) << "a wrong one is seen";
  // The first channel of the log is twice the second drive, the second the first one backwards.
  expect_done({"run", "log.yaml", "--out", "out", "--set",
               "sensors.wheels0.drive_scale=[0.5, -1, 2, 1]", "--set",
               "sensors.wheels0.drive_channel=[2, 1, 3, 4]", "--set",
               "sensors.wheels0.steer_scale=[1, 1, -1, 1]"});
  EXPECT_EQ(read("out/trajectory.tum"), read("right/trajectory.tum"));
  std::filesystem::remove_all(at("out"));
  expect_refused({"run", "log.yaml", "--out", "out", "--set", "sensors.wheels0.drive_scale=[1, 1]"},
                 "--set sensors.wheels0.drive_scale  sensors.wheels0.drive_scale: has 2 "
                 "numbers for 4 drive channels of the log: one for each, in their order");
}

TEST_F(LogTest, CanBeCompressed) {
  const gzFile file = gzopen(at(kWheels).c_str(), "wb");
  const std::string all = text();
  ASSERT_GT(gzwrite(file, all.data(), static_cast<unsigned>(all.size())), 0);
  ASSERT_EQ(gzclose(file), Z_OK);
  expect_done({"run", "log.yaml", "--out", "out"});
  const std::string bytes = read(kWheels);
  std::filesystem::remove_all(at("out"));
  write(kWheels, bytes.substr(0, bytes.size() / 2));
  const Outcome truncated = viwo({"run", "log.yaml", "--out", "out"});
  EXPECT_EQ(truncated.code, 2);
  EXPECT_TRUE(truncated.err.ends_with("  the gzip data end early: the file is truncated\n"))
      << truncated.err;
  EXPECT_FALSE(std::filesystem::exists(at("out")));
}

TEST_F(LogTest, MustExist) {
  std::filesystem::remove(at(kWheels));
  refuse_as_it_is("log/wheels0/data.csv  cannot be read: No such file or directory");
  std::filesystem::remove(at("log/wheels0"));
  refuse_as_it_is("log/wheels0  cannot be read: No such file or directory");
}

TEST_F(LogTest, MustHoldSomething) {
  lines_.resize(1);
  refuse("log/wheels0/data.csv  holds no data after its header");
  lines_.clear();
  refuse("log/wheels0/data.csv:1  the file is empty");
}

TEST_F(LogTest, NeedsAllColumnsInTheRightUnit) {
  const std::string header = line(1);
  line(1) = replaced(header, "drive_3", "drve_3");
  refuse("log/wheels0/data.csv:1  no column 'drive_3 [rad/s]' - did you mean 'drve_3 [rad/s]'?");
  line(1) = replaced(header, "drive_1 [rad/s]", "drive_1 [rpm]");
  refuse("log/wheels0/data.csv:1  column 'drive_1 [rpm]' has another unit than 'drive_1 [rad/s]'");
  line(1) = replaced(header, "timestamp_ns", "timestmap_ns");
  refuse("log/wheels0/data.csv:1  no column 'timestamp_ns' - did you mean 'timestmap_ns'?");
}

TEST_F(LogTest, CountsRowsThatCannotBeRead) {
  set_field(50, 2, "abc");
  set_field(60, 2, "");
  set_field(70, 2, "1,5");
  set_field(80, 0, "4.9e8");
  expect_counted(4, "row that cannot be read", 50,
                 "  column 'drive_2 [rad/s]': 'abc' is not a number");
}

TEST_F(LogTest, CountsRowsThatAreNotFinite) {
  set_field(50, 2, "nan");
  set_field(51, 1, "-inf");
  set_field(60, 8, "NaN");
  expect_counted(3, "value that is not finite", 50);
}

TEST_F(LogTest, CountsRepeatedAndBackwardStamps) {
  lines_.insert(lines_.begin() + 100, line(100));  // line 101 repeats line 100
  lines_.insert(lines_.begin() + 200, line(150));  // line 201 is older than line 200
  expect_counted(2, "stamp not after the previous one", 101);
}

TEST_F(LogTest, CountsGaps) {
  lines_.erase(lines_.begin() + 99, lines_.begin() + 150);
  expect_counted(1, "gap longer than 0.2 s", 100);
}

TEST_F(LogTest, IsRefusedWhenTooManyRowsAreBad) {
  for (std::size_t number = 50; number < 250; ++number) set_field(number, 3, "nan");
  refuse(
      "log/wheels0/data.csv  200 of 501 data rejected, allowed is a fraction of 0.1: value that "
      "is not finite (200, first at data.csv:50)");
}

TEST_F(LogTest, IsNotWrittenOverOtherFiles) {
  write("other/notes.txt", "mine\n");
  const Outcome into_other = viwo({"simulate", "run.yaml", "--out", "other"});
  EXPECT_EQ(into_other.code, 2);
  EXPECT_EQ(
      into_other.err,
      "other  already holds notes.txt, which is no part of a log written here: choose an empty "
      "folder\n");
  EXPECT_EQ(read("other/notes.txt"), "mine\n");
  write("log/wheels0/notes.txt", "mine\n");
  EXPECT_EQ(
      viwo({"simulate", "run.yaml", "--out", "log"}).err,
      "log  already holds wheels0/notes.txt, which is no part of a log written here: choose an "
      "empty folder\n");
  EXPECT_EQ(read("log/wheels0/notes.txt"), "mine\n");
  expect_refused({"simulate", "run.yaml", "--out", "run.yaml"},
                 "run.yaml  is a file, not a folder");
  const Outcome below_a_file = viwo({"simulate", "run.yaml", "--out", "run.yaml/log"});
  EXPECT_EQ(below_a_file.code, 1);
  EXPECT_EQ(below_a_file.err, "cannot create the folder run.yaml/log: Not a directory\n");
}

TEST_F(LogTest, IsReplacedByANewLog) {
  write(kWheels, "stale\n");
  expect_done({"simulate", "run.yaml", "--out", "log"});
  EXPECT_EQ(read(kWheels), text());
}

}  // namespace
}  // namespace viwo

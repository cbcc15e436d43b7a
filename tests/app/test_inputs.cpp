// What a command reads is not what it writes, nor what another one is writing.
#include <fstream>

#include <fcntl.h>
#include <sys/file.h>

#include "support.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

class InputsTest : public CommandLineTest {
 protected:
  InputsTest() { write("run.yaml", kRun); }

  /// A log that the program has written, and a run that plays it.
  void make_log() const {
    expect_done({"simulate", "run.yaml", "--out", "log"});
    std::string play = kRun;
    play.replace(play.find("sensors:"), play.find("kinematics:") - play.find("sensors:"),
                 "sensors:\n  wheels: {type: asl_encoders, path: " +
                     at("log/wheels0/data.csv").string() + "}\n");
    play.replace(play.find("*robot"), 6,
                 "{type: four_wis_wid, x_m: [0.1, -0.1, -0.1, 0.1], y_m: [0.1, 0.1, -0.1, -0.1], "
                 "radius_m: 0.025}");
    write("play.yaml", play);
  }
  void expect_kept(const std::vector<std::string>& words, const std::string& file,
                   const std::string& message) const {
    const std::string before = read(file);
    const Outcome outcome = viwo(words);
    EXPECT_EQ(outcome.code, 2) << outcome.out;
    EXPECT_EQ(outcome.err, message + "\n");
    EXPECT_EQ(read(file), before);
  }
};

TEST_F(InputsTest, OfASimulationAreNotEmptied) {
  make_log();
  for (const char* folder : {"log", "log/wheels0"}) {
    expect_kept({"simulate", "play.yaml", "--out", folder}, "log/wheels0/data.csv",
                std::string(folder) +
                    "  holds the input TMP/log/wheels0/data.csv, which would be lost - choose "
                    "another --out");
  }
  expect_done({"simulate", "play.yaml", "--out", "copy"});
  EXPECT_EQ(read("copy/wheels0/data.csv"), read("log/wheels0/data.csv"));
}

TEST_F(InputsTest, AreNotReplaced) {
  make_log();
  const std::string is_input =
      "  is an input, which the results would replace - write them elsewhere";
  expect_kept({"inspect", "play.yaml", "--fix", "log/wheels0/data.csv"}, "log/wheels0/data.csv",
              "log/wheels0/data.csv" + is_input);
  fs::create_directory(at("out"));
  std::string calibration = "model: four_wis_wid\ntwist: plain\nintrinsics:\n";
  for (const std::string i : {"1", "2", "3", "4"}) {
    calibration += "  r_" + i + ": {estimate: 0.025, sigma: 0.001}\n  x_" + i +
                   ": {estimate: 0.1, sigma: 0.001}\n  y_" + i +
                   ": {estimate: 0.1, sigma: 0.001}\n  delta_o" + i +
                   ": {estimate: 0.0, sigma: 0.001}\n";
  }
  write("out/calibration.yaml", calibration);
  expect_kept({"run", "run.yaml", "--out", "out", "--set",
               "kinematics={calibration: " + at("out/calibration.yaml").string() +
                   ", type: four_wis_wid, x_m: [0.1, -0.1, -0.1, 0.1], y_m: [0.1, 0.1, -0.1, "
                   "-0.1], radius_m: 0.025}"},
              "out/calibration.yaml", "out/calibration.yaml" + is_input);
  expect_kept({"export", "out/calibration.yaml", "--to", "csv", "--out", "out/calibration.yaml"},
              "out/calibration.yaml", "out/calibration.yaml" + is_input);
}

TEST_F(InputsTest, AFolderBelongsToOneCommandAtATime) {
  for (const char* command : {"run", "inspect", "simulate"}) {
    fs::create_directories(at("out"));
    const int fd = ::open(at("out").c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    ASSERT_EQ(::flock(fd, LOCK_EX | LOCK_NB), 0);
    const Outcome outcome = viwo({command, "run.yaml", "--out", "out"});
    EXPECT_EQ(outcome.code, 2);
    EXPECT_EQ(outcome.err, "another viwo is at work in out: wait until it is done\n");
    EXPECT_TRUE(fs::is_empty(at("out")));
    ::close(fd);
  }
  expect_done({"run", "run.yaml", "--out", "out"});
}

TEST_F(InputsTest, FiguresAreNotWrittenThroughALink) {
  fs::create_directories(at("out"));
  fs::create_directories(at("elsewhere"));
  fs::create_directory_symlink(at("elsewhere"), at("out/figures"));
  const Outcome outcome = viwo({"run", "run.yaml", "--out", "out", "--figures", "svg"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_EQ(outcome.err,
            "out/figures  is a link; results are kept in a folder of their own - remove it\n");
  EXPECT_TRUE(fs::is_empty(at("elsewhere")));
}

/// viwo run ... 2>&1 | head -0
TEST_F(InputsTest, ResultsAreWrittenAlsoWhereNobodyReadsWhatIsPrinted) {
  const std::string command = "cd " + folder_.string() +
                              "; " VIWO_TEST_PROGRAM
                              " run run.yaml --out out 2>&1 > pipe; echo $? > code";
  ASSERT_EQ(
      std::system(("cd " + folder_.string() + "; mkfifo pipe; (: < pipe) & (" + command + "); wait")
                      .c_str()),
      0);
  EXPECT_TRUE(fs::exists(at("out/report.html")));
  EXPECT_EQ(read("code"), "0\n");
}

}  // namespace
}  // namespace viwo

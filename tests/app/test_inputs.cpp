// What a command reads is not what it writes, nor what another one is writing.
#include <array>
#include <fstream>

#include <fcntl.h>
#include <sys/file.h>

#include "support.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

const std::string kIsInput =
    "  is an input, which the results would replace - write them elsewhere";

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
  expect_kept({"inspect", "play.yaml", "--fix", "log/wheels0/data.csv"}, "log/wheels0/data.csv",
              "log/wheels0/data.csv" + kIsInput);
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
              "out/calibration.yaml", "out/calibration.yaml" + kIsInput);
  expect_kept({"export", "out/calibration.yaml", "--to", "csv", "--out", "out/calibration.yaml"},
              "out/calibration.yaml", "out/calibration.yaml" + kIsInput);
}

TEST_F(InputsTest, ThatAreTheConfigurationItselfAreNotReplaced) {
  const std::string swerve = std::string(VIWO_TEST_SOURCE_DIR) + "/configs/";
  const std::vector<std::array<std::string, 3>> commands = {
      {"run", "config.resolved.yaml", kRun},
      {"inspect", "inspection.json", kRun},
      {"calibrate", "calibration.yaml", "calibration: c\nbase: run.yaml\nsegment_s: 0.5\n"},
      {"experiment", "summary.json", "experiment: e\nbase: run.yaml\nvariants: {a: }\n"},
      {"observability", "observability.json", kRun},
      {"plan", "plan.tum", testing::text_of(swerve + "plans/swerve.yaml")}};
  for (const auto& [command, name, text] : commands) {
    SCOPED_TRACE(command);
    write(name, text);
    expect_kept({command, name, "--out", "."}, name, "./" + name + kIsInput);
    fs::create_directory(at("link_of_" + command));
    fs::create_symlink(at(name), at("link_of_" + command) / name);
    expect_kept({command, name, "--out", "link_of_" + command}, name,
                "link_of_" + command + "/" + name + kIsInput);
    fs::create_directory(at("name_of_" + command));
    fs::create_hard_link(at(name), at("name_of_" + command) / name);
    expect_kept({command, name, "--out", "name_of_" + command}, name,
                "name_of_" + command + "/" + name + kIsInput);
  }
}

TEST_F(InputsTest, ThatAConfigurationIsMadeOfAreNotReplaced) {
  write("report.html", kRun);
  write("e.yaml", "experiment: e\nbase: report.html\nvariants: {a: }\n");
  write("c.yaml", "calibration: c\nbase: report.html\nsegment_s: 0.5\n");
  for (const char* const command : {"experiment", "observability"}) {
    expect_kept({command, "e.yaml", "--out", "."}, "report.html", "./report.html" + kIsInput);
  }
  expect_kept({"calibrate", "c.yaml", "--out", "."}, "report.html", "./report.html" + kIsInput);
  write("out/runs/a/config.resolved.yaml", kRun);
  write("e.yaml", "experiment: e\nbase: out/runs/a/config.resolved.yaml\nvariants: {a: }\n");
  expect_kept({"experiment", "e.yaml", "--out", "out", "--keep-runs"},
              "out/runs/a/config.resolved.yaml",
              "out/runs  holds the input out/runs/a/config.resolved.yaml, which would be lost - "
              "choose another --out");
  write("out/timing.csv",
        testing::text_of(std::string(VIWO_TEST_SOURCE_DIR) + "/configs/plans/swerve.yaml"));
  const std::string swerve = std::string(VIWO_TEST_SOURCE_DIR) + "/configs/runs/viwo_swerve.yaml";
  expect_kept({"run", swerve, "--out", "out", "--plan", "out/timing.csv"}, "out/timing.csv",
              "out/timing.csv" + kIsInput);
  write("evaluation.json", "0 0 0 0 0 0 0 1\n");
  for (const auto& [reference, estimate] :
       {std::pair{"evaluation.json", "b.tum"}, {"b.tum", "evaluation.json"}}) {
    expect_kept({"evaluate", "--reference", reference, "--estimate", estimate, "--out", "."},
                "evaluation.json", "./evaluation.json" + kIsInput);
  }
}

/// Its numbers are what is resolved: it is named nowhere in that.
TEST_F(InputsTest, ThatAreAKalibrFileOfAnImuAreNotReplaced) {
  write("imu.yaml",
        "accelerometer_noise_density: 0.02\naccelerometer_random_walk: 0.002\n"
        "gyroscope_noise_density: 0.002\ngyroscope_random_walk: 0.0002\nrostopic: /imu0\n"
        "update_rate: 200.0\n");
  expect_kept({"inspect", std::string(VIWO_TEST_SOURCE_DIR) + "/configs/runs/viwo_swerve.yaml",
               "--set", "sensors.simulator0.duration_s=3", "--set",
               "imu={kalibr: " + at("imu.yaml").string() + "}", "--fix", "imu.yaml"},
              "imu.yaml", "imu.yaml" + kIsInput);
}

TEST_F(InputsTest, ThatAreFoldersGetNoFiles) {
  make_log();
  write("play.yaml", replaced(read("play.yaml"), "/data.csv", ""));
  fs::create_directory_symlink(at("log/wheels0"), at("link"));
  for (const std::string folder : {"log/wheels0", "link"}) {
    expect_kept({"inspect", "play.yaml", "--fix", folder + "/data.csv"}, "log/wheels0/data.csv",
                folder +
                    "/data.csv  lies in the input TMP/log/wheels0, of which it would become a part "
                    "- write it elsewhere");
  }
  // Results have a folder of their own, which may lie there; those of before are no inputs.
  for (int twice = 0; twice < 2; ++twice) {
    expect_done({"run", "play.yaml", "--out", "log/out"});
    expect_done({"run", "play.yaml", "--out", "log/wheels0/out"});
    expect_done({"inspect", "play.yaml", "--out", "log/inspected", "--fix", "log/fixed.yaml"});
  }
}

TEST_F(InputsTest, AFileBesideTheResultsIsNoneOfThem) {
  expect_refused({"inspect", "run.yaml", "--out", "out", "--fix", "./out/inspection.json"},
                 "--fix ./out/inspection.json: is one of the results of this command - name "
                 "another file");
  expect_refused({"run", "run.yaml", "--out", "out", "--mcap", "out/summary.json"},
                 "--mcap out/summary.json: is one of the results of this command - name another "
                 "file");
  expect_refused({"run", "run.yaml", "--out", "out", "--mcap", "x.avi", "--video", "./x.avi"},
                 "--mcap x.avi: is another result of this command, too - name another file");
  expect_refused({"run", "run.yaml", "--out", "out", "--mcap", "out/unfinished.tmp/x.mcap"},
                 "--mcap out/unfinished.tmp/x.mcap: is in a folder that this command removes - "
                 "name another file");
}

/// FILE.tmp may be that of another command that writes the same file.
TEST_F(InputsTest, WhatAnotherCommandIsWritingIsLeftAlone) {
  write("b.tum", "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n");
  write("evaluation.json.tmp", "half");
  write("fixed.yaml.tmp", "half");
  expect_done({"evaluate", "--reference", "b.tum", "--estimate", "b.tum", "--out", "."});
  expect_done({"inspect", "run.yaml", "--out", "out", "--fix", "fixed.yaml"});
  EXPECT_EQ(read("evaluation.json.tmp"), "half");
  EXPECT_EQ(read("fixed.yaml.tmp"), "half");
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

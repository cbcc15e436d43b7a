// Results: files, reproducibility, and what happens when they cannot be written.
#include <algorithm>
#include <set>
#include <sstream>

#include "support.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

using ResultsTest = CommandLineTest;

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream text(line);
  for (std::string field; std::getline(text, field, ',');) fields.push_back(field);
  return fields;
}

/// runs.csv without the columns that tell how long something took.
std::string without_wall_clock(const std::string& csv) {
  std::istringstream text(csv);
  std::string line, result;
  std::vector<std::string> header;
  while (std::getline(text, line)) {
    const std::vector<std::string> fields = fields_of(line);
    if (header.empty()) header = fields;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const std::string& name = header.at(i);
      if (name.find("wall") != std::string::npos || name.find("realtime") != std::string::npos ||
          name.find("_ms") != std::string::npos || name.find("rss") != std::string::npos) {
        continue;
      }
      result += fields[i] + ",";
    }
    result += "\n";
  }
  return result;
}

TEST_F(ResultsTest, AreTheFilesOfTheContract) {
  write("run.yaml", kRun);
  const Outcome outcome = expect_done({"run", "run.yaml", "--out", "out"});
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(outcome.out.find("status ok\n"), 0U) << outcome.out;
  std::set<std::string> files;
  for (const auto& entry : fs::directory_iterator(at("out"))) {
    files.insert(entry.path().filename().string());
  }
  EXPECT_EQ(files, (std::set<std::string>{"config.resolved.yaml", "trajectory.tum", "reference.tum",
                                          "calibration.csv", "timing.csv", "summary.json",
                                          "report.html"}));
  const nlohmann::json json = summary();
  EXPECT_EQ(json.at("status"), "ok");
  EXPECT_EQ(json.at("seed"), 1);
  EXPECT_DOUBLE_EQ(json.at("duration_s").get<double>(), 5.);
  for (const char* key : {"epochs", "wall_s", "accuracy", "calibration", "updates", "timing_ms",
                          "realtime_factor", "peak_rss_mb"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
}

TEST_F(ResultsTest, GoToAFolderNamedAfterTheConfigurationByDefault) {
  write("run.yaml", kRun);
  expect_done({"run", "run.yaml"});
  EXPECT_TRUE(fs::exists(at("results/run/report.html")));
  // What another command makes of the same configuration does not replace it.
  const std::string before = read("results/run/report.html");
  viwo({"inspect", "run.yaml"});
  EXPECT_TRUE(fs::exists(at("results/run_inspect/report.html")));
  EXPECT_EQ(read("results/run/report.html"), before);
}

TEST_F(ResultsTest, AreTheSameForTheSameSeedAndOthersForAnother) {
  write("run.yaml", kRun);
  for (const auto& [folder, seed] : {std::pair{"a", "7"}, {"b", "7"}, {"c", "8"}}) {
    expect_done({"run", "run.yaml", "--out", folder, "--seed", seed});
  }
  EXPECT_EQ(read("a/trajectory.tum"), read("b/trajectory.tum"));
  EXPECT_NE(read("a/trajectory.tum"), read("c/trajectory.tum"));
  EXPECT_EQ(summary("c").at("seed"), 8);
}

TEST_F(ResultsTest, HoldTheConfigurationThatReproducesThem) {
  write("run.yaml", kRun);
  expect_done({"run", "run.yaml", "--out", "a", "--seed", "7", "--set", "odometry.epoch_s=0.25"});
  expect_done({"run", "a/config.resolved.yaml", "--out", "b"});
  EXPECT_EQ(read("a/trajectory.tum"), read("b/trajectory.tum"));
  EXPECT_EQ(read("a/config.resolved.yaml"), read("b/config.resolved.yaml"));
}

TEST_F(ResultsTest, OfAnExperimentDoNotDependOnTheNumberOfJobs) {
  write("run.yaml", replaced(kRun, "motion: circle", "motion: \"{motion}\""));
  write("e.yaml",
        "experiment: e\nbase: run.yaml\nseeds: 3\nmotions: [circle, straight, icr_sweep]\n"
        "variants:\n  redundant:\n  drive: {kinematics.type: four_wis_wid_drive_only}\n");
  expect_done({"experiment", "e.yaml", "--out", "one", "--jobs", "1"});
  expect_done({"experiment", "e.yaml", "--out", "two", "--jobs", "2"});
  const std::string one = without_wall_clock(read("one/runs.csv"));
  EXPECT_EQ(one, without_wall_clock(read("two/runs.csv")));
  EXPECT_EQ(std::count(one.begin(), one.end(), '\n'), 1 + 2 * 3 * 3);
  // What is left after the wall clock is taken out still tells runs apart.
  std::istringstream rows(one);
  std::set<std::string> different;
  for (std::string row; std::getline(rows, row);) different.insert(row);
  EXPECT_EQ(different.size(), 1U + 2 * 3 * 3);
}

TEST_F(ResultsTest, OfEachRunAreKeptOnRequest) {
  write("run.yaml", kRun);
  write("e.yaml", "experiment: e\nbase: run.yaml\nvariants:\n  a:\n  b:\n");
  expect_done({"experiment", "e.yaml", "--out", "out", "--keep-runs", "--seeds", "2"});
  for (const char* run : {"a_1", "a_2", "b_1", "b_2"}) {
    EXPECT_TRUE(fs::exists(at("out/runs") / run / "trajectory.tum")) << run;
  }
  EXPECT_EQ(read("out/runs/a_1/trajectory.tum"), read("out/runs/b_1/trajectory.tum"));
}

TEST_F(ResultsTest, OfEachRunHaveAFolderOfTheirOwn) {
  write("run.yaml", kRun);
  write("e.yaml",
        "experiment: e\nbase: run.yaml\nvariants:\n  a_b:\n  a:\n"
        "recordings:\n  - {name: c}\n  - {name: b_c}\n");
  const Outcome outcome = viwo({"experiment", "e.yaml", "--out", "out", "--keep-runs"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.err.find("two runs would be kept in out/runs/a_b_c"), std::string::npos)
      << outcome.err;
}

TEST_F(ResultsTest, ThatCannotBeWrittenAreAFailure) {
  write("run.yaml", kRun);
  const auto fail = [&](const std::string& out, const std::string& message) {
    const Outcome outcome = viwo({"run", "run.yaml", "--out", out});
    EXPECT_EQ(outcome.code, 1) << out;
    EXPECT_EQ(outcome.err, message + "\n");
  };
  fail("run.yaml", "cannot create the folder run.yaml: Not a directory");
  fail("run.yaml/sub", "cannot create the folder run.yaml/sub: Not a directory");
  fs::create_directories(at("blocked/report.html"));
  fail("blocked", "cannot write blocked/report.html: Is a directory");
}

TEST_F(ResultsTest, AreAFailureOnAFullDisk) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  write("run.yaml", kRun);
  for (const char* file :
       {"config.resolved.yaml", "trajectory.tum", "summary.json", "report.html"}) {
    fs::remove_all(at("full"));
    fs::create_directory(at("full"));
    fs::create_symlink("/dev/full", at("full") / file);
    const Outcome outcome = viwo({"run", "run.yaml", "--out", "full"});
    EXPECT_EQ(outcome.code, 1) << file;
    EXPECT_NE(outcome.err.find("full/" + std::string(file)), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("No space left on device"), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.out, "") << "claims success";
  }
}

TEST_F(ResultsTest, OfARunBeforeStayAsTheyWereWhereNewOnesCannotBeWritten) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  write("run.yaml", kRun);
  expect_done({"run", "run.yaml", "--out", "again"});
  fs::remove(at("again") / "reference.tum");
  fs::create_symlink("/dev/full", at("again") / "reference.tum");
  const auto files = [&] {
    std::string all;
    for (const char* name : {"summary.json", "report.html", "trajectory.tum", "timing.csv"}) {
      all += read(std::string("again/") + name);
    }
    return all;
  };
  const std::string before = files();
  EXPECT_EQ(viwo({"run", "run.yaml", "--out", "again", "--seed", "2"}).code, 1);
  EXPECT_TRUE(files() == before);
  EXPECT_FALSE(fs::exists(at("again") / "unfinished.tmp"));
}

TEST_F(ResultsTest, AreWrittenForARunThatDiverges) {
  const Outcome outcome =
      viwo({"run", std::string(VIWO_TEST_SOURCE_DIR) + "/configs/runs/viwo_swerve.yaml", "--set",
            "sensors.simulator0.duration_s=5", "--set", "estimator.max_speed_m_per_s=0.1", "--out",
            "out"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(outcome.out.find("status diverged: "), 0U) << outcome.out;
  EXPECT_EQ(summary().at("status"), "diverged");
  EXPECT_TRUE(fs::exists(at("out/report.html")));
}

TEST_F(ResultsTest, AreDoubtfulWhereTheReferenceContradictsThem) {
  write("run.yaml", kRun);
  const Outcome outcome = viwo({"run", "run.yaml", "--out", "out", "--set",
                                "sensors.sim.drive_scale=[57.3, 57.3, 57.3, 57.3]"});
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  EXPECT_EQ(outcome.out.find("status doubtful\n  the reference contradicts the estimate: after "),
            0U)
      << outcome.out;
  EXPECT_EQ(summary().at("status"), "doubtful");
}

}  // namespace
}  // namespace viwo

// Configurations and texts that nobody writes by mistake: what is wrong is said, nothing is lost.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <regex>

#include <sys/resource.h>
#include <sys/stat.h>

#include "support.hpp"

namespace viwo {
namespace {

/// Whether others can read it: Python and browsers refuse a file for one byte.
bool is_utf8(std::string text) {
  const auto is_special = [](char c) {
    return static_cast<unsigned char>(c) < 0x20 || c == '"' || c == '\\';
  };
  std::replace_if(text.begin(), text.end(), is_special, ' ');
  return nlohmann::json::accept('"' + text + '"');  // which then says nothing else
}

class HostileTest : public CommandLineTest {
 protected:
  void expect_readable(const std::string& folder) const {
    int n = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(at(folder))) {
      if (!entry.is_regular_file() || entry.path().extension() == ".cbor") continue;
      const std::string name = std::filesystem::relative(entry.path(), at(".")).string();
      const std::string text = read(name);
      EXPECT_TRUE(is_utf8(text)) << name;
      EXPECT_GT(text.size(), 0U) << name;
      if (entry.path().extension() == ".json") {
        EXPECT_TRUE(nlohmann::json::accept(text)) << name;
      }
      ++n;
    }
    EXPECT_GT(n, 0) << folder;
  }

  void make_pipe(const std::string& name) const {
    ASSERT_EQ(::mkfifo(at(name).c_str(), 0600), 0) << name;
  }
};

// Latin-1, as in the names of old files and in messages of old drivers.
const std::string kLatin = "caf\xe9";
const std::string kReplaced = "caf\xef\xbf\xbd";

TEST_F(HostileTest, BytesThatAreNoTextLoseNoResults) {
  write("run.yaml",
        replaced(replaced(kRun, "small", kLatin), "sim:", kLatin + ":") + "# " + kLatin);
  expect_done({"run", "run.yaml", "--out", "out"});
  expect_readable("out");
  EXPECT_EQ(summary().at("name"), kReplaced);
  expect_done({"inspect", "run.yaml", "--out", "inspected"});
  expect_readable("inspected");
  write("c.yaml", "calibration: \"" + kLatin + "\"\nbase: run.yaml\nsegment_s: 0.5\n");
  expect_done({"calibrate", "c.yaml", "--out", "calibrated"});
  expect_readable("calibrated");
  write("p.yaml",
        "plan: " + kLatin +
            "\nkinematics: {type: four_wis_wid, x_m: [0.1, -0.1, -0.1, 0.1],"
            " y_m: [0.1, 0.1, -0.1, -0.1], radius_m: 0.03}\nbase_radius_m: 0.2\nfloor_x_m: 3\n"
            "floor_y_m: 3\nmax_speed_m_per_s: 0.5\nmax_yaw_rate_rad_per_s: 1.5\n"
            "max_acceleration_m_per_s2: 0.5\ngoals: {delta_o: 0.005}\n");
  const Outcome plan = viwo({"plan", "p.yaml", "--out", "planned"});
  EXPECT_LE(plan.code, 1) << plan.err;
  expect_readable("planned");
  write("log/odom.csv", "time,a,b\n");  // a folder with a name that is no text
  expect_done({"simulate", "run.yaml", "--out", kLatin});
}

TEST_F(HostileTest, BytesThatAreNoTextPassThroughTheJournal) {
  write("run.yaml", replaced(kRun, "sim:", kLatin + ":"));
  write("e.yaml", "experiment: " + kLatin + "\nbase: run.yaml\nvariants: {a: , b: }\n");
  expect_done({"experiment", "e.yaml", "--out", "out", "--shard", "0/2"});
  expect_done({"experiment", "e.yaml", "--out", "out", "--shard", "1/2"});
  expect_done({"experiment", "e.yaml", "--out", "out", "--collect"});
  expect_readable("out");
}

TEST_F(HostileTest, BytesThatAreNoTextInWhatAPluginSaysLoseNothing) {
  const std::string bad = std::string(VIWO_TEST_BINARY_DIR) + "/tests/plugins_bad";
  const Outcome schema = viwo({"plugins", "schema", "--plugin-path", bad});
  EXPECT_EQ(schema.code, 1) << schema.err;  // one of them cannot be loaded
  EXPECT_TRUE(is_utf8(schema.out));
  EXPECT_NE(schema.out.find(kReplaced), std::string::npos);
  const std::string swerve = std::string(VIWO_TEST_SOURCE_DIR) + "/configs/runs/viwo_swerve.yaml";
  const Outcome run =
      viwo({"run", swerve, "--out", "out", "--set", "sensors.simulator0.duration_s=2", "--set",
            "updates.failing={what: bytes}", "--plugin-path", bad});
  EXPECT_EQ(run.code, 1) << run.err;  // it was disabled
  expect_readable("out");
  EXPECT_EQ(summary().at("updates").at("failing").at("cause"), "lost in a " + kReplaced);
}

TEST_F(HostileTest, ACommaIsNoConfiguration) {
  write("comma.yaml", ",");
  const std::string where = "comma.yaml:1:1  not valid YAML: ',' does not belong here";
  for (const char* command :
       {"run", "experiment", "calibrate", "plan", "inspect", "observability"}) {
    expect_refused({command, "comma.yaml", "--out", "out"}, where);
  }
  expect_refused({"export", "comma.yaml", "--to", "csv"}, where);
  write("run.yaml", kRun);
  expect_refused({"run", "run.yaml", "--out", "out", "--plan", "comma.yaml"}, where);
  expect_refused({"run", "run.yaml", "--out", "out", "--set", "name=,"},
                 "--set name  not valid YAML: ',' does not belong here");
  write("e.yaml", "experiment: e\nbase: comma.yaml\nvariants: {a: }\n");
  expect_refused({"experiment", "e.yaml", "--out", "out"}, where);
}

TEST_F(HostileTest, NoConfigurationIsAsLargeAsThese) {
  std::string keys;
  for (int i = 0; i < 100'000; ++i) keys += "k" + std::to_string(i) + ": 1\n";
  write("keys.yaml", keys);
  expect_refused({"run", "keys.yaml", "--out", "out"},
                 "keys.yaml:50000:9  more than 100000 values, with those that aliases stand for");
  write("list.yaml", "a: [" + std::string(30'000'000, ',') + "]\n");
  expect_refused({"run", "list.yaml", "--out", "out"},
                 "list.yaml  is larger than 1 MiB, as no YAML that viwo reads is");
  // As many as there may be: what is wrong with each is said of the first.
  keys.resize(keys.find("k49000:"));
  write("keys.yaml", kRun + keys);
  const Outcome outcome = viwo({"run", "keys.yaml", "--out", "out"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 101) << outcome.err;
  EXPECT_TRUE(std::regex_search(outcome.err, std::regex("\nand 48[0-9]+ more\n$")));
}

TEST_F(HostileTest, WhatAConfigurationNamesIsAFile) {
  make_pipe("pipe");
  const std::string pipe = "pipe  is a pipe, not a file",
                    zero = "/dev/zero  is a device, not a file";
  for (const char* command :
       {"run", "experiment", "calibrate", "plan", "inspect", "observability"}) {
    expect_refused({command, "pipe", "--out", "out"}, pipe);
    expect_refused({command, "/dev/zero", "--out", "out"}, zero);
  }
  expect_refused({"export", "pipe", "--to", "csv"}, pipe);
  expect_refused({"evaluate", "--reference", "pipe", "--estimate", "pipe"}, pipe);
  write("run.yaml", kRun);
  expect_refused({"run", "run.yaml", "--out", "out", "--plan", "pipe"}, pipe);
  write("e.yaml", "experiment: e\nbase: pipe\nvariants: {a: }\n");
  expect_refused({"experiment", "e.yaml", "--out", "out"}, pipe);
  const std::string swerve = std::string(VIWO_TEST_SOURCE_DIR) + "/configs/runs/viwo_swerve.yaml";
  for (const std::string set :
       {"kinematics.calibration=PIPE", "calibration=PIPE", "cameras.kalibr=PIPE",
        "imu={kalibr: PIPE}", "sensors.simulator0.cameras=PIPE",
        "sensors={imu0: {type: asl_imu, path: PIPE}}",
        "sensors={wheels0: {type: csv_table, path: PIPE, time_column: t, time_unit: s,"
        " drive_columns: [a], drive_unit: rad}}"}) {
    SCOPED_TRACE(set);
    const Outcome outcome =
        viwo({"run", swerve, "--out", "out", "--set", replaced(set, "PIPE", at("pipe").string())});
    EXPECT_EQ(outcome.code, 2);
    EXPECT_NE(outcome.err.find("TMP/pipe  is a pipe, not a file"), std::string::npos)
        << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(at("out")));
  }
}

TEST_F(HostileTest, NumbersOfRunsHaveBounds) {
  write("run.yaml", replaced(kRun, "motion: circle", "motion: \"{motion}\""));
  const std::string variants = "variants: {a: , b: }\n";
  write("e.yaml", "experiment: e\nbase: run.yaml\nmotions: [circle, straight]\n" + variants);
  const auto refuse = [&](const std::vector<std::string>& more, const std::string& message) {
    std::vector<std::string> words{"experiment", "e.yaml", "--out", "out"};
    words.insert(words.end(), more.begin(), more.end());
    expect_refused(words, message);
  };
  const std::string bound = " runs, an experiment has up to 100000 - make several of it";
  refuse({"--seeds", "2000000000"},
         "--seeds  2 variants x 2 recordings x 2000000000 seeds are 8000000000" + bound);
  refuse({"--seeds", "25001", "--shard", "0/1000000"},
         "--seeds  2 variants x 2 recordings x 25001 seeds are 100004" + bound);
  refuse({"--seeds", "20000000000"},
         "viwo experiment: the argument ('20000000000') for option '--seeds' is invalid (see viwo "
         "experiment --help)");
  refuse({"--jobs", "2000000000"},
         "viwo experiment: --jobs must be at most 1024 (see viwo experiment --help)");
  write(
      "e.yaml",
      "experiment: e\nbase: run.yaml\nmotions: [circle, straight]\nseeds: 2000000000\n" + variants);
  refuse({}, "e.yaml:4:8  2 variants x 2 recordings x 2000000000 seeds are 8000000000" + bound);
  // The last of as many shards as a number can say has nothing to do.
  write("e.yaml", "experiment: e\nbase: run.yaml\nmotions: [circle]\n" + variants);
  expect_done({"experiment", "e.yaml", "--out", "shards", "--shard", "2147483646/2147483647",
               "--jobs", "1024"});
}

TEST_F(HostileTest, ALimitOfTheSizeOfFilesIsAnError) {
  write("run.yaml", kRun);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit limit{1'000'000, before.rlim_max};  // less than the page of a run
  setenv("VIWO_PLUGINS_STAY_MAPPED", "1", 1);      // their copies are files, too
  setrlimit(RLIMIT_FSIZE, &limit);
  const Outcome outcome = viwo({"run", "run.yaml", "--out", "out"});
  setrlimit(RLIMIT_FSIZE, &before);
  unsetenv("VIWO_PLUGINS_STAY_MAPPED");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(outcome.err, "cannot write out/unfinished.tmp/report.html: File too large\n");
  EXPECT_TRUE(std::filesystem::is_empty(at("out")));
}

TEST_F(HostileTest, EncodersOfTwoClocksAreRefusedByTheirPlace) {
  std::string table = "timestamp_ns,drive_1 [rad/s],drive_2 [rad/s]\n";
  for (int i = 0; i < 300; ++i) {
    const std::int64_t clock_ns = i < 150 ? 0 : 3'900'000'000'000'000'000;
    table += std::to_string(clock_ns + 10'000'000LL * i) + ",1,1\n";
  }
  write("wheels0/data.csv", table);
  write("run.yaml",
        "name: two\nsensors:\n  wheels0: {type: asl_encoders, path: wheels0}\n"
        "kinematics: {type: differential, radius_left_m: 0.1, radius_right_m: 0.1, baseline_m: "
        "0.5}\n");
  const Outcome outcome = viwo({"run", "run.yaml", "--out", "out"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_EQ(outcome.err,
            "run.yaml:3:3  the encoder samples of 'wheels0' are 299 in 3.9e+09 s: their stamps are "
            "of two clocks, or of another unit\n");
  const Outcome inspected = viwo({"inspect", "run.yaml", "--out", "inspected"});
  EXPECT_EQ(inspected.code, 1) << inspected.err;
  EXPECT_NE(inspected.out.find("its stamps are of two clocks, or of another unit"),
            std::string::npos)
      << inspected.out;
}

TEST_F(HostileTest, AGnuplotThatFailsTakesNoResultsWithIt) {
  write("gnuplot", "#!/bin/sh\n[ \"$2\" = --version ] && exit 0\necho out of ink >&2\nexit 1\n");
  std::filesystem::permissions(at("gnuplot"), std::filesystem::perms::owner_all);
  write("run.yaml", kRun);
  const std::string before = std::getenv("PATH");
  setenv("PATH", (at(".").string() + ":" + before).c_str(), 1);
  const Outcome outcome = viwo({"run", "run.yaml", "--out", "out", "--figures", "svg"});
  setenv("PATH", before.c_str(), 1);
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.err.find("gnuplot failed on out/figures/unfinished.tmp/01"), std::string::npos)
      << outcome.err;
  EXPECT_NE(outcome.out.find("report: out/report.html\n"), std::string::npos) << outcome.out;
  EXPECT_EQ(summary().at("status"), "ok");
  EXPECT_NE(read("out/report.html").find("</html>"), std::string::npos);
}

}  // namespace
}  // namespace viwo

// viwo export, and the calibration.yaml that a run of the filter leaves for the next one.
#include "support.hpp"

namespace viwo {
namespace {

class ExportTest : public CommandLineTest {
 protected:
  static std::vector<std::string> run(const std::vector<std::string>& more) {
    std::vector<std::string> words{"run",   VIWO_TEST_SOURCE_DIR "/configs/runs/viwo_swerve.yaml",
                                   "--set", "sensors.simulator0.duration_s=3",
                                   "--set", "estimator.calibration_error_scale=0",
                                   "--set", "cameras.calibrate=true"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  const std::string kSides =
      "model: differential\ntwist: plain\nintrinsics:\n"
      "  r_left: {estimate: 0.101, sigma: 0.001, unit: m}\n"
      "  r_right: {estimate: 0.099, sigma: 0.001, unit: m}\n"
      "  baseline: {estimate: 0.5, sigma: 0.01, unit: m}\n";
};

TEST_F(ExportTest, OfARunGoesToAllFormatsThatHoldIt) {
  expect_done(run({"--out", "first"}));
  const std::string file = "first/calibration.yaml";
  for (const char* format : {"urdf", "wpilib", "kalibr", "csv"}) {
    const Outcome terminal = expect_done({"export", file, "--to", format});
    expect_done({"export", file, "--to", format, "--out", "exported"});
    EXPECT_EQ(terminal.out, read("exported")) << format;
    EXPECT_NE(terminal.err.find(std::string("not in ") + format + ": "), std::string::npos);
  }
  // What it writes for Kalibr is what a run reads.
  expect_done({"export", file, "--to", "kalibr", "--out", "chain.yaml"});
  expect_done(run({"--set", "cameras.kalibr=" + at("chain.yaml").string(), "--out", "again"}));
}

TEST_F(ExportTest, LeavesWhatAnotherOneIsWritingAlone) {
  write("sides.yaml", kSides);
  write("sides.csv.tmp", "half");
  expect_done({"export", "sides.yaml", "--to", "csv", "--out", "sides.csv"});
  EXPECT_EQ(read("sides.csv.tmp"), "half");
}

TEST_F(ExportTest, ARunStartsFromItAndDoesNotOverwriteIt) {
  expect_done(run({"--out", "first"}));
  const std::string first = read("first/calibration.yaml");
  const std::string from = "calibration=" + at("first/calibration.yaml").string();
  const Outcome refused = viwo(run({"--set", from, "--out", "first"}));
  EXPECT_EQ(refused.code, 2);
  EXPECT_EQ(refused.err,
            "first/calibration.yaml  is an input, which the results would replace - write them "
            "elsewhere\n");
  EXPECT_EQ(read("first/calibration.yaml"), first);
  expect_done(run({"--set", from, "--out", "second"}));
  // What it was told is what it begins with: three further seconds teach little.
  const double r_2 = summary("first")["calibration"]["r_2"]["final"];
  const double sigma = summary("first")["calibration"]["r_2"]["sigma"];
  EXPECT_NEAR(summary("second")["calibration"]["r_2"]["initial"].get<double>(), r_2, sigma);
  // Its resolved configuration is the same run.
  expect_done({"run", "second/config.resolved.yaml", "--out", "third"});
  EXPECT_EQ(read("third/trajectory.tum"), read("second/trajectory.tum"));
}

TEST_F(ExportTest, RefusesWhatItCannotDo) {
  write("c.yaml", kSides);
  expect_refused({"export", "c.yaml", "--to", "kalibr", "--out", "out"},
                 "c.yaml has a base 'differential' (r_left, r_right, baseline) and no cameras; "
                 "kalibr holds cameras - formats that hold this one: urdf, ros2_control, wpilib, "
                 "csv");
  expect_refused({"export", "c.yaml", "--to", "sdf"},
                 "no format 'sdf' - known: urdf, ros2_control, wpilib, kalibr, csv");
  expect_refused({"export", "none.yaml", "--to", "csv"}, "none.yaml  no such file");
  expect_refused({"export", "c.yaml"},
                 "viwo export: the option '--to' is required but missing (see viwo export --help)");
  write("c.yaml", kSides + "status: diverged\nreasons: [too fast]\n");
  expect_refused({"export", "c.yaml", "--to", "csv", "--out", "out"},
                 "c.yaml:7:9  this calibration is not to be used: what it is from has diverged "
                 "(too fast) - calibrate again, or, if you know it to be right, write status: "
                 "doubtful");
  write("c.yaml", kSides + "status: doubtful\nreasons: [too fast]\n");
  const Outcome doubtful = expect_done({"export", "c.yaml", "--to", "csv"});
  EXPECT_EQ(doubtful.err, "warning: c.yaml is doubtful: too fast\nnot in csv: correlations\n");
  EXPECT_NE(doubtful.out.find("# c.yaml is doubtful: too fast\n"), std::string::npos);
}

}  // namespace
}  // namespace viwo

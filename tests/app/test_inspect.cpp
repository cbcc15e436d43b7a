// viwo inspect as a user meets it: exit codes, files, a configuration that is mended.
#include "support.hpp"

namespace viwo {
namespace {

using InspectTest = CommandLineTest;

TEST_F(InspectTest, SaysThatARecordingFitsAndWritesWhatItFound) {
  write("run.yaml", kRun);
  const Outcome outcome = expect_done({"inspect", "run.yaml", "--out", "out"});
  EXPECT_EQ(outcome.err, "");
  EXPECT_NE(outcome.out.find("wheels of sim: 100 Hz over 5 s, 0 gaps"), std::string::npos)
      << outcome.out;
  EXPECT_NE(outcome.out.find("\nno findings\nreport: out/report.html\n"), std::string::npos)
      << outcome.out;
  const nlohmann::json json = nlohmann::json::parse(read("out/inspection.json"));
  EXPECT_EQ(json.at("name"), "small");
  EXPECT_EQ(json.at("faults"), 0);
  EXPECT_NE(read("out/report.html").find("Inspection: small"), std::string::npos);
}

/// A log of ten seconds that turns both ways, with motion capture that is late.
TEST_F(InspectTest, FindsWritesAndMends) {
  const std::string run = replaced(replaced(kRun, "motion: circle", "motion: icr_sweep"),
                                   "duration_s: 5", "duration_s: 60");
  write("run.yaml", run + "odometry: {reference_time_offset_s: 0.3}\n");
  const Outcome outcome = viwo({"inspect", "run.yaml", "--out", "out", "--fix", "fixed.yaml"});
  EXPECT_EQ(outcome.code, 1) << outcome.out << outcome.err;
  EXPECT_NE(outcome.out.find("write  odometry.reference_time_offset_s: "), std::string::npos)
      << outcome.out;
  EXPECT_NE(outcome.out.find("configuration: fixed.yaml\n"), std::string::npos) << outcome.out;
  expect_done({"inspect", "fixed.yaml", "--out", "again"});
}

TEST_F(InspectTest, DoesNotWriteOverTheConfigurationItself) {
  write("run.yaml", kRun);
  expect_refused({"inspect", "run.yaml", "--fix", "./run.yaml"},
                 "--fix ./run.yaml: is the configuration itself, whose comments and "
                 "placeholders would be lost: name another file");
  EXPECT_EQ(read("run.yaml"), kRun);
}

TEST_F(InspectTest, RefusesWhatIsNoConfiguration) {
  write("run.yaml", replaced(kRun, "motion: circle", "motion: cicle"));
  const Outcome outcome = viwo({"inspect", "run.yaml", "--out", "out"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.err.find("run.yaml:12:13"), std::string::npos) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(at("out")));
  expect_refused({"inspect", "run.yaml", "--fix", ""},
                 "viwo inspect: --fix needs the name of a file (see viwo inspect --help)");
}

}  // namespace
}  // namespace viwo

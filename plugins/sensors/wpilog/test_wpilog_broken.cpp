// Logs and parameters that are wrong: clear errors, counted rejections, and never more than that.
#include <random>

#include "peak_memory.hpp"
#include "test_fixture.hpp"

namespace viwo::wpilog {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

const std::string kDrive = "drive_entries: [/d], drive_unit: rad";

/// 50 readings of /d, and a string between them.
std::string small_log() {
  Writer out;
  for (int k = 0; k < 50; ++k) {
    out.add("/d", "double", 20 * k * kMs, number(k));
    out.add("/text", "string", 20 * k * kMs, "nothing of use");
  }
  return out.bytes;
}

TEST_F(WpiLog, ALogThatIsCutIsReadUpToThere) {
  const std::string whole = small_log();
  std::size_t last = 0;
  for (std::size_t size = 12; size <= whole.size(); ++size) {
    const std::string section = log(whole.substr(0, size), kDrive);
    const std::string error = error_of(section);
    if (!error.empty()) {
      EXPECT_LT(size, 60U) << error;  // before the first record
      continue;
    }
    const auto sensor = make_sensor(section);
    const std::size_t n = play(*sensor).size();
    EXPECT_GE(n, last);
    last = n;
    const auto rejections = rejections_of(*sensor);
    if (!rejections.empty()) {
      EXPECT_THAT(rejections, ElementsAre(HasSubstr("log cut short | 1 | a.wpilog: byte ")));
    }
  }
  EXPECT_EQ(last, 50U);
}

TEST_F(WpiLog, AGzippedLogThatIsCutIsReadUpToThereAndACorruptOneIsNot) {
  std::mt19937_64 random(3);
  Writer out;
  for (int k = 0; k < 5000; ++k) {
    out.add("/d", "double", 20 * k * kMs, number(1e-16 * static_cast<double>(random())));
  }
  const std::string file = gzipped(out.bytes);
  const std::string packed = testing::text_of(file);
  const auto sensor = make_sensor(log(packed.substr(0, packed.size() / 2), kDrive));
  EXPECT_GT(play(*sensor).size(), 1000U);
  EXPECT_THAT(rejections_of(*sensor), ElementsAre(HasSubstr("log cut short | 1 | ")));
  std::string corrupt = packed;
  corrupt[packed.size() / 2] = static_cast<char>(~corrupt[packed.size() / 2]);
  EXPECT_THAT(error_of(log(corrupt, kDrive)), HasSubstr("the gzip data are corrupt"));
}

TEST_F(WpiLog, WhatIsNoLogIsSaid) {
  EXPECT_THAT(error_of(log("", kDrive)), HasSubstr("a.wpilog  is empty"));
  EXPECT_THAT(error_of(log("time,d\n0,1\n", kDrive)),
              HasSubstr("a.wpilog  is no WPILOG: it begins with 'time,d'"));
  EXPECT_THAT(error_of(log("WPILOG", kDrive)), HasSubstr("is cut short within its header"));
  EXPECT_THAT(error_of(log("WPILOG" + bytes_of(0x0100, 2) + bytes_of(0xffffffff, 4), kDrive)),
              HasSubstr("is cut short within its header"));
  EXPECT_THAT(error_of(log("WPILOG" + bytes_of(0x0203, 2) + text(""), kDrive)),
              HasSubstr("is a WPILOG of version 2.3: what is read is version 1"));
  EXPECT_THAT(error_of(log(Writer().bytes, kDrive)),
              HasSubstr("sensor.drive_entries: no entry '/d' in "));
  EXPECT_THAT(error_of(log(Writer().bytes, kDrive)), HasSubstr(" - the log has none that fits"));
  EXPECT_THAT(error_of("{type: wpilog, path: " + folder_.string() + ", " + kDrive + "}"),
              HasSubstr("is a folder, not a file"));
}

TEST_F(WpiLog, RecordsThatCannotBeUsedAreCounted) {
  Writer out;
  out.bytes = small_log();
  out.record(99, 0, "of nothing that was started");
  out.record(0, 0, "");
  out.record(0, 0, std::string(1, '\7') + bytes_of(1, 4));
  out.record(0, 0, std::string(1, '\0') + bytes_of(5, 4) + bytes_of(0xffffffff, 4) + "name");
  out.record(0, 0, std::string(1, '\1') + bytes_of(55, 4));
  out.record(1, 2'000 * kMs, "four");
  out.record(1, 0x7fffffffffffffff, number(1.));
  out.record(1, 1'000 * kMs, number(std::numeric_limits<double>::quiet_NaN()));
  out.record(1, 1'000'000 * kMs, number(1.));
  out.record(1, 1'020 * kMs, std::string(2U << 20, 'x'));
  out.bytes += std::string(40, '\0');  // as a power loss leaves it
  out.bytes += "\x80 no record";
  const auto sensor = make_sensor(log(out.bytes, kDrive));
  EXPECT_EQ(play(*sensor).size(), 50U);
  EXPECT_THAT(rejections_of(*sensor),
              ElementsAre(HasSubstr("record of an entry that was not started | 1 | "),
                          HasSubstr("control record that cannot be read | 14 | "),
                          HasSubstr("record of more than 1 MiB | 1 | "),
                          HasSubstr("bytes that are no record: the rest is not read | 1 | "),
                          HasSubstr("wheels: record that does not fit its type | 1 | "),
                          HasSubstr("wheels: stamp that is none | 1 | "),
                          HasSubstr("wheels: value that is not finite | 1 | "),
                          HasSubstr("wheels: stamp far ahead of the previous one | 1 | ")));
}

TEST_F(WpiLog, RecordsOfAnotherNumberOfModulesAreCounted) {
  Writer out;
  for (int k = 0; k < 20; ++k) {
    out.add("/m", "double[]", 20 * k * kMs, numbers(std::vector<double>(k == 3 ? 6 : 4, 1.)));
  }
  out.add("/m", "double[]", 400 * kMs, numbers({1.}));
  out.add("/m", "double[]", 420 * kMs, "");
  const auto sensor =
      make_sensor(log(out.bytes, "module_entries: [/m], drive_unit: rad, max_gap_s: 1"));
  EXPECT_EQ(play(*sensor).size(), 19U);
  EXPECT_THAT(rejections_of(*sensor),
              ElementsAre(HasSubstr("record of another number of values than the first | 1"),
                          HasSubstr("record that does not fit its type | 1"),
                          HasSubstr("record of nothing | 1")));
}

TEST_F(WpiLog, AnEntryThatIsNotThereIsAnsweredWithThoseThatFit) {
  Writer out;
  out.geometry();
  out.start(90, "/empty", "double");
  out.add("/Drive/States", "struct:SwerveModuleState[]", 0, numbers({1., 2.}));
  out.add("/Drive/Left", "double", 0, number(1.));
  out.add("/Drive/Mode", "string", 0, "teleop");
  out.add("/Pose", "struct:Pose2d", 0, numbers({1., 2., 3.}));
  out.add("/odd", "struct:Unknown", 0, "x");
  const auto error = [&](const std::string& rest) { return error_of(log(out.bytes, rest)); };
  const std::string file = (folder_ / "a.wpilog").string();
  EXPECT_THAT(error("module_entries: [/Drive/State], wheel_radius_m: 1"),
              HasSubstr("sensor.module_entries: no entry '/Drive/State' in " + file +
                        " - did you mean '/Drive/States'?"));
  EXPECT_THAT(error("module_entries: [/Modules], wheel_radius_m: 1"),
              HasSubstr("no entry '/Modules' in " + file + " - there are: /Drive/States"));
  EXPECT_THAT(error("pose_entries: [/Estimate]"), HasSubstr(" - there are: /Pose"));
  EXPECT_THAT(error("drive_entries: [/Drive/Right], drive_unit: rad"),
              HasSubstr("no entry '/Drive/Right' in " + file + " - there are: /Drive/Left"));
  EXPECT_THAT(error("drive_entries: [/empty], drive_unit: rad"),
              HasSubstr("the entry '/empty' in " + file + " has no records"));
  EXPECT_THAT(error("drive_entries: [/Drive/Mode], drive_unit: rad"),
              HasSubstr("'/Drive/Mode' in " + file + " is no number, but of type 'string'"));
  EXPECT_THAT(
      error("drive_entries: [/Pose/translation/q], drive_unit: rad"),
      HasSubstr("is no number, but of type 'struct:Pose2d' without a number 'translation/q'"));
  EXPECT_THAT(error("drive_entries: [/odd], drive_unit: rad"),
              HasSubstr("the entry '/odd' in " + file +
                        " cannot be read: struct 'Unknown': the log has no schema of it"));
  EXPECT_THAT(error("drive_entries: [/Drive/Left], drive_unit: rad, cycle_entry: /Drive/Mod"),
              HasSubstr("sensor.cycle_entry: no entry '/Drive/Mod'"));
}

TEST_F(WpiLog, AnEntryOfTwoTypesIsRefused) {
  Writer out;
  out.bytes = small_log();
  out.start(50, "/d", "int64");
  EXPECT_THAT(error_of(log(out.bytes, kDrive)), IsEmpty()) << "one has no records";
  out.record(50, 0, bytes_of(1, 8));
  EXPECT_THAT(error_of(log(out.bytes, kDrive)),
              HasSubstr("the entry '/d' is of two types, 'double' and 'int64'"));
}

TEST_F(WpiLog, SaysWhatIsWrongWithItsParameters) {
  Writer out;
  out.bytes = small_log();
  out.start(40, "/m", "double[]");
  out.record(40, 0, numbers(std::vector<double>(18, 1.)));
  const auto error = [&](const std::string& rest) { return error_of(log(out.bytes, rest)); };
  EXPECT_THAT(error("max_gap_s: 1"),
              HasSubstr("sensor.path: nothing to read: give module_entries"));
  EXPECT_THAT(error("drive_entries: [/d]"),
              HasSubstr("sensor.wheel_radius_m: drive_unit: m needs wheel_radius_m"));
  EXPECT_THAT(error(kDrive + ", module_entries: [/d]"),
              HasSubstr("sensor.module_entries: modules"));
  EXPECT_THAT(error("steer_entries: [/d], pose_entries: [/d]"), HasSubstr("need drive_entries"));
  EXPECT_THAT(error("pose_entries: [/d, /m]"), HasSubstr("needs 1 or 3 names, not 2"));
  EXPECT_THAT(error("gyro_entries: [/a, /b, /c]"), HasSubstr("an IMU has both"));
  EXPECT_THAT(error("module_entries: [/d, /d]"),
              HasSubstr("sensor.module_entries: '/d' is there twice"));
  EXPECT_THAT(error(kDrive + ", stride: 2"), HasSubstr("needs drive_input: angle"));
  EXPECT_THAT(error("module_entries: [/m], drive_unit: rad"),
              HasSubstr("sensor.module_entries: 9 modules, at most 8 are possible"));
}

/// A byte of each would become a number of eight.
TEST_F(WpiLog, RecordsOfMoreElementsThanARobotHasModulesAreNotDecoded) {
  Writer out;
  out.add("/.schema/struct:M", "structschema", 0, "bool speed; A angle");
  out.add("/.schema/struct:A", "structschema", 0, "bool value");
  for (int k = 0; k < 60; ++k) {
    out.add("/m", "struct:M[]", 20 * k * kMs, std::string(1'000'000, '\1'));
  }
  const long before_mb = testing::peak_mb();
  EXPECT_THAT(error_of(log(out.bytes, "module_entries: [/m], drive_unit: rad")), Not(IsEmpty()));
  EXPECT_LT(testing::peak_mb() - before_mb, 400);
}

TEST_F(WpiLog, WhateverBytesThereAreTheyAreReadOrRefused) {
  Writer out;
  out.geometry();
  for (int k = 0; k < 30; ++k) {
    out.add("/m", "struct:SwerveModuleState[]", 20 * k * kMs, numbers({1., 0.1, 2., 0.2}));
    out.add("/p", "struct:Pose3d", 20 * k * kMs, numbers({1., 2., 3., 1., 0., 0., 0.}));
  }
  std::mt19937_64 random(5);
  int read = 0;
  for (int i = 0; i < 500; ++i) {
    std::string bytes = out.bytes;
    for (int n = 1 + static_cast<int>(random() % 8); n > 0; --n) {
      bytes[12 + random() % (bytes.size() - 12)] = static_cast<char>(random());
    }
    read += error_of(log(bytes,
                         "module_entries: [/m], pose_entries: [/p], wheel_radius_m: 1, "
                         "max_rejected_fraction: 1"))
                    .empty()
                ? 1
                : 0;
  }
  EXPECT_GT(read, 50);
  EXPECT_LT(read, 500);
}

}  // namespace
}  // namespace viwo::wpilog

// What loggers, clocks and disks leave behind: never silently wrong.
#include "test_fixture.hpp"

namespace viwo::wpilog {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

const std::string kOneDrive = "drive_entries: [/d], drive_unit: rad";

TEST_F(WpiLog, StampsOfAnEntryThatGoBackBySecondsAreRejected) {
  Writer out;
  for (int k = 0; k < 500; ++k) {
    out.add("/d", "double", (20 * k - (k < 480 ? 0 : 5'010)) * kMs, number(k));
  }
  const auto sensor = make_sensor(log(out.bytes, kOneDrive));
  const auto samples = only<EncoderSample>(play(*sensor));
  ASSERT_EQ(samples.size(), 480U);
  for (std::size_t k = 0; k < 480; ++k) {
    EXPECT_EQ(samples[k].drive_rad_per_s[0], static_cast<double>(k));
  }
  EXPECT_THAT(rejections_of(*sensor),
              ElementsAre(StartsWith("wheels: stamp a second or more before one of the same entry "
                                     "| 20 | a.wpilog: byte ")));
  EXPECT_THAT(error_of(log(out.bytes, kOneDrive + ", max_rejected_fraction: 0.03")),
              HasSubstr("20 of 500 readings rejected"));
}

TEST_F(WpiLog, OfStampsThatContradictEachOtherTheOneThatStandsAloneIsRejected) {
  Writer out;
  for (int k = 0; k < 100; ++k) {
    const int wrong = k == 0 ? 9'000 : k == 40 ? 7'000 : k == 60 ? -8'000 : 0;
    out.add("/d", "double", (20 * k + wrong) * kMs, number(k));
  }
  const auto sensor = make_sensor(log(out.bytes, kOneDrive));
  EXPECT_EQ(play(*sensor).size(), 97U);
  EXPECT_THAT(rejections_of(*sensor), ElementsAre(HasSubstr("of the same entry | 3 | ")));
}

TEST_F(WpiLog, AValueHoldsNoLongerThanItsEntry) {
  Writer out;
  for (int k = 0; k < 10; ++k) {
    out.add("/cycle", "int64", 20 * k * kMs, bytes_of(0, 8));
    if (k == 0) out.add("/d", "double", 0, number(1.));
    if (k == 5) out.record(0, 100 * kMs, std::string(1, '\1') + bytes_of(2, 4));
  }
  const auto sensor = make_sensor(log(out.bytes, kOneDrive + ", cycle_entry: /cycle"));
  EXPECT_EQ(play(*sensor).size(), 6U);
  EXPECT_THAT(rejections_of(*sensor),
              ElementsAre(HasSubstr("wheels: cycle after the end of an entry | 4 | ")));
}

TEST_F(WpiLog, ANumberThatIsGivenToAnotherEntryIsCounted) {
  Writer out;
  for (int k = 0; k < 10; ++k) {
    if (k == 6) out.start(1, "/other", "double");
    out.start(1, k < 6 ? "/d" : "/other", "double");  // again: nothing new
    out.record(1, 20 * k * kMs, number(k));
  }
  const auto sensor = make_sensor(log(out.bytes, kOneDrive));
  EXPECT_EQ(play(*sensor).size(), 6U);
  EXPECT_THAT(rejections_of(*sensor),
              ElementsAre(AllOf(HasSubstr("which was not finished | 1 | a.wpilog: byte "),
                                HasSubstr(", '/other' in place of '/d'"))));
}

TEST_F(WpiLog, MoreThanALogCanHaveIsRefusedBeforeItFillsTheMemory) {
  const std::string file = (folder_ / "bomb.wpilog.gz").string();
  const auto error_with = [&](const std::string& payload, int records, std::size_t noise) {
    gzFile out = gzopen(file.c_str(), "wb1");
    Writer head;
    head.start(1, "/d", "double[]");
    head.start(2, "/other", "raw");
    gzwrite(out, head.bytes.data(), static_cast<unsigned>(head.bytes.size()));
    std::mt19937 random(1);
    for (int k = 0; k < 3000; ++k) {
      Writer block;
      const std::size_t begin = block.bytes.size();
      for (int i = 0; i < records; ++i) block.record(1, 0, payload);
      std::string other(noise, '\0');
      for (char& byte : other) byte = static_cast<char>(random());
      block.record(2, 0, other);
      gzwrite(out, &block.bytes[begin], static_cast<unsigned>(block.bytes.size() - begin));
    }
    gzclose(out);
    return error_of("{type: wpilog, path: " + file + ", " + kOneDrive + "}");
  };
  EXPECT_THAT(error_with(std::string(1U << 17, '\0'), 1, 1),
              HasSubstr("the gzip data become more than 100 times as long"));
  // 5 bytes each in the file, 33 in memory.
  EXPECT_THAT(error_with("0", 1000, 100),
              HasSubstr(" MiB of records of the entries that are named"));
}

TEST_F(WpiLog, WhatIsMissingInADamagedLogIsSaidWithTheDamage) {
  Writer out;
  out.add("/a", "double", 0, number(1.));
  const std::size_t whole = out.bytes.size();
  out.add("/d", "double", 0, number(1.));
  EXPECT_THAT(error_of(log(out.bytes.substr(0, whole + 9), kOneDrive)),
              HasSubstr("no entry '/d' in " + (folder_ / "a.wpilog").string() +
                        "; the log is damaged: log cut short (first at a.wpilog: byte " +
                        std::to_string(whole) + ") - there are: /a"));
  EXPECT_THAT(error_of(log(Writer().bytes + std::string(100, '\0'), kOneDrive)),
              HasSubstr("; the log is damaged: control record that cannot be read (first at "
                        "a.wpilog: byte 12)"));
  EXPECT_THAT(error_of(log(Writer().bytes, kOneDrive)), Not(HasSubstr("damaged")));
}

TEST_F(WpiLog, ASchemaThatIsTooLongIsSaid) {
  Writer out;
  out.schema("Motor", std::string((1U << 20) + 1, ' '));
  out.add("/d", "struct:Motor", 0, number(1.));
  EXPECT_THAT(error_of(log(out.bytes, kOneDrive)),
              HasSubstr("struct 'Motor': its schema has more than 1 MiB and was passed over"));
}

TEST_F(WpiLog, AStructWithOneNumberIsANumberAlsoWithinAnEntry) {
  Writer out;
  out.geometry();
  for (int k = 0; k < 2; ++k) {
    out.add("/m", "struct:SwerveModuleState[]", 20 * k * kMs, numbers({1., 0.1, 2., 0.2}));
    out.add("/p", "struct:Pose2d", 20 * k * kMs, numbers({1., 2., 0.3}));
  }
  const std::string rest = "drive_entries: [/m/0/speed], drive_unit: rad, steer_entries: ";
  const auto samples = play_only<EncoderSample>(log(out.bytes, rest + "[/m/1/angle, /p/rotation]"));
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_EQ(samples[0].steer_rad[0], 0.2);
  EXPECT_EQ(samples[0].steer_rad[1], 0.3);
  EXPECT_THAT(error_of(log(out.bytes, rest + "[/p/translation]")),
              HasSubstr("of type 'struct:Pose2d' without a number 'translation'"));
}

TEST_F(WpiLog, CorruptGzipDataAreAnErrorAlsoWhereTheyCanBeInflated) {
  Writer out;
  for (int k = 0; k < 500; ++k) out.add("/d", "double", 20 * k * kMs, number(k));
  const std::string file = (folder_ / "a.wpilog.gz").string();
  gzFile stored = gzopen(file.c_str(), "wb0");
  gzwrite(stored, out.bytes.data(), static_cast<unsigned>(out.bytes.size()));
  gzclose(stored);
  std::string packed = testing::text_of(file);
  EXPECT_THAT(error_of(log(packed, kOneDrive)), IsEmpty());
  int stopped = 0;
  for (std::size_t at = packed.size() / 2; at < packed.size() / 2 + 30; ++at) {
    std::string corrupt = packed;
    corrupt[at] = '\xff';  // no record begins so
    if (corrupt == packed) continue;
    ++stopped;
    EXPECT_THAT(error_of(log(corrupt, kOneDrive)), HasSubstr("the gzip data are corrupt")) << at;
  }
  EXPECT_GT(stopped, 20);
}

TEST_F(WpiLog, LongListsOfEntriesBeginWithTheNearestAndEndAtAWholeName) {
  Writer out;
  for (int k = 0; k < 200; ++k) {
    out.add("DS:joystick" + std::to_string(k) + "/axes", "double", 0, number(1.));
  }
  out.add("NT:/Robot/Drive/GyroYawAngle", "double", 0, number(1.));
  const std::string error = error_of(log(out.bytes, "heading_entry: /Drive/GyroYaw"));
  EXPECT_THAT(error, HasSubstr(" - there are: NT:/Robot/Drive/GyroYawAngle, DS:joystick"));
  EXPECT_THAT(error, ::testing::ContainsRegex("/axes, \\.\\.\\. \\([0-9]+ more\\)"));
}

TEST_F(WpiLog, APoseAsALimelightWritesItIsExplained) {
  Writer out;
  out.add("/limelight/botpose", "double[]", 0, numbers(std::vector<double>(11, 90.)));
  EXPECT_THAT(error_of(log(out.bytes, "pose_entries: [/limelight/botpose]")),
              HasSubstr("it has 11 numbers, a pose has 3 (x, y, yaw) or 7"));
  const auto poses = play_only<PoseSample>(
      log(out.bytes,
          "pose_entries: [/limelight/botpose/0, /limelight/botpose/1, /limelight/botpose/5], "
          "yaw_unit: deg"));
  ASSERT_EQ(poses.size(), 1U);
  EXPECT_EQ(poses[0].p_BinW_m[0], 90.);
}

TEST_F(WpiLog, MembersOfOneNameAreRefused) {
  Writer out;
  out.schema("Motor", "double speed;double speed");
  out.add("/d", "struct:Motor", 0, numbers({1., 2.}));
  EXPECT_THAT(error_of(log(out.bytes, "drive_entries: [/d/speed], drive_unit: rad")),
              HasSubstr("declaration 'double speed': a member of that name is there already"));
}

TEST_F(WpiLog, BytesThatAreNoTextAreEscaped) {
  Writer out;
  out.add("/\xff\xc3\xb6", "double", 0, number(1.));
  EXPECT_THAT(error_of(log(out.bytes, "drive_entries: [/nothing_near], drive_unit: rad")),
              HasSubstr(" - there are: /\\xff\xc3\xb6"));
}

TEST_F(WpiLog, SpeedsThatNoDriveHasAreRejected) {
  Writer out;
  for (int k = 0; k < 50; ++k) {
    out.add("/d", "double", 20 * k * kMs, number(k == 20 ? 1e100 : k == 30 ? 1e3 : 1.));
  }
  const auto sensor =
      make_sensor(log(out.bytes, "drive_entries: [/d], drive_unit: m, wheel_radius_m: 0.05"));
  EXPECT_EQ(play(*sensor).size(), 48U);
  EXPECT_THAT(rejections_of(*sensor),
              ElementsAre(HasSubstr("wheels: drive faster than 1e4 rad/s | 2 | ")));
}

}  // namespace
}  // namespace viwo::wpilog

// Lines, numbers and tables.
#include <cmath>
#include <cstring>
#include <random>

#include <gmock/gmock.h>

#include "log_files.hpp"
#include "viwo/log/table_reader.hpp"
#include "viwo/log/text.hpp"
#include "viwo/log/text_reader.hpp"
#include "viwo/math/number_text.hpp"

namespace viwo::log {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;

class TextReaderTest : public InFolder {};
class TableReaderTest : public InFolder {};

std::vector<std::string> lines_of(const std::filesystem::path& file) {
  TextReader reader(file);
  std::vector<std::string> lines;
  for (std::string_view line; reader.next(line);) lines.emplace_back(line);
  return lines;
}

/// Text that does not compress, of about `size` bytes.
std::string noise_text(std::size_t size) {
  std::mt19937_64 random(7);
  std::string text;
  while (text.size() < size) text += std::to_string(random()) + "\n";
  return text;
}

TEST_F(TextReaderTest, ReadsLinesWithAndWithoutEnding) {
  EXPECT_THAT(lines_of(write("a", "one\n\ntwo\r\nthree")), ElementsAre("one", "", "two", "three"));
  EXPECT_THAT(lines_of(write("b", "\xEF\xBB\xBFone\n")), ElementsAre("one"));
}

TEST_F(TextReaderTest, ReadsTheSameFromPlainAndGzippedFilesOfManyBlocks) {
  const std::string text = noise_text(500'000);
  const auto plain = lines_of(write("plain", text));
  EXPECT_EQ(plain.size(), static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')));
  std::string joined;
  for (const std::string& line : plain) joined += line + "\n";
  EXPECT_EQ(joined, text);
  EXPECT_EQ(lines_of(write_gz("packed", text)), plain);
}

TEST_F(TextReaderTest, RefusesATruncatedGzipAtTheLineWhereItEnds) {
  const std::string bytes = text_of(write_gz("whole.gz", noise_text(300'000)));
  for (const std::size_t size : {bytes.size() / 2, bytes.size() - 1, bytes.size() - 8}) {
    const auto file = write("cut.gz", bytes.substr(0, size));
    std::int64_t last = 0;
    const std::string message = error_of([&] {
      TextReader reader(file);
      for (std::string_view line; reader.next(line);) last = reader.line_number();
    });
    EXPECT_EQ(message, file.string() + ":" + std::to_string(last + 1) +
                           "  the gzip data end early: the file is truncated");
  }
}

TEST_F(TextReaderTest, ReadsAllMembersOfAGzipAndRefusesWhatIsNoneBehindThem) {
  const std::string one = text_of(write_gz("one.gz", "1\n2\n"));
  const std::string two = text_of(write_gz("two.gz", "3\n"));
  EXPECT_THAT(lines_of(write("both.gz", one + two)), ElementsAre("1", "2", "3"));
  EXPECT_THAT(lines_of(write("padded.gz", one + std::string(100'000, '\0'))),
              ElementsAre("1", "2"));
  for (const std::string& rest :
       {std::string("3\n"), std::string("\x1f"), std::string(1, '\0') + two}) {
    const auto file = write("rest.gz", one + rest);
    EXPECT_EQ(
        error_of([&] { lines_of(file); }),
        file.string() + ":3  something is behind the gzip data that is none: the file is damaged");
  }
  EXPECT_THAT(lines_of(write("short", "\x1f")), ElementsAre("\x1f"));
}

TEST_F(TextReaderTest, RefusesAGzipWithAFlippedBit) {
  std::string bytes = text_of(write_gz("whole.gz", noise_text(300'000)));
  bytes[bytes.size() - 7] = static_cast<char>(bytes[bytes.size() - 7] ^ 1);  // in the checksum
  const auto file = write("bad.gz", bytes);
  const std::string message = error_of([&] { lines_of(file); });
  EXPECT_NE(message.find("  the gzip data are corrupt: "), std::string::npos) << message;
  EXPECT_TRUE(message.ends_with(": incorrect data check")) << message;
  EXPECT_EQ(message.find(file.string()), message.rfind(file.string())) << "the file twice";
}

TEST_F(TextReaderTest, RefusesWhatIsNoReadableTextFile) {
  const auto empty = write("empty", "");
  EXPECT_EQ(error_of([&] { lines_of(empty); }), empty.string() + ":1  the file is empty");
  const auto none = folder_ / "none";
  EXPECT_EQ(error_of([&] { lines_of(none); }),
            none.string() + "  cannot be read: No such file or directory");
  EXPECT_EQ(error_of([&] { lines_of(folder_); }), folder_.string() + "  is a folder, not a file");
  const auto wide = write("wide", std::string(2'000'000, 'x'));
  EXPECT_EQ(error_of([&] { lines_of(wide); }),
            wide.string() + ":1  a line of more than 1 MiB: not a text log");
}

TEST(Numbers, ParseOnlyWhenTheWholeTextIsOne) {
  EXPECT_EQ(parse_number(" 1.5e3\t"), 1500.);
  EXPECT_EQ(parse_number("+2"), 2.);
  EXPECT_EQ(parse_number("-.5"), -.5);
  EXPECT_TRUE(std::isnan(parse_number("nan").value()));
  EXPECT_TRUE(std::isinf(parse_number("-inf").value()));
  for (const char* text : {"", " ", "1,5", "1.5m", "+-1", "0x10", "1e999", "--1"}) {
    EXPECT_EQ(parse_number(text), std::nullopt) << text;
  }
  EXPECT_EQ(parse_integer("-12"), -12);
  for (const char* text : {"", "1.0", "9223372036854775808", "1e3"}) {
    EXPECT_EQ(parse_integer(text), std::nullopt) << text;
  }
}

TEST(Numbers, SecondsBecomeNanosecondsExactly) {
  EXPECT_EQ(parse_seconds_ns("1403636579.763555527"), 1403636579763555527);
  EXPECT_EQ(parse_seconds_ns("1.403636579763555527e+09"), 1403636579763555527);
  EXPECT_EQ(parse_seconds_ns("0.000000001"), 1);
  EXPECT_EQ(parse_seconds_ns("1e-9"), 1);
  EXPECT_EQ(parse_seconds_ns("-2.5"), -2'500'000'000);
  EXPECT_EQ(parse_seconds_ns("7"), 7'000'000'000);
  EXPECT_EQ(parse_seconds_ns(".5"), 500'000'000);
  EXPECT_EQ(parse_seconds_ns("0.0000000005"), 1);  // half a nanosecond is rounded up
  EXPECT_EQ(parse_seconds_ns("0.00000000049"), 0);
  EXPECT_EQ(parse_seconds_ns("0"), 0);
  for (const char* text : {"", ".", "-", "1.2.3", "nan", "5e9", "1e", "12:30"}) {
    EXPECT_EQ(parse_seconds_ns(text), std::nullopt) << text;
  }
}

TEST(Numbers, WrittenTextReadsBackToTheSameBits) {
  std::mt19937_64 random(11);
  for (int i = 0; i < 10'000; ++i) {
    const std::uint64_t bits = random();
    double value = 0.;
    std::memcpy(&value, &bits, sizeof value);
    // Subnormal numbers are refused when read: no sensor has them.
    if (!std::isnormal(value)) continue;
    EXPECT_EQ(parse_number(number_text(value)), value);
  }
  EXPECT_EQ(number_text(0.1), "0.1");
  EXPECT_TRUE(std::signbit(parse_number(number_text(-0.)).value()));
}

TEST(Suggestions, NameTheNearestSpellingOrAll) {
  const std::vector<std::string> names = {"drive_1", "drive_2", "steer"};
  EXPECT_EQ(did_you_mean("driev_1", names), " - did you mean 'drive_1'?");
  EXPECT_EQ(did_you_mean("ster", names), " - did you mean 'steer'?");
  EXPECT_EQ(did_you_mean("drive_3", {"drive_1", "drve_3"}), " - did you mean 'drve_3'?");
  EXPECT_EQ(did_you_mean("wheel", names), " - there are: drive_1, drive_2, steer");
}

TEST(Suggestions, OfManyNamesBeginWithTheNearestAndEndAtAWholeName) {
  std::vector<std::string> names;
  for (int i = 0; i < 100; ++i) names.push_back("joystick_axis_" + std::to_string(i));
  names.emplace_back("/Robot/Drive/GyroYaw");
  const std::string text = did_you_mean("/Drive/Gyro", names);
  EXPECT_EQ(text.find(" - there are: /Robot/Drive/GyroYaw, joystick_axis_0, "), 0U) << text;
  EXPECT_LT(text.size(), 550U);
  EXPECT_EQ(text.substr(text.rfind(',')), ", ... (73 more)");
  // A hostile file has names as long as itself.
  EXPECT_LT(did_you_mean("/Drive/Gyro", {std::string(20'000'000, 'a'), "b"}).size(), 250U);
}

TEST(Texts, ShowBytesThatAreNoTextAsTheirNumbers) {
  EXPECT_EQ(quoted("a\x01 \xc3\xb6 \xff\xc3"), "'a? \xc3\xb6 \\xff\\xc3'");
  EXPECT_EQ(printable("\x1b[2J\n\xc2\x9b|\xe2\x80\xa8|\xe2\x80\xa6\xff"),
            "?[2J??|?|\xe2\x80\xa6\\xff");
  // What turns the direction of a text; half of a pair.
  EXPECT_EQ(printable("gnp.\xe2\x80\xae|\xe2\x80\xaa|\xe2\x81\xa6|\xe2\x81\xa9|\xe2\x81\xaa"),
            "gnp.?|?|?|?|\xe2\x81\xaa");
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80");
}

TEST_F(TableReaderTest, ReadsEitherSeparatorAndAHeaderBehindAHash) {
  TableReader commas(write("a.csv", "#timestamp [ns], x [m],label\n12, -1.5 ,abc\n\n13,nan,\n"));
  EXPECT_THAT(commas.columns(), ElementsAre("timestamp [ns]", "x [m]", "label"));
  ASSERT_TRUE(commas.next());
  EXPECT_EQ(commas.stamp_ns(commas.column("timestamp [ns]")), 12);
  EXPECT_EQ(commas.number(commas.column("x", "m")), -1.5);
  EXPECT_EQ(commas.text(commas.column("label", "any")), "abc");
  ASSERT_TRUE(commas.next());
  EXPECT_TRUE(std::isnan(commas.number(1)));
  EXPECT_EQ(commas.reader().where(), "a.csv:4");
  EXPECT_FALSE(commas.next());
  TableReader semicolons(write("b.csv", "a;b\n1,5;[2, 3]\n"));
  ASSERT_TRUE(semicolons.next());
  EXPECT_EQ(semicolons.text(1), "[2, 3]");
}

TEST_F(TableReaderTest, SaysFileLineAndColumnOfWhatIsWrong) {
  const auto file =
      write("t.csv", "t,drive_1 [rpm]\n1,2\n1\n1,2,3\n1,abc\n1.5,2\n" +
                         std::string("4000000000000000001,\x01") + std::string(50, 'y') + "\n");
  const std::string at = file.string() + ":";
  TableReader table(file);
  EXPECT_EQ(error_of([&] { table.column("tt"); }), at + "1  no column 'tt' - did you mean 't'?");
  EXPECT_EQ(error_of([&] { table.column("drive_1", "rad/s"); }),
            at + "1  column 'drive_1 [rpm]' has another unit than 'drive_1 [rad/s]'");
  EXPECT_EQ(error_of([&] { table.column("steer_1", "rad"); }),
            at + "1  no column 'steer_1 [rad]' - there are: t, drive_1 [rpm]");
  ASSERT_TRUE(table.next());
  EXPECT_EQ(error_of([&] { table.next(); }), at + "3  1 field where the header has 2");
  EXPECT_EQ(error_of([&] { table.next(); }), at + "4  3 fields where the header has 2");
  ASSERT_TRUE(table.next());
  EXPECT_EQ(error_of([&] { table.number(1); }),
            at + "5  column 'drive_1 [rpm]': 'abc' is not a number");
  ASSERT_TRUE(table.next());
  EXPECT_EQ(error_of([&] { table.stamp_ns(0); }), at + "6  column 't': '1.5' is not an integer");
  ASSERT_TRUE(table.next());
  EXPECT_EQ(error_of([&] { table.stamp_ns(0); }),
            at + "7  column 't': '4000000000000000001' is no stamp in nanoseconds");
  EXPECT_EQ(error_of([&] { table.number(1); }),
            at + "7  column 'drive_1 [rpm]': '?" + std::string(39, 'y') + "...' is not a number");
}

TEST_F(TableReaderTest, LeavesOutALastLineThatIsCutShort) {
  const auto rows = [this](const std::string& last, const std::string& before = "1,2\n") {
    TableReader table(write("cut.csv", "t,x\n" + before + last));
    int n = 0;
    while (table.next()) ++n;
    return std::pair(n, table.cut_short());
  };
  for (const char* cut : {"2", "2,", "2,-", "2,1e", "2,1.5e-", "2,[1", "2,("}) {
    EXPECT_EQ(rows(cut), std::pair(1, true)) << cut;
  }
  // WHEN a line is whole, only without an ending, or of words that nobody can tell to be cut
  for (const char* whole : {"2,3", "2,nan", "2,[1]", "2,abc"}) {
    EXPECT_EQ(rows(whole), std::pair(2, false)) << whole;
  }
  EXPECT_EQ(rows("", "1,2\n2,\n"), std::pair(2, false));
  // THEN wrong lines stay errors that power loss does not explain
  EXPECT_THAT(error_of([&] { rows("2\n"); }), EndsWith(":3  1 field where the header has 2"));
  EXPECT_THAT(error_of([&] { rows("2,3,4"); }), EndsWith(":3  3 fields where the header has 2"));
}

TEST_F(TableReaderTest, RefusesAHeaderWithAmbiguousColumns) {
  const auto twice = write("twice.csv", "a,b,a\n");
  EXPECT_EQ(error_of([&] { TableReader{twice}; }),
            twice.string() + ":1  the header has the column 'a' twice");
  const auto nameless = write("nameless.csv", "a,,b\n");
  EXPECT_EQ(error_of([&] { TableReader{nameless}; }),
            nameless.string() + ":1  the header has a column without a name");
  const auto numbers = write("numbers.csv", "1298445274541884928,0.5,nan\n");
  EXPECT_EQ(error_of([&] { TableReader{numbers}; }),
            numbers.string() +
                ":1  numbers where the header is expected: the first line names the columns");
}

TEST_F(TableReaderTest, NamesADecimalComma) {
  const auto file = write("comma.csv", "t;v\n1;2,5\n");
  TableReader own(file), table(file, {.separator = ';'});
  ASSERT_TRUE(own.next());
  EXPECT_THAT(error_of<std::exception>([&] { own.number(1); }),
              EndsWith(":2  column 'v': '2,5' has a decimal comma: numbers have points here"));
  ASSERT_TRUE(table.next());
  EXPECT_THAT(
      error_of<std::exception>([&] { table.number(1); }),
      EndsWith(":2  column 'v': '2,5' has a decimal comma: 'decimal_comma: true' reads it"));
}

TEST_F(TableReaderTest, RefusesAQuantityThatIsThereTwice) {
  const auto file = write("twice.csv", "t [ns],w [deg s^-1],v,w\n1,2,3,4\n");
  TableReader table(file);
  const std::string both = file.string() +
                           ":1  columns 'w [deg s^-1]' and 'w' are the same "
                           "quantity: keep one of them";
  EXPECT_EQ(error_of([&] { table.column("w", "rad s^-1"); }), both);
  EXPECT_EQ(error_of([&] { table.column_in_any_unit("w"); }), both);
  EXPECT_EQ(table.column("v", "m s^-1"), 2U);
}

}  // namespace
}  // namespace viwo::log

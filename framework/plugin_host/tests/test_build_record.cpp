// Build records: found in bytes, compared field by field.
#include <string>

#include <gtest/gtest.h>

#include "support.hpp"
#include "viwo/plugin_host/build_record_check.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

using Records = std::vector<std::string>;

// Put together at run time, so that this test's own file does not contain it.
std::string record(const std::string& fields) {
  return std::string(kBuildRecordBegin) + fields + kBuildRecordEnd;
}

TEST(BuildRecord, IsFoundOnceAmongOtherBytes) {
  const std::string one = record("api=1;compiler=gcc-12;x=-1;");
  const std::string bytes = std::string("\0\x7f", 2) + one + '\0' + "noise" + one + "tail";
  EXPECT_EQ(find_build_records(bytes), Records{one});
}

TEST(BuildRecord, IsNotFoundInItsBareBeginning) {
  const std::string begin{kBuildRecordBegin};
  EXPECT_EQ(find_build_records(begin), Records{});
  EXPECT_EQ(find_build_records(begin + '\0' + "api=1;}"), Records{});
  EXPECT_EQ(find_build_records(begin + "}"), Records{});
  EXPECT_EQ(find_build_records(begin + "api=1}"), Records{});
  EXPECT_EQ(find_build_records(begin + "=1;}"), Records{});
  EXPECT_EQ(find_build_records(begin + "api=1;"), Records{});
  EXPECT_EQ(find_build_records(begin + begin + "api=1;}"), Records{record("api=1;")});
}

TEST(BuildRecord, CopiesThatDifferAreAllFound) {
  const std::string a = record("api=1;");
  const std::string b = record("api=2;");
  EXPECT_EQ(find_build_records(a + b + a), (Records{a, b}));
}

TEST(BuildRecord, DifferencesAreListedInOrderOfTheHost) {
  const auto differences = compare_build_records(record("api=1;compiler=gcc-12;old=3;same=0;"),
                                                 record("same=0;compiler=clang-15;api=1;new=4;"));
  const std::vector<RecordDifference> expected = {
      {"compiler", "gcc-12", "clang-15"}, {"old", "3", "(missing)"}, {"new", "(missing)", "4"}};
  EXPECT_EQ(differences, expected);
}

TEST(BuildRecord, HostIsBuiltLikeTheApi) {
  EXPECT_TRUE(host_record_is_consistent());
  EXPECT_FALSE(host_record_is_consistent(record("api=1;")));
}

TEST(BuildRecord, ApiRecordIsCompleteAndEqualToItself) {
  const std::string own{api_build_record()};
  EXPECT_EQ(find_build_records(own), Records{own});
  EXPECT_TRUE(compare_build_records(own, own).empty());
}

TEST(BuildRecord, RefusalNamesEveryRemedyOnce) {
  EXPECT_EQ(explain({{"api", "1", "2"},
                     {"compiler", "gcc-12", "clang-15"},
                     {"gxx_abi", "1017", "1002"},
                     {"address_sanitizer", "0", "1"},
                     {"eigen_minor", "4", "3"},
                     {"eigen_max_align", "32", "16"},
                     {"eigen_malloc_aligned", "0", "1"},
                     {"eigen_row_major", "0", "1"},
                     {"fast_math", "0", "1"}}),
            "is built differently from this host\n"
            "  api: host 1, plugin 2\n"
            "  compiler: host gcc-12, plugin clang-15\n"
            "  gxx_abi: host 1017, plugin 1002\n"
            "  address_sanitizer: host 0, plugin 1\n"
            "  eigen_minor: host 4, plugin 3\n"
            "  eigen_max_align: host 32, plugin 16\n"
            "  eigen_malloc_aligned: host 0, plugin 1\n"
            "  eigen_row_major: host 0, plugin 1\n"
            "  fast_math: host 0, plugin 1\n"
            "  -> it is for another version of the plugin API: rebuild it against this viwo\n"
            "  -> rebuild it with the compiler of this viwo, and with viwo_add_plugin()\n"
            "  -> build host and plugin with the same VIWO_SANITIZE\n"
            "  -> rebuild it with viwo_add_plugin() of this viwo\n"
            "  -> the instruction sets differ: rebuild it with viwo_add_plugin() of this viwo,"
            " without -march or -mavx of its own\n"
            "  -> rebuild it without EIGEN_DEFAULT_TO_ROW_MAJOR\n"
            "  -> rebuild it without -ffast-math and -Ofast: they change the arithmetic of the"
            " whole process");
}

class BuildRecordFile : public FolderTest {};

TEST_F(BuildRecordFile, OfAPluginIsThatOfTheApiButForTheDigest) {
  const fs::path file = kBadPlugins / "libviwo_kinematics_moody.so";
  const std::string record = build_record_in(text_of(file), file);
  EXPECT_NE(record, api_build_record());
  EXPECT_TRUE(compare_build_records(api_build_record(), record).empty());
}

TEST_F(BuildRecordFile, PartsThatDisagreeAreRefused) {
  const fs::path file = folder_ / "a.so";
  const std::string own(api_build_record());
  const std::string other = replaced(own, "fast_math=0", "fast_math=1");
  EXPECT_EQ(error_of([&] { build_record_in(own + other, file); }),
            "refusing " + file.string() +
                ": has parts that are built differently from each other\n"
                "  fast_math: 0 and 1\n"
                "  -> build all its sources with viwo_add_plugin()");
}

}  // namespace
}  // namespace viwo

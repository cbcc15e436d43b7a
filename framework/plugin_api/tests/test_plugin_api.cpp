// What viwo/api promises to plugins that are already compiled, against the record of its version.
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "in_folder.hpp"
#include "viwo/api/build_record.hpp"
#include "viwo/api/stamp_order.hpp"
#include "viwo/api/status.hpp"

namespace viwo {
namespace {

using testing::text_of;

namespace fs = std::filesystem;

const fs::path kHeaders = fs::path(VIWO_TEST_SOURCE_DIR) / "framework/plugin_api/include";

std::string output_of(const std::string& command) {
  FILE* const pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return "";
  std::string text;
  std::array<char, 4096> buffer;
  for (std::size_t n; (n = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) {
    text.append(buffer.data(), n);
  }
  ::pclose(pipe);
  return text;
}

std::string record_name(int version) {
  return "framework/plugin_api/tests/plugin_api_v" + std::to_string(version) + ".txt";
}

/// Empty if the two are the same; else the first line that differs, and what to do.
std::string difference(const std::string& recorded, const std::string& present) {
  std::istringstream a(recorded), b(present);
  std::string was, is, type;
  for (;;) {
    const bool more_a = static_cast<bool>(std::getline(a, was));
    const bool more_b = static_cast<bool>(std::getline(b, is));
    if (!more_a && !more_b) return "";
    if (!more_a) was = "(nothing)";
    if (!more_b) is = "(nothing)";
    if (was == is) {
      if (!is.empty() && is.front() != ' ') type = is;
      continue;
    }
    if (!was.empty() && was.front() != ' ') type = was;
    return "plugin_api changed: bump kApiVersion in viwo/api/build_record.hpp (plugins that are "
           "already compiled would misread it), then regenerate with\n  " VIWO_API_RECORD " > " +
           record_name(kApiVersion) + " of the new version\nin " + type + "\n  was " + was +
           "\n  is  " + is;
  }
}

TEST(PluginApi, IsThatOfTheRecordOfItsVersion) {
  const std::string recorded = text_of(fs::path(VIWO_TEST_SOURCE_DIR) / record_name(kApiVersion));
  ASSERT_NE(recorded, "") << "no " << record_name(kApiVersion) << ": " << VIWO_API_RECORD
                          << " prints it";
  EXPECT_EQ(difference(recorded, output_of(VIWO_API_RECORD)), "");
}

TEST(PluginApi, HasNoTypeThatTheRecordDoesNotKnow) {
  const std::string recorded = output_of(VIWO_API_RECORD);
  const std::regex declared("\\n(?:struct|class|enum class) (?:VIWO_API )?([A-Za-z]+)[^;{]*\\{");
  int types = 0;
  for (const auto& entry : fs::directory_iterator(kHeaders / "viwo/api")) {
    // A helper that is compiled into the plugin.
    if (entry.path().filename() == "auto_kinematics.hpp") continue;
    const std::string text = text_of(entry.path());
    for (std::sregex_iterator at(text.begin(), text.end(), declared), end; at != end; ++at) {
      const std::string name = (*at)[1];
      // Of the library's own that uses them.
      if (name == "RecordText" || name == "PluginKind" || name == "TypedBuffer") continue;
      ++types;
      EXPECT_NE(recorded.find("\n" + name + "  size "), std::string::npos)
          << name << " of " << entry.path().filename()
          << " is not in framework/plugin_api/tests/api_record.cpp";
    }
  }
  EXPECT_GT(types, 70);
}

/// Compiles the record against headers in which `from` reads `to`.
class ChangedApi : public ::testing::Test {
 protected:
  ChangedApi() { fs::remove_all(folder_); }
  ~ChangedApi() override { fs::remove_all(folder_); }

  std::string record_with(const std::string& header, const std::string& from,
                          const std::string& to) const {
    fs::create_directories(folder_);
    fs::copy(kHeaders, folder_ / "include", fs::copy_options::recursive);
    const fs::path file = folder_ / "include/viwo/api" / header;
    std::string text = text_of(file);
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    if (at == std::string::npos) return "";
    std::ofstream(file) << text.replace(at, from.size(), to);
    const std::string program = (folder_ / "api_record").string();
    const std::string compile = VIWO_API_COMPILE " -I" + (folder_ / "include").string() + " " +
                                VIWO_TEST_SOURCE_DIR
                                "/framework/plugin_api/tests/api_record.cpp -o " +
                                program + " " VIWO_API_LIBRARY " -Wl,-rpath," +
                                fs::path(VIWO_API_LIBRARY).parent_path().string() + " 2>&1";
    return output_of(compile + " && " + program);
  }

  /// What the test of the record would say.
  std::string change(const std::string& header, const std::string& from,
                     const std::string& to) const {
    const std::string text = difference(output_of(VIWO_API_RECORD), record_with(header, from, to));
    const std::size_t at = text.find("\nin ");
    return at == std::string::npos ? text : text.substr(at + 1);
  }

  fs::path folder_ =
      fs::temp_directory_path() /
      (std::string("viwo_api_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(ChangedApi, IsNotSeenInAComment) {
  EXPECT_EQ(change("measurement.hpp", "// The kinds of samples", "// What sensors yield"), "");
}

TEST_F(ChangedApi, IsSeenInTheOrderOfMembers) {
  EXPECT_EQ(change("measurement.hpp",
                   "double u_px = 0.;  ///< to the right, as measured (with "
                   "distortion)\n  double v_px = 0.;",
                   "double v_px = 0.;\n  double u_px = 0.;"),
            "in FeaturePoint  size 24, align 8, members 3\n"
            "  was   u_px  at 8, size 8, double\n"
            "  is    u_px  at 16, size 8, double");
}

TEST_F(ChangedApi, IsSeenInAMemberThatFitsIntoPadding) {
  EXPECT_EQ(change("measurement.hpp", "int camera = 0;", "int camera = 0; int lens = 0;"),
            "in FeatureSample  size 40, align 8, members 3\n"
            "  was FeatureSample  size 40, align 8, members 3\n"
            "  is  FeatureSample  size 40, align 8, members 4");
}

TEST_F(ChangedApi, IsSeenInTheTypeOfAMember) {
  EXPECT_EQ(change("measurement.hpp", "std::int64_t id = 0;", "std::uint64_t id = 0;"),
            "in FeaturePoint  size 24, align 8, members 3\n"
            "  was   id  at 0, size 8, long\n"
            "  is    id  at 0, size 8, unsigned long");
}

TEST_F(ChangedApi, IsSeenInTheOrderOfVirtualFunctions) {
  EXPECT_EQ(change("sensor.hpp", "virtual Status next(Measurement& out) = 0;",
                   "virtual void reset() {}\n  virtual Status next(Measurement& out) = 0;"),
            "in Sensor  size 8, align 8\n"
            "  was   slots 11 (two of the destructor)\n"
            "  is    slots 12 (two of the destructor)");
}

TEST_F(ChangedApi, IsSeenInTheVersionOfAKindOfSamples) {
  const std::string change_of_version = change("measurement.hpp", "\"imu\", 1,", "\"imu\", 2,");
  EXPECT_EQ(change_of_version.substr(0, change_of_version.find(", layout")),
            "in ImuSample  size 56, align 8, members 3\n"
            "  was   kind 'imu', version 1");
  EXPECT_NE(change_of_version.find("\n  is    kind 'imu', version 2, layout "), std::string::npos)
      << change_of_version;
}

TEST_F(ChangedApi, IsSeenInAnEnumerator) {
  EXPECT_EQ(change("status.hpp", "  kRejected,", "  kWaiting,\n  kRejected,"),
            "in Status  size 1, align 1\n"
            "  was   kRejected = 2\n"
            "  is    kWaiting = 2");
}

TEST_F(ChangedApi, IsToldWithWhatToDo) {
  const std::string text = difference("A  size 8\n", "A  size 16\n");
  EXPECT_EQ(text.substr(0, text.find(" (")),
            "plugin_api changed: bump kApiVersion in viwo/api/build_record.hpp");
  EXPECT_NE(text.find("then regenerate with"), std::string::npos);
}

TEST(StampJump, BelievesThePausesOfWhoHasPausedBefore) {
  constexpr std::int64_t kPeriodNs = 20'000'000, kPauseNs = 15'000'000'000;
  StampJump jump;
  std::int64_t t_ns = 0;
  int refused = 0;
  for (int pause = 0; pause < 20; ++pause, t_ns += kPauseNs) {
    for (int i = 0; i < 50; ++i) refused += jump.is_believed(t_ns += kPeriodNs) ? 0 : 1;
  }
  EXPECT_EQ(refused, 1) << "of the first pause alone";
  EXPECT_FALSE(jump.is_believed(t_ns + 3'600'000'000'000)) << "which is another thing";
  EXPECT_TRUE(jump.is_believed(t_ns + kPeriodNs));
  StampJump never(1., 0);
  for (const std::int64_t second : {0, 5, 6, 11, 12}) {
    EXPECT_EQ(never.is_believed(second * 1'000'000'000), second != 5 && second != 11) << second;
  }
}

TEST(StampOrder, ASurveyOfFewPointsIsAsFarApartAsItIs) {
  const auto played = [](std::vector<std::int64_t> seconds, double most) {
    StampOrder order({.max_gap_s = 60., .max_rejected_fraction = most});
    for (const std::int64_t t : seconds) {
      order.accept(t * 1'000'000'000, [t] { return std::to_string(t); });
    }
    order.require_enough("survey", "poses");
    return order.counts().size();
  };
  EXPECT_EQ(played({0, 20, 40, 60, 80, 100}, 0.1), 1U);
  EXPECT_THROW(played({0, 20, 40, 60, 80, 100}, 0.), InputError);
  EXPECT_THROW(played({0, 20, 40}, 0.1), InputError);
  EXPECT_THROW(played({0, 20, 40, 60, 60, 100}, 0.1), InputError);
  EXPECT_THROW(played({0, 1, 2, 2, 3, 4}, 0.1), InputError);
}

}  // namespace
}  // namespace viwo

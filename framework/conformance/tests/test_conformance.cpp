// The kit around its checks: configuration, refusals, texts, names.
#include <fstream>

#include "message_of.hpp"
#include "support.hpp"

namespace viwo::conformance {
namespace {

namespace fs = std::filesystem;

std::string error_of(const fs::path& file, const Options& options) {
  return testing::error_of([&] { check_plugin(file, options); });
}

TEST(Conformance, RefusesWhatTheHostRefuses) {
  const std::string text = error_of("/etc/hostname", {});
  EXPECT_EQ(text,
            "refusing /etc/hostname: is not a shared library - a plugin is built with "
            "viwo_add_plugin()");
}

TEST(Conformance, NeedsASectionThatIsForThePlugin) {
  const fs::path config = fs::temp_directory_path() / "viwo_conformance_other.yaml";
  std::ofstream(config) << "kinematics: {type: something_else}\n";
  Options options;
  options.config = config;
  EXPECT_EQ(
      error_of(broken("kinematics", "none"), options),
      config.string() + ": no section says 'type: broken_none', the plugin that is to be checked");
  fs::remove(config);
}

TEST(Conformance, SaysWhatIsWrongWithTheConfiguration) {
  const fs::path config = fs::temp_directory_path() / "viwo_conformance_wrong.yaml";
  std::ofstream(config) << "kinematics: {type: broken_none, baseline_m: -1}\n";
  Options options;
  options.config = config;
  EXPECT_EQ(failures_of("kinematics", "none", options),
            "construction: no object: " + config.string() +
                ":1:45  kinematics.baseline_m: -1 violates baseline_m > 0 (distance between the "
                "wheels, m)");
  fs::remove(config);
}

TEST(Conformance, IsSaidInLines) {
  EXPECT_EQ(to_text({"schema", {}, {"a note"}, {}}), "ok      schema\n");
  EXPECT_EQ(to_text({"rank", {}, {"a note"}, {"odd"}}), "ok      rank\n          warning: odd\n");
  EXPECT_EQ(to_text({"factors", {}, {}, {}, "no samples"}),
            "skipped factors\n          no samples\n");
  EXPECT_EQ(to_text({"gauge", {"one", "two"}, {"a note"}, {}}, true),
            "FAILED  gauge\n          one\n          two\n          note: a note\n");
}

}  // namespace
}  // namespace viwo::conformance

// Finding plugins, and refusing what does not fit: every message, and that the host goes on.
#include <cfenv>
#include <cstdlib>
#include <cstring>
#include <map>

#include <gtest/gtest.h>
#include <unistd.h>

#include "support.hpp"
#include "viwo/api/plugin.hpp"
#include "viwo/plugin_host/build_record_check.hpp"
#include "viwo/plugin_host/registry.hpp"

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace viwo {
namespace {

namespace fs = std::filesystem;

class Registry : public FolderTest {
 protected:
  /// The reason for which a file is refused; the host then still loads a good one.
  static std::string reason(const fs::path& file) {
    PluginRegistry registry({kBadPlugins});
    std::string text = "not refused";
    try {
      registry.check(file);
    } catch (const PluginRefused& refused) {
      EXPECT_EQ(refused.file(), file);
      EXPECT_EQ(refused.what(), "refusing " + file.string() + ": " + refused.reason());
      text = refused.reason();
    }
    EXPECT_EQ(registry.find("kinematics", "moody").name, "moody");
    return text;
  }

  static fs::path bad(const std::string& name) {
    return kBadPlugins / ("libviwo_kinematics_" + name + ".so");
  }

  /// A copy of the good plugin with some of its bytes replaced.
  fs::path doctored(const std::string& from, const std::string& to) const {
    EXPECT_EQ(from.size(), to.size());
    return write("libviwo_kinematics_moody.so", replaced(text_of(bad("moody")), from, to));
  }
};

TEST_F(Registry, LoadsAPluginAndKnowsAboutIt) {
  PluginRegistry registry({kBadPlugins});
  const PluginInfo info = registry.find("kinematics", "moody");
  EXPECT_EQ(info.kind, "kinematics");
  EXPECT_EQ(info.name, "moody");
  EXPECT_EQ(info.version, "1.2.0");
  EXPECT_EQ(info.summary, "one wheel");
  EXPECT_EQ(info.license, "Apache-2.0");
  EXPECT_EQ(info.file, bad("moody"));
  ASSERT_EQ(info.params.size(), 2u);
  EXPECT_EQ(info.params[0].name, "radius_m");
}

TEST_F(Registry, KeepsTextsOfAPluginValidAfterItIsGone) {
  PluginInfo info;
  {
    PluginRegistry registry({kBadPlugins});
    info = registry.find("sensor", "ticks");
  }
  ASSERT_EQ(info.params.size(), 3u);
  EXPECT_EQ(info.params[1].fallback_section, "{type: moody}");
}

TEST_F(Registry, SuggestsTheNearestName) {
  PluginRegistry registry({folder_, "/no/such/folder"});
  write("libviwo_kinematics_four_wis_wid.so", "");
  write("libviwo_kinematics_differential.so", "");
  write("libviwo_sensor_asl_log.so", "");
  const std::string searched =
      " (searched " + folder_.string() + ", /no/such/folder [no such folder])";
  EXPECT_EQ(error_of([&] { registry.find("kinematics", "four_wsi_wid"); }),
            "no kinematics plugin 'four_wsi_wid' - did you mean 'four_wis_wid'?" + searched);
  EXPECT_EQ(error_of([&] { registry.find("kinematics", "asl_log"); }),
            "no kinematics plugin 'asl_log' - known: differential, four_wis_wid" + searched);
  EXPECT_EQ(error_of([&] { registry.find("update", "x"); }), "no update plugin 'x'" + searched);
  EXPECT_EQ(error_of([] { PluginRegistry({}).find("update", "x"); }),
            "no update plugin 'x' (no folder to search)");
}

TEST_F(Registry, NamesThePackageOfAPluginThatIsElsewhere) {
  PluginRegistry registry({folder_});
  write("libviwo_sensor_ros2_topic.so", "");  // near, but not what is meant
  const auto message = [this](const std::string& name, const std::string& package) {
    return "no sensor plugin '" + name + "' - it comes with the Debian package " + package +
           "; a build without its libraries leaves it out (searched " + folder_.string() + ")";
  };
  EXPECT_EQ(error_of([&] { registry.find("sensor", "ros2_topics"); }),
            message("ros2_topics", "viwo-ros"));
  EXPECT_EQ(error_of([&] { registry.find("sensor", "klt_tracker"); }),
            message("klt_tracker", "viwo-images"));
}

TEST_F(Registry, RefusesTwoFilesForOnePlugin) {
  const auto a = write("a/libviwo_kinematics_moody.so", text_of(bad("moody")));
  const auto b = write("b/libviwo_kinematics_moody.so", "not even a library");
  PluginRegistry registry({folder_ / "a", folder_ / "b", kBadPlugins});
  EXPECT_EQ(error_of([&] { registry.find("kinematics", "moody"); }),
            "two files for the kinematics plugin 'moody': " + a.string() + " and " + b.string() +
                " - remove one, or its folder from the search path");
  EXPECT_EQ(registry.find("sensor", "ticks").name, "ticks") << "others are not affected";
}

TEST_F(Registry, AcceptsTheSameFileFoundTwice) {
  fs::create_symlink(bad("moody"), folder_ / "libviwo_kinematics_moody.so");
  PluginRegistry registry({kBadPlugins, kBadPlugins, folder_});
  EXPECT_EQ(registry.find("kinematics", "moody").file, bad("moody"));
}

TEST_F(Registry, SearchesCommandLineThenEnvironmentThenInstallation) {
  const char* old = std::getenv("VIWO_PLUGIN_PATH");
  const std::string saved = old != nullptr ? old : "";
  ::setenv("VIWO_PLUGIN_PATH", ":/env/a::/env/b", 1);
  const auto folders = PluginRegistry::default_search_path({folder_});
  ::unsetenv("VIWO_PLUGIN_PATH");
  if (old != nullptr) ::setenv("VIWO_PLUGIN_PATH", saved.c_str(), 1);
  ASSERT_EQ(folders.size(), 4u);
  EXPECT_EQ(folders[0], folder_);
  EXPECT_EQ(folders[1], "/env/a");
  EXPECT_EQ(folders[2], "/env/b");
  EXPECT_EQ(folders[3], fs::read_symlink("/proc/self/exe").parent_path().parent_path() /
                            "lib/viwo/plugins/v11");
  EXPECT_EQ(error_of([] { PluginRegistry::default_search_path({"/no/such"}); }),
            "--plugin-path /no/such: no such folder");
}

TEST_F(Registry, ListsEveryLibraryWithItsReason) {
  PluginRegistry registry({kBadPlugins, folder_});
  write("libfoo.so", "text");
  write("readme.txt", "text");
  std::map<std::string, std::string> reasons;
  for (const PluginListing& listing : registry.list()) {
    EXPECT_EQ(listing.info.has_value(), listing.refusal.empty());
    EXPECT_EQ(listing.is_unavailable, listing.refusal.starts_with("cannot be ")) << listing.file;
    reasons[listing.file.filename().string()] =
        listing.info ? "ok " + listing.info->name : listing.refusal.substr(0, 18);
  }
  const std::map<std::string, std::string> expected = {
    {"libfoo.so", "is not a shared li"},
    {"libviwo_kinematics_bad_default.so", "has a wrong parame"},
    {"libviwo_kinematics_fast_math.so", "is built different"},
    {"libviwo_kinematics_gives_nothing.so", "ok gives_nothing"},
    {"libviwo_kinematics_links_another.so", "registers no plugi"},
    {"libviwo_kinematics_misnamed.so", "registers 'moody' "},
    {"libviwo_kinematics_moody.so", "ok moody"},
    {"libviwo_kinematics_no_record.so", "has no build recor"},
#if defined(__x86_64__)
    {"libviwo_kinematics_other_avx.so", "is built different"},
#endif
    {"libviwo_kinematics_other_sanitizer.so", "is built different"},
    {"libviwo_kinematics_null_create.so", "has a descriptor w"},
    {"libviwo_kinematics_null_text.so", "has a descriptor w"},
    {"libviwo_kinematics_sets_mode.so", "changes the floati"},
    {"libviwo_kinematics_short_struct.so", "has a descriptor o"},
    {"libviwo_kinematics_takes_type.so", "has a wrong parame"},
    {"libviwo_kinematics_undefined.so", "cannot be loaded: "},
    {"libviwo_kinematics_unregistered.so", "registers no plugi"},
    {"libviwo_kinematics_unsealed.so", "has no digest in i"},
    {"libviwo_kinematics_wrong_api.so", "is for version 100"},
    {"libviwo_sensor_own_encoders.so", "ok own_encoders"},
    {"libviwo_sensor_range.so", "ok range"},
    {"libviwo_sensor_ticks.so", "ok ticks"},
    {"libviwo_update_failing.so", "ok failing"},
    {"libviwo_update_range.so", "ok range"},
    {"libviwo_update_range_2.so", "ok range_2"},
    {"libviwo_update_range_order.so", "ok range_order"}
  };
  EXPECT_EQ(reasons, expected);
}

TEST_F(Registry, ListsWhatCannotBeReadAsUnavailable) {
  const auto file = write("some/libviwo_kinematics_x.so", "");
  const auto hidden = write("hidden/libviwo_kinematics_x.so", "");
  fs::create_directory(folder_ / "empty");
  fs::permissions(file, fs::perms::none);
  fs::permissions(hidden.parent_path(), fs::perms::none);
  PluginRegistry registry(
      {file.parent_path(), hidden.parent_path(), folder_ / "empty", folder_ / "missing", file});
  // Root may read everything, so somebody else has to try.
  const bool is_root = ::geteuid() == 0;
  constexpr uid_t kNobody = 65534;
  ASSERT_EQ(is_root ? ::seteuid(kNobody) : 0, 0);
  const std::vector<PluginListing> listings = registry.list();
  ASSERT_EQ(is_root ? ::seteuid(0) : 0, 0);
  fs::permissions(hidden.parent_path(), fs::perms::owner_all);
  ASSERT_EQ(listings.size(), 2u);
  EXPECT_EQ(listings[0].file, file);
  EXPECT_EQ(listings[0].refusal, "cannot be read: Permission denied - check its permissions");
  EXPECT_EQ(listings[1].file, hidden.parent_path());
  EXPECT_EQ(listings[1].refusal, "cannot be read: Permission denied");
  EXPECT_TRUE(listings[0].is_unavailable && listings[1].is_unavailable);
}

TEST_F(Registry, RefusesAFolder) {
  fs::create_directory(folder_ / "libviwo_kinematics_x.so");
  EXPECT_EQ(reason(folder_ / "libviwo_kinematics_x.so"), "is a folder, not a shared library");
}

TEST_F(Registry, RefusesAFileThatIsNotThere) {
  EXPECT_EQ(reason(folder_ / "libviwo_kinematics_x.so"), "no such file");
}

TEST_F(Registry, RefusesAFileItMayNotRead) {
  const auto file = write("libviwo_kinematics_x.so", "");
  const auto hidden = write("hidden/libviwo_kinematics_x.so", "");
  fs::permissions(file, fs::perms::none);
  fs::permissions(hidden.parent_path(), fs::perms::none);
  // Root may read everything, so somebody else has to try.
  const bool is_root = ::geteuid() == 0;
  constexpr uid_t kNobody = 65534;
  ASSERT_EQ(is_root ? ::seteuid(kNobody) : 0, 0);
  const std::string text = error_of([&] { PluginRegistry({}).check(file); });
  const std::string of_hidden = error_of([&] { PluginRegistry({}).check(hidden); });
  ASSERT_EQ(is_root ? ::seteuid(0) : 0, 0);
  fs::permissions(hidden.parent_path(), fs::perms::owner_all);
  const std::string why = ": cannot be read: Permission denied - check its permissions";
  EXPECT_EQ(text, "refusing " + file.string() + why);
  EXPECT_EQ(of_hidden, "refusing " + hidden.string() + why);
  EXPECT_EQ(PluginRegistry({kBadPlugins}).find("kinematics", "moody").name, "moody");
}

TEST_F(Registry, RefusesATextFile) {
  EXPECT_EQ(reason(write("libviwo_kinematics_x.so", "#include <viwo/api/plugin.hpp>\n")),
            "is not a shared library - a plugin is built with viwo_add_plugin()");
  EXPECT_EQ(reason(write("libviwo_kinematics_y.so", "")),
            "is not a shared library - a plugin is built with viwo_add_plugin()");
}

TEST_F(Registry, RefusesATruncatedLibraryAtAnyLength) {
  const std::string bytes = text_of(bad("moody"));
  const std::string expected = "is truncated - copy or build it again";
  for (const std::size_t size :
       {std::size_t{20}, std::size_t{70}, bytes.size() / 4, bytes.size() - 1}) {
    EXPECT_EQ(reason(write("libviwo_kinematics_moody.so", bytes.substr(0, size))), expected)
        << size;
  }
}

TEST_F(Registry, RefusesALibraryForAnotherProcessor) {
  std::string bytes = text_of(bad("moody"));
  bytes[18] = static_cast<char>(bytes[18] ^ 0x40);  // e_machine
  EXPECT_EQ(reason(write("libviwo_kinematics_moody.so", bytes)),
            "is built for another processor - rebuild it on this machine");
}

TEST_F(Registry, RefusesAProgram) {
  std::string bytes = text_of(bad("moody"));
  bytes[16] = 2;  // e_type = ET_EXEC
  EXPECT_EQ(reason(write("libviwo_kinematics_moody.so", bytes)),
            "is not a shared library but an object file or a program - a plugin is built with "
            "viwo_add_plugin()");
}

TEST_F(Registry, RefusesALibraryWithoutARecord) {
  EXPECT_EQ(reason(bad("no_record")),
            "has no build record, so it is not a plugin of viwo - register it with "
            "VIWO_REGISTER() and build it with viwo_add_plugin()");
}

TEST_F(Registry, RefusesAnotherApiInTheRecord) {
  const std::string version = std::to_string(kApiVersion), other(version.size(), '9');
  EXPECT_EQ(reason(doctored("{api=" + version + ";", "{api=" + other + ";")),
            "is built differently from this host\n"
            "  api: host " +
                version + ", plugin " + other +
                "\n"
                "  -> it is for another version of the plugin API: rebuild it against this viwo");
}

TEST_F(Registry, RefusesAnotherAlignment) {
  const std::string align = "eigen_max_align=" + std::to_string(EIGEN_MAX_ALIGN_BYTES) + ";";
  EXPECT_EQ(reason(doctored(align, "eigen_max_align=99;")),
            "is built differently from this host\n"
            "  eigen_max_align: host " +
                std::to_string(EIGEN_MAX_ALIGN_BYTES) +
                ", plugin 99\n"
                "  -> the instruction sets differ: rebuild it with viwo_add_plugin() of this viwo, "
                "without -march or -mavx of its own");
}

#if defined(__x86_64__)
TEST_F(Registry, RefusesOtherInstructionSets) {
  const std::string text = reason(bad("other_avx"));
  EXPECT_EQ(text.find("is built differently from this host\n  eigen_max_align: host " +
                      std::to_string(EIGEN_MAX_ALIGN_BYTES) + ", plugin "),
            0U)
      << text;
  EXPECT_TRUE(text.ends_with(
      "  -> the instruction sets differ: rebuild it with viwo_add_plugin() of this viwo, without "
      "-march or -mavx of its own"))
      << text;
}
#endif

TEST_F(Registry, RefusesOtherSanitizers) {
  const bool address = detail::kAddressSanitizer != 0, thread = detail::kThreadSanitizer != 0;
  EXPECT_EQ(reason(bad("other_sanitizer")),
            std::string("is built differently from this host\n") +
                (address ? "  address_sanitizer: host 1, plugin 0\n"
                         : "  address_sanitizer: host 0, plugin 1\n") +
                (thread ? "  thread_sanitizer: host 1, plugin 0\n" : "") +
                "  -> build host and plugin with the same VIWO_SANITIZE");
}

TEST_F(Registry, RefusesFastMath) {
  EXPECT_EQ(reason(bad("fast_math")),
            "is built differently from this host\n"
            "  fast_math: host 0, plugin 1\n"
            "  -> rebuild it without -ffast-math and -Ofast: they change the arithmetic of the "
            "whole process");
}

#if defined(__SSE__)
/// How this thread computes, without the flags that any inexact operation raises.
unsigned floating_point_mode() { return _mm_getcsr() & ~unsigned{_MM_EXCEPT_MASK}; }
#endif

TEST_F(Registry, RefusesAChangeOfTheFloatingPointModeAndUndoesIt) {
  const int rounding = std::fegetround();
#if defined(__SSE__)
  const unsigned before = floating_point_mode();
#endif
  EXPECT_EQ(reason(bad("sets_mode")),
            "changes the floating-point mode of the process when it is loaded - link it without "
            "-ffast-math and -Ofast");
  EXPECT_EQ(std::fegetround(), rounding);
#if defined(__SSE__)
  EXPECT_EQ(floating_point_mode(), before);
#endif
}

#if defined(__SSE__)
TEST_F(Registry, LeavesMxcsrAloneWhenItLoadsAGoodPlugin) {
  const auto file = write("libviwo_kinematics_moody.so", text_of(bad("moody")));
  const unsigned before = floating_point_mode();
  PluginRegistry({folder_}).check(file);
  EXPECT_EQ(floating_point_mode(), before);
}
#endif

TEST_F(Registry, RefusesUndefinedSymbols) {
  EXPECT_EQ(reason(bad("undefined")).substr(0, 18), "cannot be loaded: ");
  EXPECT_NE(reason(bad("undefined")).find("undefined symbol: viwo_function_of_no_library"),
            std::string::npos);
  EXPECT_TRUE(reason(bad("undefined"))
                  .ends_with("\n  -> link what is missing; viwo_add_plugin() shows undefined "
                             "symbols when it links"));
}

TEST_F(Registry, RefusesALibraryThatRegistersNothing) {
  EXPECT_EQ(reason(bad("unregistered")),
            "registers no plugin (it has no symbol 'viwo_plugin') - add VIWO_REGISTER(...) to one "
            "of its sources");
}

TEST_F(Registry, RefusesTheRegistrationOfAnotherLibrary) {
  EXPECT_EQ(reason(bad("links_another")),
            "registers no plugin: the symbol 'viwo_plugin' it sees is that of " +
                fs::canonical(bad("moody")).string() +
                " - add VIWO_REGISTER(...) to one of its sources, and do not link one plugin to "
                "another");
}

TEST_F(Registry, TwoRegistrationsInOneLibraryDoNotLink) {
  const std::string command = std::string(VIWO_TEST_LINK " -shared " VIWO_TEST_TWO_PLUGINS " -o ") +
                              (folder_ / "two.so").string() + " > " + (folder_ / "log").string() +
                              " 2>&1";
  EXPECT_NE(std::system(command.c_str()), 0);
  EXPECT_NE(text_of(folder_ / "log").find("multiple definition of `viwo_plugin'"),
            std::string::npos)
      << text_of(folder_ / "log");
  EXPECT_FALSE(fs::exists(folder_ / "two.so"));
}

TEST_F(Registry, RefusesAShortDescriptor) {
  EXPECT_EQ(reason(bad("short_struct")), "has a descriptor of 16 bytes, this host needs " +
                                             std::to_string(sizeof(PluginDescriptor)) +
                                             " - rebuild it against this viwo");
}

TEST_F(Registry, RefusesAnotherApiInTheDescriptor) {
  EXPECT_EQ(reason(bad("wrong_api")),
            "is for version 1000 of the plugin API, this host has version " +
                std::to_string(kApiVersion) + " - rebuild it against this viwo");
}

TEST_F(Registry, RefusesNullPointersInTheDescriptor) {
  EXPECT_EQ(reason(bad("null_text")), "has a descriptor with a null text - use VIWO_REGISTER(...)");
  EXPECT_EQ(reason(bad("null_create")),
            "has a descriptor with a null pointer - use VIWO_REGISTER(...)");
}

TEST_F(Registry, RefusesAnotherNameThanThatOfTheFile) {
  const std::string expected =
      "registers 'moody' of kind 'kinematics' - its file must be named libviwo_kinematics_moody.so";
  EXPECT_EQ(reason(bad("misnamed")), expected);
  const std::string bytes = text_of(bad("moody"));
  EXPECT_EQ(reason(write("libviwo_sensor_moody.so", bytes)), expected);
  EXPECT_EQ(reason(write("moody.so", bytes)), expected);
  fs::create_symlink(bad("moody"), folder_ / "libviwo_kinematics_alias.so");
  EXPECT_EQ(reason(folder_ / "libviwo_kinematics_alias.so"), expected);
}

TEST_F(Registry, RefusesAWrongParameterTable) {
  EXPECT_EQ(reason(bad("bad_default")),
            "has a wrong parameter table: default of 'r_m': -1 violates r_m >= 0");
  EXPECT_EQ(reason(bad("takes_type")),
            "has a wrong parameter table: 'type' is taken, it names the plugin");
}

}  // namespace
}  // namespace viwo

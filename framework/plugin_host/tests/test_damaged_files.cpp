// Files that are not what was linked, or that change while they are used: refused with a reason,
// and never a signal.
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "plugin_file.hpp"
#include "support.hpp"
#include "viwo/config/errors.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/plugin_host/registry.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

const fs::path kMoody = kBadPlugins / "libviwo_kinematics_moody.so";

class DamagedFile : public FolderTest {
 protected:
  /// Empty when `bytes` are accepted as the plugin moody.
  std::string refusal(const std::string& bytes) {
    const fs::path file = write(std::to_string(n_++) + "/libviwo_kinematics_moody.so", bytes);
    try {
      PluginRegistry({}).check(file);
    } catch (const PluginRefused& refused) {
      return refused.reason();
    }
    return {};
  }

  /// Runs a program on a copy of the plugin; its bytes then.
  std::string after(const std::string& command) {
    const fs::path file = write("after.so", text_of(kMoody));
    EXPECT_EQ(std::system((command + " '" + file.string() + "'").c_str()), 0) << command;
    return text_of(file);
  }

 private:
  int n_ = 0;
};

constexpr const char* kDamaged =
    "is damaged, or was changed after it was linked: the digest in its build record is that of "
    "other bytes - copy or build it again";

TEST_F(DamagedFile, WithoutADigestIsRefused) {
  EXPECT_EQ(refusal(text_of(kBadPlugins / "libviwo_kinematics_unsealed.so")),
            "has no digest in its build record - build it with viwo_add_plugin(), or run "
            "viwo_seal FILE after the link");
}

TEST_F(DamagedFile, IsRefusedForOneBitInItsCode) {
  std::string bytes = text_of(kMoody);
  EXPECT_EQ(refusal(bytes), "");
  const std::size_t at = bytes.find("one wheel");
  ASSERT_NE(at, std::string::npos);
  bytes[at] = static_cast<char>(bytes[at] ^ 1);
  EXPECT_EQ(refusal(bytes), kDamaged);
}

TEST_F(DamagedFile, IsRefusedForMoreSegmentsThanALinkerWrites) {
  std::string bytes = text_of(kMoody);
  constexpr std::size_t kNumberOfSegments = 56;  // in the header of an ELF file of 64 bits
  bytes[kNumberOfSegments] = 65;
  EXPECT_EQ(refusal(bytes), "is damaged: it has 65 segments - copy or build it again");
}

TEST_F(DamagedFile, IsRefusedForAnotherDigest) {
  std::string bytes = text_of(kMoody);
  const std::size_t at = bytes.find(";digest=") + 8;
  bytes[at] = bytes[at] == '0' ? '1' : '0';
  EXPECT_EQ(refusal(bytes), kDamaged);
}

// Without a digest one of four such files ended the program.
TEST_F(DamagedFile, NeverReachesTheLoaderWhateverIsWrongWithIt) {
  const std::string whole = text_of(kMoody);
  std::mt19937 random(7);
  int refused = 0;
  constexpr int kMutations = 300;
  for (int i = 0; i < kMutations; ++i) {
    std::string bytes = whole;
    // Half of them in the first pages, where the loader reads first.
    const std::size_t reach = i % 2 == 0 ? bytes.size() : 4096;
    const std::size_t at = random() % reach;
    const std::size_t n = std::min<std::size_t>(1 + random() % 64, bytes.size() - at);
    switch (random() % 3) {
      case 0:
        for (std::size_t k = 0; k < n; ++k) bytes[at + k] = static_cast<char>(random());
        break;
      case 1:
        bytes.replace(at, n, n, '\0');
        break;
      default:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
    }
    if (bytes != whole && !refusal(bytes).empty()) ++refused;
  }
  EXPECT_GT(refused, kMutations / 2);
}

TEST_F(DamagedFile, IsAcceptedWhenItIsStripped) {
  EXPECT_EQ(refusal(after(VIWO_TEST_STRIP)), "");
  EXPECT_EQ(refusal(after(VIWO_TEST_STRIP " --strip-unneeded --remove-section=.comment")), "");
  EXPECT_LT(after(VIWO_TEST_STRIP).size(), text_of(kMoody).size());
}

TEST_F(DamagedFile, IsAcceptedWithAnotherSearchPathOrNone) {
  const fs::path script =
      write("change.cmake", "file(RPATH_SET FILE \"${FILE}\" NEW_RPATH \"${TO}\")\n");
  const std::string cmake = VIWO_TEST_CMAKE " -DTO=";
  const auto with = [&](const std::string& path) {
    const fs::path file = write("after.so", text_of(kMoody));
    const std::string command =
        cmake + "'" + path + "' -DFILE='" + file.string() + "' -P '" + script.string() + "'";
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    return text_of(file);
  };
  const std::string other = with("$ORIGIN/..");
  EXPECT_NE(other, text_of(kMoody));
  EXPECT_EQ(refusal(other), "");
  EXPECT_EQ(refusal(with("")), "");
}

TEST_F(DamagedFile, OverwrittenWhileItIsUsedChangesNothing) {
  const std::string bytes = text_of(kMoody);
  const fs::path file = write("libviwo_kinematics_moody.so", bytes);
  PluginRegistry registry({folder_});
  const PluginInfo info = registry.check(file);
  EXPECT_EQ(info.file, file);
  write("libviwo_kinematics_moody.so", std::string(bytes.size(), '\xcc'));
  fs::resize_file(file, 0);
  EXPECT_EQ(info.params.front().name, "radius_m");
  config::Errors errors;
  const auto model =
      registry.make_kinematics(config::parse("{type: moody}", "test"), "kinematics", 1, errors);
  ASSERT_NE(model.object, nullptr);
  ModelDescription description;
  model.object->describe(description);
  EXPECT_EQ(description.n_drive, 1);
}

TEST_F(DamagedFile, IsAnotherVersionOnceItIsReplacedOrWritten) {
  const fs::path file = write("a", "text"), other = write("b", "text");
  const FileVersion version = version_of(file);
  EXPECT_TRUE(version_of(file) == version);
  fs::last_write_time(other, fs::last_write_time(file));
  fs::rename(other, file);
  const FileVersion newer = version_of(file);
  EXPECT_FALSE(newer == version);
  fs::last_write_time(file, fs::last_write_time(file) - std::chrono::hours(1));
  EXPECT_FALSE(version_of(file) == newer);
  fs::remove(file);
  EXPECT_TRUE(version_of(file) == FileVersion{});
}

/// A link that leads elsewhere once it was looked at: what was not looked at is never accepted.
TEST_F(DamagedFile, IsNotLoadedInThePlaceOfAnother) {
  const std::string bytes = text_of(kMoody), name = "libviwo_kinematics_moody.so";
  const fs::path whole = write("a/" + name, bytes),
                 damaged = write("b/" + name, replaced(bytes, "one wheel", "0ne wheel"));
  fs::create_symlink(whole, folder_ / name);
  std::atomic<bool> done = false;
  std::thread exchange([&] {
    while (!done) {
      for (const fs::path& target : {damaged, whole}) {
        std::error_code ignored;
        fs::create_symlink(target, folder_ / "next", ignored);
        fs::rename(folder_ / "next", folder_ / name, ignored);
      }
    }
  });
  for (int i = 0; i < 100; ++i) {
    try {
      EXPECT_EQ(PluginRegistry({}).check(folder_ / name).summary, "one wheel");
    } catch (const InputError&) {
    }
  }
  done = true;
  exchange.join();
}

}  // namespace
}  // namespace viwo

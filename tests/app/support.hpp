// Runs the program viwo as a user would: in a folder of its own, with captured output.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "in_folder.hpp"

namespace viwo {

struct Outcome {
  int code = -1;
  std::string out;
  std::string err;
  // 0 with a sanitizer, which takes many times as much of both.
  long peak_mb = 0;   ///< memory at most
  double cpu_s = 0.;  ///< of all threads
};

/// A fresh folder per test, removed afterwards. In every text the program prints, the folder is
/// replaced by TMP.
class CommandLineTest : public testing::InFolder {
 protected:
  std::filesystem::path at(const std::string& name) const { return folder_ / name; }

  std::string read(const std::string& name) const { return testing::text_of(at(name)); }

  nlohmann::json summary(const std::string& folder = "out") const {
    return nlohmann::json::parse(read(folder + "/summary.json"));
  }

  static std::string replaced(std::string text, const std::string& from, const std::string& to) {
    for (std::size_t i = 0; (i = text.find(from, i)) != std::string::npos; i += to.size()) {
      text.replace(i, from.size(), to);
    }
    return text;
  }

  /// Runs `viwo words...` in the folder.
  Outcome viwo(const std::vector<std::string>& words) const {
    const std::string out = at(".stdout").string();
    const std::string err = at(".stderr").string();
    const pid_t child = fork();
    if (child == 0) {
      std::vector<std::string> all{VIWO_TEST_PROGRAM};
      all.insert(all.end(), words.begin(), words.end());
      std::vector<char*> argv;
      for (std::string& word : all) argv.push_back(word.data());
      argv.push_back(nullptr);
      unsetenv("VIWO_PLUGIN_PATH");
      if (chdir(folder_.c_str()) != 0 || freopen(out.c_str(), "w", stdout) == nullptr ||
          freopen(err.c_str(), "w", stderr) == nullptr) {
        _exit(126);
      }
      execv(argv[0], argv.data());
      _exit(127);
    }
    int status = 0;
    rusage usage{};
    wait4(child, &status, 0, &usage);
    Outcome outcome;
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    const auto seconds = [](const timeval& time) {
      return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    };
    outcome.peak_mb = usage.ru_maxrss / 1024;
    outcome.cpu_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
#endif
    outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    outcome.out = replaced(read(".stdout"), folder_.string(), "TMP");
    outcome.err = replaced(read(".stderr"), folder_.string(), "TMP");
    return outcome;
  }

  /// The input is wrong: exactly this on stderr, exit code 2, nothing written.
  void expect_refused(const std::vector<std::string>& words, const std::string& message) const {
    const Outcome outcome = viwo(words);
    EXPECT_EQ(outcome.code, 2);
    EXPECT_EQ(outcome.err, message + "\n");
    EXPECT_EQ(outcome.out, "");
    EXPECT_FALSE(std::filesystem::exists(at("out"))) << "something was written";
    EXPECT_FALSE(std::filesystem::exists(at("results"))) << "something was written";
  }

  Outcome expect_done(const std::vector<std::string>& words) const {
    const Outcome outcome = viwo(words);
    EXPECT_EQ(outcome.code, 0) << outcome.out << outcome.err;
    return outcome;
  }
};

/// A simulated swerve robot that drives a circle for five seconds. Line numbers matter.
inline const std::string kRun =
    "name: small\n"                         // 1
    "sensors:\n"                            // 2
    "  sim:\n"                              // 3
    "    type: planar_simulator\n"          // 4
    "    robot: &robot\n"                   // 5
    "      type: four_wis_wid\n"            // 6
    "      x_m: [0.1, -0.1, -0.1, 0.1]\n"   // 7
    "      y_m: [0.1, 0.1, -0.1, -0.1]\n"   // 8
    "      radius_m: 0.025\n"               // 9
    "      sigma_drive_rad_per_s: 0.001\n"  // 10
    "    duration_s: 5\n"                   // 11
    "    motion: circle\n"                  // 12
    "kinematics: *robot\n";                 // 13
constexpr int kRunSamples = 501;

}  // namespace viwo

// A page in a real browser, as a test sees it.
#pragma once

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <regex>
#include <stdexcept>
#include <string>
#include <system_error>

#include <gtest/gtest.h>
#include <unistd.h>

namespace viwo::report {

inline std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), &pclose);
  std::string output;
  std::array<char, 65536> buffer{};
  while (pipe != nullptr) {
    const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe.get());
    if (n == 0) break;
    output.append(buffer.data(), n);
  }
  return output;
}

/// Path of an installed Chromium or Chrome; empty when there is none.
inline std::string browser() {
  std::string path = output_of(
      "for b in chromium chromium-browser google-chrome; do command -v $b && break; done");
  if (!path.empty()) path.pop_back();  // the end of the line
  return path;
}

/// A new empty folder, removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = ::testing::TempDir() + "viwo_browser_XXXXXX";
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot create a folder");
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// The page as it is after its scripts have run.
inline std::string rendered(const std::string& program, const std::string& html) {
  const TemporaryFolder folder;
  const std::filesystem::path page = folder.path() / "report.html";
  std::ofstream(page, std::ios::binary) << html;
  return output_of("timeout 120 '" + program +
                   "' --headless --no-sandbox --disable-gpu --disable-quic --no-first-run"
                   " --disable-background-networking --disable-component-update --disable-sync"
                   " --user-data-dir='" +
                   (folder.path() / "profile").string() +
                   "' --virtual-time-budget=10000 --dump-dom 'file://" + page.string() +
                   "' 2>/dev/null");
}

inline std::string body_tag(const std::string& dom) {
  std::smatch match;
  return std::regex_search(dom, match, std::regex("<body[^>]*>")) ? match.str() : "no body";
}

}  // namespace viwo::report

// The page in a real browser: every plot is drawn, no script fails, nothing injected runs.
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

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "sample.hpp"
#include "viwo/report/html.hpp"

namespace viwo::report {
namespace {

using ::testing::HasSubstr;

std::string output_of(const std::string& command) {
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
std::string browser() {
  std::string path = output_of(
      "for b in chromium chromium-browser google-chrome; do command -v $b && break; done");
  if (!path.empty()) path.pop_back();  // the end of the line
  return path;
}

/// A new empty folder, removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = testing::TempDir() + "viwo_browser_XXXXXX";
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
std::string rendered(const std::string& program, const std::string& html) {
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

std::string body_tag(const std::string& dom) {
  std::smatch match;
  return std::regex_search(dom, match, std::regex("<body[^>]*>")) ? match.str() : "no body";
}

int count(const std::string& text, const std::string& part) {
  int n = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

TEST(ReportInBrowser, DrawsEveryPlotWithoutAScriptError) {
  const std::string program = browser();
  if (program.empty()) GTEST_SKIP() << "no chromium, chromium-browser or google-chrome in PATH";
  const std::string dom = rendered(program, to_html(sample_document()));
  ASSERT_THAT(dom, HasSubstr("</html>"));
  EXPECT_EQ(body_tag(dom), "<body data-plots=\"" + std::to_string(kSamplePlots) + "\">");

  int n_figures = 0;
  const std::string begin = "<figure class=\"plot";
  for (auto at = dom.find(begin); at != std::string::npos; at = dom.find(begin, at + 1)) {
    const std::string figure = dom.substr(at, dom.find("</figure>", at) - at);
    EXPECT_GE(count(figure, "<svg class=\"main-svg\""), 1) << "figure " << n_figures;
    ++n_figures;
  }
  EXPECT_EQ(n_figures, kSamplePlots);

  // Curves of the top view; names and labels as text, not as markup.
  EXPECT_GE(count(dom, "class=\"trace scatter"), 12);
  EXPECT_THAT(dom, HasSubstr("&lt;i&gt;{{title}}&lt;/i&gt; &amp;amp;"));
  EXPECT_THAT(dom, HasSubstr("&lt;b&gt;not bold&lt;/b&gt;"));
}

TEST(ReportInBrowser, ReportsAPlotThatCannotBeDrawn) {
  const std::string program = browser();
  if (program.empty()) GTEST_SKIP() << "no chromium, chromium-browser or google-chrome in PATH";
  // Without this, an error handler that keeps silent would pass the test above.
  std::string html = to_html(sample_document());
  const std::string good = "\"series\":[";
  html.replace(html.find(good, html.find("id=\"report-data\"")), good.size(), "\"broken\":[");
  const std::string dom = rendered(program, html);
  EXPECT_THAT(body_tag(dom), HasSubstr("data-errors=\"TypeError"));
  EXPECT_THAT(body_tag(dom), HasSubstr("data-plots=\"" + std::to_string(kSamplePlots - 1) + "\""));
  EXPECT_EQ(count(dom, "<p class=\"warning failed\">This plot could not be drawn: "), 1);
}

}  // namespace
}  // namespace viwo::report

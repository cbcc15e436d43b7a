// The page in a real browser: every plot is drawn, no script fails, nothing injected runs.
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "browser.hpp"
#include "sample.hpp"
#include "viwo/report/html.hpp"

namespace viwo::report {
namespace {

using ::testing::HasSubstr;

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

  // Bars of three series; error bars of one of them and of the markers.
  EXPECT_EQ(count(dom, "class=\"trace bars\""), 3);
  EXPECT_EQ(count(dom, "class=\"errorbar\""), 6);
  EXPECT_THAT(dom, HasSubstr("<summary>Configuration &lt;resolved&gt;</summary>"));

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

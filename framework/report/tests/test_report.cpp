// The page as text: structure, escaping, numbers, and data that reads back.
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "assets.hpp"
#include "message_of.hpp"
#include "plots.hpp"
#include "sample.hpp"
#include "text.hpp"
#include "viwo/report/html.hpp"

namespace viwo::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Document one_block(Block block) { return {"T", "", {{"S", {std::move(block)}}}}; }

/// The page without the plot library, in which one would find anything.
std::string own_part(const Document& document) {
  std::string html = to_html(document);
  const std::size_t at = html.find(assets::plotly());
  return html.erase(at, assets::plotly().size());
}

std::string data_text(const std::string& html) {
  const std::string open = R"(<script type="application/json" id="report-data">)";
  const std::size_t begin = html.find(open) + open.size();
  return html.substr(begin, html.find("</script>", begin) - begin);
}

nlohmann::json first_plot(const Document& document) {
  return nlohmann::json::parse(data_text(own_part(document))).at("plots").at(0);
}

std::string refusal_of(const Document& document) {
  return testing::error_of<std::invalid_argument>([&] { to_html(document); });
}

TEST(Text, EscapesWhatHtmlCouldTakeForItsOwn) {
  EXPECT_EQ(escaped("a<b> & \"c\" 'd'"), "a&lt;b&gt; &amp; &quot;c&quot; &#39;d&#39;");
}

TEST(Text, FormatsNumbers) {
  constexpr NumberFormat kSignificant{NumberFormat::Style::kSignificant, 3};
  constexpr NumberFormat kFixed{NumberFormat::Style::kFixed, 2};
  EXPECT_EQ(formatted(0.0123456, kSignificant), "0.0123");
  EXPECT_EQ(formatted(1.5e-7, kSignificant), "1.5e-07");
  EXPECT_EQ(formatted(123456., kSignificant), "123456");
  EXPECT_EQ(formatted(123456.5, kSignificant), "1.23e+05");
  EXPECT_EQ(formatted(-2., kSignificant), "-2");
  EXPECT_EQ(formatted(-0., kSignificant), "0");
  EXPECT_EQ(formatted(2., kFixed), "2.00");
  EXPECT_EQ(formatted(-0.001, kFixed), "0.00");
  EXPECT_EQ(formatted(-0.126, kFixed), "-0.13");
  EXPECT_EQ(formatted(1e300, kFixed).size(), 304U);
  EXPECT_EQ(formatted(kNaN, kFixed), "–");
  EXPECT_EQ(formatted(-kInfinity, kSignificant), "–");
}

TEST(Text, EncodesTheTestVectorsOfRfc4648) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64(std::string("\xff\x00\xfe", 3)), "/wD+");
}

TEST(Report, NeedsNothingFromOutside) {
  const std::string html = own_part(sample_document());
  EXPECT_THAT(html, HasSubstr("default-src 'none'"));
  EXPECT_EQ(count(html, "<link"), 0);
  EXPECT_EQ(count(html, " src=\"http"), 0);
  EXPECT_EQ(count(html, " href=\"http"), 0);
}

TEST(Report, CarriesThePlotLibraryAndItsLicence) {
  const std::string html = to_html(one_block(Paragraph{"p"}));
  EXPECT_GT(assets::plotly().size(), 500'000U);
  EXPECT_EQ(assets::plotly().find("</script"), std::string_view::npos);
  EXPECT_THAT(std::string(assets::plotly().substr(0, 200)),
              HasSubstr(std::string(assets::plotly_version())));
  EXPECT_NE(html.find(assets::plotly()), std::string::npos);
  EXPECT_THAT(own_part(one_block(Paragraph{"p"})), HasSubstr("Permission is hereby granted"));
  EXPECT_THAT(own_part(one_block(Paragraph{"p"})),
              HasSubstr("Plotly.js " + std::string(assets::plotly_version()) + ", MIT licence"));
}

TEST(Report, HasTheBlocksInOrder) {
  const std::string html = own_part(sample_document());
  EXPECT_THAT(html, HasSubstr("<title>Wheel odometry: three estimators</title>"));
  EXPECT_THAT(html, HasSubstr("<p class=\"subtitle\">figure eight, 20 seeds</p>"));
  EXPECT_EQ(count(html, "<section id="), 6);
  EXPECT_EQ(count(html, "<figure class=\"plot"), kSamplePlots);
  EXPECT_THAT(html, HasSubstr("<dt>path length [m]</dt><dd>38.2144</dd>"));
  EXPECT_LT(html.find("<dl>"), html.find("<table>"));
  EXPECT_LT(html.find("<table>"), html.find("class=\"warning\" role"));
  EXPECT_EQ(html.find("{{"), html.find("{{data}} &lt;/p&gt;"));  // no placeholder was left
}

TEST(Report, HasContentsOnlyWhenThereAreManySections) {
  Document document{"T", "", {{"A"}, {"B"}, {"C & D"}}};
  EXPECT_EQ(count(own_part(document), "<nav"), 0);
  document.sections.push_back({"E"});
  EXPECT_EQ(count(own_part(document), "<nav"), 1);
  EXPECT_THAT(own_part(document), HasSubstr("<a href=\"#section-3\">C &amp; D</a>"));
  EXPECT_THAT(own_part(document), HasSubstr("<section id=\"section-3\">\n<h2>C &amp; D</h2>"));
}

TEST(Report, EscapesTextInEveryPlace) {
  const std::string html = own_part(sample_document());
  const std::string plain = own_part(one_block(Paragraph{"p"}));
  EXPECT_EQ(count(html, "<script"), count(plain, "<script"));
  EXPECT_EQ(count(html, "</script"), count(plain, "</script"));
  EXPECT_THAT(html, Not(HasSubstr("<img src=x")));
  EXPECT_THAT(html, Not(HasSubstr("<!-- <script>")));
  const std::string bad = "<x>\"&";
  Document document{bad, bad, {{bad}}};
  document.sections[0].blocks = {Paragraph{bad},
                                 KeyValues{{{bad, bad}}},
                                 Table{bad, {{bad}}, {{bad}}},
                                 Plot{.title = bad, .x_label = bad, .y_label = bad, .caption = bad},
                                 Image{bad, bad, "image/png", bad},
                                 Details{bad, bad}};
  const std::string all = own_part(document);
  EXPECT_EQ(count(all, "<x>"), 0);
  // title twice, subtitle, heading, paragraph, key, value, caption, column, cell, title and caption
  // of the plot, alternative and caption of the image, summary and text of the details
  EXPECT_EQ(count(all, "&lt;x&gt;&quot;&amp;"), 16);
}

TEST(Report, TextThatLooksLikeAPlaceholderStaysText) {
  EXPECT_THAT(own_part(one_block(Paragraph{"{{style}}"})), HasSubstr("<p>{{style}}</p>"));
}

TEST(Report, IsTheSameForTheSameDocument) {
  EXPECT_EQ(to_html(sample_document()), to_html(sample_document()));
}

TEST(Report, EmphasisesTheBestOfEachColumn) {
  Table table{"",
              {{"name"},
               {"low", {}, Best::kLowest},
               {"high", {}, Best::kHighest},
               {"near", {}, Best::kNearest, 6.},
               {"same", {}, Best::kLowest},
               {"plain"}},
              {}};
  table.rows.push_back({"a", 1.5, 7.5, 4.5, 3., 0.5});
  table.rows.push_back({"b", 2.5, 8.5, 6.5, 3., 0.25});
  table.rows.push_back({"c", kNaN, kInfinity, 60.5, "none", 0.125});
  const std::string html = own_part(one_block(table));
  EXPECT_THAT(html, HasSubstr("<td>a</td><td class=\"number best\">1.5</td><td class=\"number\">7.5"
                              "</td><td class=\"number\">4.5</td><td class=\"number\">3</td>"));
  EXPECT_THAT(html, HasSubstr("<td>b</td><td class=\"number\">2.5</td><td class=\"number best\">8.5"
                              "</td><td class=\"number best\">6.5</td>"));
  EXPECT_EQ(count(html, "number best"), 3);
  EXPECT_THAT(html, HasSubstr("<td>c</td><td class=\"number\">–</td>"));
}

TEST(Report, PlotDataReadsBackBitForBit) {
  Plot plot{.title = "t", .x_label = "x [m]", .y_label = "y [m]"};
  plot.series = {{.name = "s",
                  .x = {0.1, 1. / 3., 1e-300, 123456789.123456789},
                  .y = {kNaN, -kInfinity, std::nextafter(1., 2.), -0.5}}};
  plot.series[0].y_low = {0., 1., 2., 3.};
  plot.series[0].y_high = {1., 2., 3., 4.};
  plot.lines = {{ReferenceLine::Direction::kVertical, 0.1, "here"}};
  plot.equal_axes = true;
  const nlohmann::json json = first_plot(one_block(plot));
  const nlohmann::json& series = json.at("series").at(0);
  EXPECT_EQ(series.at("x").get<std::vector<double>>(), plot.series[0].x);
  EXPECT_TRUE(series.at("y").at(0).is_null());
  EXPECT_TRUE(series.at("y").at(1).is_null());
  EXPECT_EQ(series.at("y").at(2).get<double>(), plot.series[0].y[2]);
  EXPECT_EQ(series.at("y_high").at(3), 4.);
  EXPECT_EQ(json.at("x_label"), "x [m]");
  EXPECT_EQ(json.at("equal_axes"), true);
  EXPECT_EQ(json.at("lines").at(0),
            nlohmann::json({{"axis", "x"}, {"value", 0.1}, {"label", "here"}, {"dash", "dot"}}));
}

TEST(Report, ShowsDetailsAsTheyAreWhenAskedFor) {
  const std::string html = own_part(one_block(Details{"Configuration", "\na:\n  - <b>\n"}));
  // The first newline belongs to the tag: HTML drops it.
  EXPECT_THAT(html, HasSubstr("<details>\n<summary>Configuration</summary>\n<pre>\n\na:\n  - "
                              "&lt;b&gt;\n</pre>\n</details>\n"));
}

TEST(Report, PlotDataTellsHowASeriesIsDrawn) {
  Plot plot{.title = "t", .x_label = "", .y_label = "y"};
  plot.series = {{.name = "s", .x = {}, .y = {1., 2.}, .draw = Draw::kBars}};
  plot.series[0].categories = {"first", "second"};
  plot.series[0].width = 0.5;
  plot.series[0].opacity = 0.25;
  plot.lines = {{ReferenceLine::Direction::kHorizontal, 3., "", Dash::kSolid}};
  plot.y_range = {-1., 4.};
  const nlohmann::json json = first_plot(one_block(plot));
  const nlohmann::json& series = json.at("series").at(0);
  EXPECT_EQ(series.at("draw"), "bars");
  EXPECT_EQ(series.at("x"), nlohmann::json({"first", "second"}));
  EXPECT_EQ(series.at("y"), nlohmann::json({1., 2.}));
  EXPECT_EQ(series.at("width"), 0.5);
  EXPECT_EQ(series.at("opacity"), 0.25);
  EXPECT_FALSE(series.contains("y_low"));
  EXPECT_EQ(json.at("lines").at(0).at("dash"), "solid");
  EXPECT_EQ(json.at("y_range"), nlohmann::json({-1., 4.}));
  plot.y_range.reset();
  EXPECT_FALSE(first_plot(one_block(plot)).contains("y_range"));
}

TEST(Report, PlotDataCannotEndItsScript) {
  Plot plot{.title = "</script><!--", .x_label = "", .y_label = "caf\xe9"};  // not UTF-8
  const Document document = one_block(plot);
  EXPECT_EQ(data_text(own_part(document)).find('<'), std::string::npos);
  EXPECT_EQ(first_plot(document).at("title"), "</script><!--");
  EXPECT_EQ(first_plot(document).at("y_label"), "caf\xef\xbf\xbd");
}

TEST(Report, HeatMapDataKeepsRowsAndColumns) {
  Plot plot{.title = "h", .x_label = "", .y_label = ""};
  plot.heat_map = HeatMap{.x = {"a", "b", "c"},
                          .y = {"p", "q"},
                          .z = {{1., 2., kNaN}, {4., 5., 6.}},
                          .text = {},
                          .colour_label = "z [m]"};
  plot.heat_map->z_max = 9.;
  const nlohmann::json map = first_plot(one_block(plot)).at("heat_map");
  EXPECT_EQ(map.at("z").at(1), nlohmann::json({4., 5., 6.}));
  EXPECT_TRUE(map.at("z").at(0).at(2).is_null());
  EXPECT_EQ(map.at("z_max"), 9.);
  EXPECT_FALSE(map.contains("z_min"));
  EXPECT_FALSE(map.contains("text"));
}

TEST(Colours, BelongToTheGroupInAllPlots) {
  Colours colours;
  Series a{.name = "a run 1", .x = {}, .y = {}, .group = "a"};
  Series b{.name = "b", .x = {}, .y = {}};
  Series truth{.name = "truth", .x = {}, .y = {}};
  truth.reference = true;
  EXPECT_EQ(colours.of(truth), "#000000");
  EXPECT_EQ(colours.of(a), "#0072b2");
  EXPECT_EQ(colours.of(b), "#d55e00");
  EXPECT_EQ(colours.of({.name = "a run 2", .x = {}, .y = {}, .group = "a"}), "#0072b2");
  EXPECT_EQ(colours.of({.name = "x", .x = {}, .y = {}, .group = "b"}), "#d55e00");
  EXPECT_EQ(colours.of({.name = "x", .x = {}, .y = {}, .colour = 2}), "#009e73");
  EXPECT_EQ(colours.of({.name = "x", .x = {}, .y = {}, .colour = 9}), "#009e73");
}

TEST(Report, NamesWhatDoesNotFit) {
  EXPECT_EQ(refusal_of(one_block(Table{"Accuracy", {{"a"}, {"b"}}, {{1.}}})),
            "report: table 'Accuracy': a row does not have one cell per column");
  Plot plot{.title = "Path", .x_label = "", .y_label = ""};
  plot.series = {{.name = "s", .x = {1., 2.}, .y = {1.}}};
  EXPECT_EQ(refusal_of(one_block(plot)),
            "report: plot 'Path', series 's': x, y and the band differ in size");
  plot.series = {{.name = "s", .x = {1.}, .y = {1.}, .y_low = {0.}}};
  EXPECT_EQ(refusal_of(one_block(plot)),
            "report: plot 'Path', series 's': x, y and the band differ in size");
  plot.series = {{.name = "s", .x = {1.}, .y = {1.}, .categories = {"both"}}};
  EXPECT_EQ(refusal_of(one_block(plot)),
            "report: plot 'Path', series 's': x, y and the band differ in size");
  plot.series.clear();
  plot.heat_map = HeatMap{.x = {"a", "b"}, .y = {"c"}, .z = {{1.}}, .text = {}};
  EXPECT_EQ(refusal_of(one_block(plot)),
            "report: plot 'Path': z and text of the heat map need a row per y and a column per x");
  EXPECT_EQ(refusal_of(one_block(Image{"I", "", "text/html", ""})),
            "report: image 'I' is of type 'text/html', not PNG, JPEG or SVG");
}

}  // namespace
}  // namespace viwo::report

// Figures for a paper: what gnuplot drew, read back from the SVG.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <regex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include "browser.hpp"
#include "gnuplot_format.hpp"
#include "in_folder.hpp"
#include "sample.hpp"
#include "viwo/report/figures.hpp"

namespace viwo::report {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::text_of;

constexpr const char* kBlue = "rgb(  0, 114, 178)";
constexpr const char* kVermillion = "rgb(213,  94,   0)";

bool has_gnuplot() { return !output_of("command -v gnuplot").empty(); }

#define SKIP_WITHOUT_GNUPLOT() \
  if (!has_gnuplot()) GTEST_SKIP() << "no gnuplot in PATH (Debian: gnuplot-nox)"

Document with_plot(Plot plot) { return {"T", "", {{"S", {std::move(plot)}}}}; }

std::vector<std::string> file_names(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// Throws when it is not well-formed.
boost::property_tree::ptree parsed(const std::filesystem::path& svg) {
  std::istringstream text(text_of(svg));
  boost::property_tree::ptree tree;
  boost::property_tree::read_xml(text, tree);
  return tree;
}

/// "d" of all paths that are stroked in a colour, and all texts, of a tree and what is below it.
void collect(const boost::property_tree::ptree& tree, const std::string& stroke,
             std::vector<std::string>& paths, std::vector<std::string>& texts) {
  for (const auto& [tag, child] : tree) {
    if (tag == "path" && child.get("<xmlattr>.stroke", "") == stroke) {
      paths.push_back(child.get<std::string>("<xmlattr>.d"));
    }
    if (tag == "text") {
      std::string text = child.data();
      text.erase(0, text.find_first_not_of(" \n\t"));
      text.erase(text.find_last_not_of(" \n\t") + 1);
      texts.push_back(text);
    }
    collect(child, stroke, paths, texts);
  }
}

std::vector<std::string> paths_of(const std::filesystem::path& svg, const std::string& stroke) {
  std::vector<std::string> paths, texts;
  collect(parsed(svg), stroke, paths, texts);
  return paths;
}

std::vector<std::string> texts_of(const std::filesystem::path& svg) {
  std::vector<std::string> paths, texts;
  collect(parsed(svg), "", paths, texts);
  return texts;
}

using Line = std::vector<std::pair<double, double>>;

/// The lines of a path "M x,y L x,y ...", each begun by an M; without those of a single point.
std::vector<Line> lines_of(const std::string& path) {
  std::vector<Line> lines;
  std::istringstream in(path);
  for (std::string word; in >> word;) {
    if (word[0] == 'M') lines.emplace_back();
    const std::size_t comma = word.find(',');
    lines.back().emplace_back(std::stod(word.substr(1)), std::stod(word.substr(comma + 1)));
  }
  std::erase_if(lines, [](const Line& line) { return line.size() < 2; });
  return lines;
}

TEST(GnuplotText, IsOneLineBetweenSingleQuotes) {
  EXPECT_EQ(gnuplot_quoted("x [m]"), "'x [m]'");
  EXPECT_EQ(gnuplot_quoted("a'b `ls` \"c\" \\"),
            "'a\xe2\x80\x99"
            "b `ls` \"c\" \\'");
  EXPECT_EQ(gnuplot_quoted("two\nlines\tand\rmore"), "'two lines and more'");
  EXPECT_EQ(gnuplot_quoted("caf\xe9"), "'caf\xef\xbf\xbd'");
  EXPECT_EQ(gnuplot_quoted("\xce\xb4"), "'\xce\xb4'");
}

TEST(GnuplotText, NumbersReadBackTheSame) {
  for (const double value : {0.1, -1. / 3., 1e-300, 123456789.123456789, 5e22}) {
    EXPECT_EQ(std::stod(number(value)), value);
  }
  EXPECT_EQ(number(kNaN), "NaN");
  EXPECT_EQ(number(std::numeric_limits<double>::infinity()), "NaN");
}

TEST(Figures, AreOnePerPlotWithTheirScriptAndData) {
  SKIP_WITHOUT_GNUPLOT();
  const TemporaryFolder folder;
  write_figures(folder.path(), sample_document(), FigureFormat::kSvg);
  const auto names = file_names(folder.path());
  ASSERT_EQ(names.size(), 3U * kSamplePlots);
  EXPECT_EQ(names[0], "01_top_view_first_run.dat");
  EXPECT_EQ(names[1], "01_top_view_first_run.gp");
  EXPECT_EQ(names[2], "01_top_view_first_run.svg");
  EXPECT_EQ(names.back(), "07_script_script_alert_1_script.svg");
  for (const std::string& name : names) {
    if (!name.ends_with(".svg")) continue;
    const auto tree = parsed(folder.path() / name);
    // 8.8 cm at 96 dpi are 332.6 pixels; gnuplot cuts the fraction.
    EXPECT_EQ(tree.get<int>("svg.<xmlattr>.width"), 332) << name;
  }
}

TEST(Figures, HaveACurvePerSeriesInTheColourOfThePage) {
  SKIP_WITHOUT_GNUPLOT();
  const TemporaryFolder folder;
  write_figures(folder.path(), sample_document(), FigureFormat::kSvg);
  const auto top = folder.path() / "01_top_view_first_run.svg";
  for (const char* colour : {kBlue, kVermillion, "rgb(  0, 158, 115)"}) {
    const auto paths = paths_of(top, colour);
    ASSERT_EQ(paths.size(), 1U) << colour;
    const auto lines = lines_of(paths[0]);
    ASSERT_EQ(lines.size(), 2U) << colour;  // in the legend, and the curve
    EXPECT_EQ(lines[0].size(), 2U);
    EXPECT_GT(lines[1].size(), 200U);
  }
  EXPECT_THAT(texts_of(top), ::testing::IsSupersetOf(
                                 {"reference", "drive_only", "paper", "full", "x [m]", "y [m]"}));
  // The curve with a hole is in two parts.
  const auto paths = paths_of(folder.path() / "02_position_error.svg", kVermillion);
  ASSERT_EQ(paths.size(), 1U);
  EXPECT_EQ(lines_of(paths[0]).size(), 3U);
}

TEST(Figures, PutPointsWhereTheAxesSay) {
  SKIP_WITHOUT_GNUPLOT();
  const TemporaryFolder folder;
  Plot plot{.title = "Diagonal", .x_label = "x", .y_label = "y"};
  plot.series = {{.name = "s", .x = {0., 1., 4.}, .y = {0., 1., 4.}}};
  plot.y_range = {0., 4.};
  write_figures(folder.path(), with_plot(plot), FigureFormat::kSvg);
  const auto paths = paths_of(folder.path() / "01_diagonal.svg", kBlue);
  ASSERT_EQ(paths.size(), 1U);
  const auto lines = lines_of(paths[0]);
  ASSERT_EQ(lines.size(), 1U);  // a single series has no legend
  ASSERT_EQ(lines[0].size(), 3U);
  const auto [x0, y0] = lines[0][0];
  const auto [x1, y1] = lines[0][1];
  const auto [x2, y2] = lines[0][2];
  EXPECT_GT(x2 - x0, 200.);
  EXPECT_NEAR((x1 - x0) / (x2 - x0), 0.25, 1e-3);
  EXPECT_NEAR((y1 - y0) / (y2 - y0), 0.25, 1e-3);
  EXPECT_LT(y2, y0);  // up
}

TEST(Figures, KeepEqualAxesEqual) {
  SKIP_WITHOUT_GNUPLOT();
  const TemporaryFolder folder;
  Plot plot{.title = "Wide", .x_label = "x [m]", .y_label = "y [m]"};
  plot.equal_axes = true;
  plot.series = {{.name = "s", .x = {0., 9.}, .y = {0., 3.}}};
  write_figures(folder.path(), with_plot(plot), FigureFormat::kSvg);
  const auto lines = lines_of(paths_of(folder.path() / "01_wide.svg", kBlue).at(0));
  const auto [x0, y0] = lines.at(0).at(0);
  const auto [x1, y1] = lines.at(0).at(1);
  EXPECT_NEAR((y0 - y1) / (x1 - x0), 1. / 3., 2e-3);
}

TEST(Figures, LeaveTheirDataBehind) {
  SKIP_WITHOUT_GNUPLOT();
  const TemporaryFolder folder;
  Plot plot{.title = "Data", .x_label = "x", .y_label = "y"};
  plot.series = {{.name = "first", .x = {1., 2., 3., 4., 5.}, .y = {0.1, kNaN, kNaN, 0.4, 0.5}},
                 {.name = "nothing", .x = {1.}, .y = {kNaN}},
                 {.name = "second", .x = {1.}, .y = {2.}, .y_low = {1.5}, .y_high = {2.5}}};
  write_figures(folder.path(), with_plot(plot), FigureFormat::kSvg);
  EXPECT_EQ(text_of(folder.path() / "01_data.dat"),
            "# first: x, y\n1 0.1\n\n4 0.4\n5 0.5\n"
            "\n\n# second: x, y, low, high\n1 2 1.5 2.5\n");
}

TEST(Figures, PutBarsAboveTheirNamesThoughASeriesHasNotAllOfThem) {
  SKIP_WITHOUT_GNUPLOT();
  const TemporaryFolder folder;
  Plot plot{.title = "Bars", .x_label = "", .y_label = ""};
  plot.series = {
      {.name = "short", .x = {}, .y = {1., 3.}, .draw = Draw::kBars, .categories = {"a", "c"}},
      {.name = "long",
       .x = {},
       .y = {4., 5., 6.},
       .draw = Draw::kBars,
       .categories = {"a", "b", "c"}}};
  write_figures(folder.path(), with_plot(plot), FigureFormat::kSvg);
  // Names in the order in which they come: a, c, b.
  EXPECT_EQ(text_of(folder.path() / "01_bars.dat"),
            "# short: x, y\n0 1\n1 3\n\n\n# long: x, y\n0 4\n2 5\n1 6\n");
  EXPECT_THAT(text_of(folder.path() / "01_bars.gp"), HasSubstr("set xrange [-0.6:2.6]"));
}

TEST(Figures, OfADocumentBeforeDoNotStandBesideThem) {
  SKIP_WITHOUT_GNUPLOT();
  const TemporaryFolder folder;
  Plot plot{.title = "Old", .x_label = "", .y_label = ""};
  plot.series = {{.name = "s", .x = {1., 2.}, .y = {1., 2.}}};
  write_figures(folder.path(), with_plot(plot), FigureFormat::kSvg);
  std::ofstream(folder.path() / "mine.svg") << "mine";
  plot.title = "New";
  write_figures(folder.path(), with_plot(plot), FigureFormat::kSvg);
  EXPECT_THAT(file_names(folder.path()),
              ElementsAre("01_new.dat", "01_new.gp", "01_new.svg", "mine.svg"));
}

/// The compressed streams of a PDF, unpacked; without those that are something else.
std::string streams_of(const std::string& pdf) {
  std::string all;
  const std::string begin = "stream\n", end = "\nendstream";
  for (auto at = pdf.find(begin); at != std::string::npos; at = pdf.find(begin, at)) {
    at += begin.size();
    const std::size_t size = pdf.find(end, at) - at;
    std::vector<Bytef> text(1'000'000);
    uLongf text_size = text.size();
    if (uncompress(text.data(), &text_size, reinterpret_cast<const Bytef*>(pdf.data() + at),
                   size) == Z_OK) {
      all.append(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(text_size));
    }
    at += size + end.size();  // behind it, or its "stream" would begin the next one
  }
  return all;
}

TEST(Figures, AreAlsoPdfOfAColumnsWidthWithTextOfEightPoint) {
  SKIP_WITHOUT_GNUPLOT();
  const TemporaryFolder folder;
  write_figures(folder.path(), sample_document(), FigureFormat::kPdf);
  const std::string pdf = text_of(folder.path() / "02_position_error.pdf");
  EXPECT_EQ(pdf.substr(0, 5), "%PDF-");
  const std::string streams = streams_of(pdf);
  // 8.8 cm are 249.4 pt. Newer versions of cairo put the page into a stream, too.
  EXPECT_THAT(pdf + streams, HasSubstr("/MediaBox [ 0 0 249"));
  // Text is placed by "size 0 0 -size x y Tm" in points.
  std::smatch match;
  const std::regex placed("([0-9.]+) 0 0 -([0-9.]+) [0-9.]+ [0-9.]+ Tm");
  ASSERT_TRUE(std::regex_search(streams, match, placed)) << streams;
  EXPECT_NEAR(std::stod(match[1]), 8., 0.05);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "02_position_error.svg"));
}

TEST(Figures, ShowTextAndNeverRunIt) {
  SKIP_WITHOUT_GNUPLOT();
  const TemporaryFolder folder;
  const std::string nasty = "'; system('touch pwned'); # `touch pwned` \\\n\"_{a}^b @x <&>";
  Plot plot{.title = nasty, .x_label = nasty, .y_label = nasty};
  plot.series = {{.name = nasty, .x = {0., 1.}, .y = {0., 1.}},
                 {.name = "other", .x = {0., 1.}, .y = {1., 0.}}};
  plot.lines = {{ReferenceLine::Direction::kHorizontal, 0.5, nasty}};
  const std::string nasty_name = "'; `touch pwned` \\ \"_{a}<&>";
  Plot map{.title = "map", .x_label = nasty_name, .y_label = nasty_name};
  map.heat_map = HeatMap{.x = {nasty_name},
                         .y = {nasty_name},
                         .z = {{1.}},
                         .text = {{nasty_name}},
                         .colour_label = nasty_name,
                         .z_min = 0.,
                         .z_max = 1.};
  Document document = with_plot(plot);
  document.sections[0].blocks.emplace_back(map);
  write_figures(folder.path(), document, FigureFormat::kSvg);
  EXPECT_THAT(file_names(folder.path()), ElementsAre("01_system_touch_pwned_touch_pwned_a_b_x.dat",
                                                     "01_system_touch_pwned_touch_pwned_a_b_x.gp",
                                                     "01_system_touch_pwned_touch_pwned_a_b_x.svg",
                                                     "02_map.dat", "02_map.gp", "02_map.svg"));
  const std::string shown =
      "\u2019; system(\u2019touch pwned\u2019); # `touch pwned` \\ \"_{a}^b @x <&>";
  const auto texts = texts_of(folder.path() / file_names(folder.path())[2]);
  EXPECT_EQ(std::count(texts.begin(), texts.end(), shown), 4);
  // Of the map: a column, a row, a cell, the colours and the axes; a double quote becomes a single
  // one in the cell, where the data file cannot hold it.
  const auto of_map = texts_of(folder.path() / "02_map.svg");
  EXPECT_EQ(std::count(of_map.begin(), of_map.end(), "\u2019; `touch pwned` \\ \"_{a}<&>"), 5);
  EXPECT_THAT(of_map, ::testing::Contains("'; `touch pwned` \\ '_{a}<&>"));
}

TEST(Figures, DrawAHeatMapAsCells) {
  SKIP_WITHOUT_GNUPLOT();
  const TemporaryFolder folder;
  write_figures(folder.path(), sample_document(), FigureFormat::kSvg);
  const auto svg = folder.path() / "04_what_each_motion_tells.svg";
  EXPECT_THAT(texts_of(svg),
              ::testing::IsSupersetOf({"icr_sweep", "straight", "circle", "r_1", "delta_o2",
                                       "0.007", "sigma after / before"}));
  const std::string data = text_of(folder.path() / "04_what_each_motion_tells.dat");
  EXPECT_THAT(data, HasSubstr("\n4 0 0.007 \"0.007\"\n"));
  EXPECT_THAT(data, HasSubstr("\n2 1 1 \"1.00\"\n"));
  EXPECT_EQ(data.find("NaN"), std::string::npos);  // the empty cell is left out
}

TEST(Figures, OfAPlotWithoutPointsAreNone) {
  SKIP_WITHOUT_GNUPLOT();
  const TemporaryFolder folder;
  Plot plot{.title = "Empty", .x_label = "", .y_label = ""};
  plot.series = {{.name = "s", .x = {0.}, .y = {kNaN}}};
  write_figures(folder.path(), with_plot(plot), FigureFormat::kSvg);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  plot.series[0].x = {0., 1.};
  EXPECT_THROW(write_figures(folder.path(), with_plot(plot), FigureFormat::kSvg),
               std::invalid_argument);
}

}  // namespace
}  // namespace viwo::report

// A heat map as a gnuplot figure.
#include <algorithm>
#include <cmath>

#include "gnuplot.hpp"
#include "gnuplot_format.hpp"

namespace viwo::report {
namespace {

/// Text in cells is readable up to so many columns.
constexpr std::size_t kMaxColumnsWithText = 12;

/// Ends of the colour scale: those of the map where it has them, else of its values.
std::pair<double, double> colour_range(const HeatMap& map) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const auto& row : map.z) {
    for (const double z : row) {
      if (!std::isfinite(z)) continue;
      low = std::min(low, z);
      high = std::max(high, z);
    }
  }
  return {map.z_min.value_or(low), map.z_max.value_or(high)};
}

/// A double-quoted string of a data file, in which there is no way to write a double quote.
std::string data_string(const std::string& text) {
  std::string result = "\"";
  for (const char c : one_line(text)) {
    if (c == '\\') result += c;
    result += c == '"' ? '\'' : c;
  }
  return result + '"';
}

/// A line per cell: column, row, z, text.
std::string data_of(const HeatMap& map) {
  std::string data = "# column, row, value, text\n";
  for (std::size_t i = 0; i < map.z.size(); ++i) {
    for (std::size_t k = 0; k < map.z[i].size(); ++k) {
      const double z = map.z[i][k];
      if (!std::isfinite(z)) continue;
      data += std::to_string(k) + ' ' + std::to_string(i) + ' ' + number(z) + ' ' +
              data_string(map.text.empty() ? "" : map.text[i][k]) + "\n";
    }
  }
  return data;
}

std::string box(const HeatMap& map) {
  const auto end = [](std::size_t n) { return number(static_cast<double>(n) - 0.5); };
  return "set xrange [-0.5:" + end(map.x.size()) + "]\nset yrange [" + end(map.y.size()) +
         ":-0.5]\n";
}

}  // namespace

GnuplotFigure gnuplot_heat_map(const Plot& plot, const std::string& name, FigureFormat format) {
  constexpr double kRowCm = 0.42, kAxesCm = 1.5;
  const HeatMap& map = *plot.heat_map;
  const auto range = colour_range(map);
  if (!(range.first <= range.second) || map.x.empty()) return {};
  std::string tics;
  const double names_cm = place_names(map.x, tics);
  const double height_cm =
      kAxesCm + names_cm + kRowCm * static_cast<double>(std::max<std::size_t>(map.y.size(), 4));
  std::string script =
      script_header(name, format, height_cm) + "unset key\nunset border\n" +
      axis_labels(plot, 0.4, false) + tics + "set ytics (" + name_tics(map.y, map.y.size()) +
      ") scale 0 noenhanced\n" + box(map) +
      // As in report.js: light enough for dark text in every cell.
      "set palette defined (0 '#6f9fd0', 0.35 '#a9c6de', 0.7 '#e3e5cf', 1 '#fdf0b4')\n";
  if (range.first < range.second) {
    script += "set cbrange [" + number(range.first) + ":" + number(range.second) + "]\n";
  }
  if (!map.colour_label.empty()) {
    script += "set cblabel " + gnuplot_quoted(map.colour_label) + " noenhanced\n";
  }
  std::vector<std::string> parts{
      "data using 1:2:($1-0.48):($1+0.48):($2-0.48):($2+0.48):3 with boxxyerror lc palette "
      "fs solid noborder"};
  if (!map.text.empty() && map.x.size() <= kMaxColumnsWithText) {
    parts.emplace_back("data using 1:2:4 with labels tc rgb '#1c2024' font ',6' noenhanced");
  }
  return {script + plot_command(parts), data_of(map)};
}

}  // namespace viwo::report

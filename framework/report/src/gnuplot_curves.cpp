// Curves, bars and lines as a gnuplot figure.

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "gnuplot.hpp"
#include "gnuplot_format.hpp"
#include "viwo/report/curves.hpp"

namespace viwo::report {
namespace {

constexpr double kPageLineWidth = 1.8;  ///< Series::width that is one pixel here
constexpr double kBandOpacity = 0.16;   ///< as in report.js

/// A series of the page with what gnuplot needs to know about it.
struct Curve {
  const Series* series = nullptr;
  std::string colour;
  bool in_legend = false;
  std::size_t index = 0;  ///< of its block in the data file
  std::vector<double> x;  ///< those of the series, or the places of its categories
  double bar_offset = 0.;
  double bar_width = 0.;

  bool has_band() const { return !series->y_low.empty(); }
  bool is_bars() const { return series->draw == Draw::kBars; }
  bool is_markers() const { return series->draw == Draw::kMarkers; }
  bool has_error_bars() const { return has_band() && (is_bars() || is_markers()); }
};

/// Of all series, each in its place.
std::vector<std::string> categories_of(const std::vector<Curve>& curves) {
  std::vector<std::string> all;
  for (const Curve& curve : curves) {
    for (const std::string& category : curve.series->categories) {
      if (std::find(all.begin(), all.end(), category) == all.end()) all.push_back(category);
    }
  }
  return all;
}

void place_points(std::vector<Curve>& curves) {
  const std::vector<std::string> all = categories_of(curves);
  for (Curve& curve : curves) {
    curve.x = curve.series->x;
    if (curve.series->categories.empty()) continue;
    curve.x.clear();
    for (const std::string& category : curve.series->categories) {
      const auto place = std::find(all.begin(), all.end(), category) - all.begin();
      curve.x.push_back(static_cast<double>(place));
    }
  }
}

/// Least distance of neighbouring bars; 1 for a single one.
double bar_spacing(const std::vector<Curve>& curves) {
  double least = std::numeric_limits<double>::infinity();
  for (const Curve& curve : curves) {
    if (!curve.is_bars()) continue;
    for (std::size_t i = 1; i < curve.series->y.size(); ++i) {
      const double step = std::abs(curve.x[i] - curve.x[i - 1]);
      if (step > 0.) least = std::min(least, step);
    }
  }
  return std::isfinite(least) ? least : 1.;
}

/// The bars of several series stand side by side.
void place_bars(std::vector<Curve>& curves) {
  constexpr double kFilled = 0.75;
  const auto n = static_cast<double>(
      std::count_if(curves.begin(), curves.end(), [](const Curve& c) { return c.is_bars(); }));
  const double width = kFilled * bar_spacing(curves) / std::max(n, 1.);
  double k = 0.;
  for (Curve& curve : curves) {
    if (!curve.is_bars()) continue;
    curve.bar_width = width;
    curve.bar_offset = (k - (n - 1.) / 2.) * width;
    k += 1.;
  }
}

/// What is drawn, in the order of the page. Series without a finite point are left out.
std::vector<Curve> curves_of(const Plot& plot, Colours& colours) {
  std::vector<Curve> curves;
  std::vector<std::pair<std::string, std::string>> listed;
  for (const Series& series : plot.series) {
    Curve curve;
    curve.series = &series;
    curve.colour = colours.of(series);
    if (std::none_of(series.y.begin(), series.y.end(), [](double y) { return std::isfinite(y); })) {
      continue;
    }
    const std::pair key{series.group.empty() ? series.name : series.group, series.name};
    curve.in_legend = std::find(listed.begin(), listed.end(), key) == listed.end();
    if (curve.in_legend) listed.push_back(key);
    curve.index = curves.size();
    curves.push_back(std::move(curve));
  }
  if (listed.size() < 2) {  // one name says nothing that the caption does not
    for (Curve& curve : curves) curve.in_legend = false;
  }
  place_points(curves);
  place_bars(curves);
  return curves;
}

/// A block per series: x, y, and the ends of the band. An empty line interrupts a curve.
std::string data_of(const std::vector<Curve>& curves) {
  std::string data;
  for (const Curve& curve : curves) {
    const Series& series = *curve.series;
    data += (curve.index > 0 ? "\n\n# " : "# ") + one_line(series.name) + ": x, y" +
            (curve.has_band() ? ", low, high\n" : "\n");
    bool any = false, interrupted = false;
    for (std::size_t i = 0; i < series.y.size(); ++i) {
      const double x = curve.x[i];
      if (!std::isfinite(x) || !std::isfinite(series.y[i])) {
        interrupted = any;  // no empty line at the beginning; two of them would end the block
        continue;
      }
      data += std::string(interrupted ? "\n" : "") + number(x) + ' ' + number(series.y[i]);
      if (curve.has_band()) {
        data += ' ' + number(series.y_low[i]) + ' ' + number(series.y_high[i]);
      }
      data += "\n";
      any = true;
      interrupted = false;
    }
  }
  return data;
}

std::string dash_text(Dash dash) {
  switch (dash) {
    case Dash::kSolid:
      return " dt solid";
    case Dash::kDashed:
      return " dt (8,5)";
    case Dash::kDotted:
      return " dt (2,3)";
  }
  return {};
}

/// "#rrggbb" with the opacity in front, as gnuplot writes it.
std::string rgb(const std::string& colour, double opacity) {
  constexpr std::string_view kHex = "0123456789abcdef";
  const auto alpha =
      static_cast<std::size_t>(std::lround(255. * (1. - std::clamp(opacity, 0., 1.))));
  std::string text = " rgb '#";
  if (alpha > 0) {
    text += kHex[alpha / 16];
    text += kHex[alpha % 16];
  }
  return text + colour.substr(1) + "'";
}

/// The style of a curve, for its drawing and for its place in the legend.
std::string style_of(const Curve& curve) {
  const Series& series = *curve.series;
  const std::string colour = " lc" + rgb(curve.colour, series.opacity);
  const std::string line = " lw " + rounded(series.width / kPageLineWidth) +
                           dash_text(series.reference ? Dash::kDashed : series.dash);
  switch (series.draw) {
    case Draw::kLines:
      return "with lines" + colour + line;
    case Draw::kMarkers:
      return "with points pt 7 ps 0.4" + colour;
    case Draw::kLinesAndMarkers:
      return "with linespoints pt 7 ps 0.4" + colour + line;
    case Draw::kBars:
      return "with boxes fs solid noborder" + colour;
  }
  return {};
}

std::string title_of(const Curve& curve) {
  return curve.in_legend ? " title " + gnuplot_quoted(curve.series->name) : " notitle";
}

std::string source_of(const Curve& curve, const std::string& columns) {
  return "data index " + std::to_string(curve.index) + " using " + columns + " ";
}

/// The parts of the plot command: bands below, the truth on top but first in the legend.
std::vector<std::string> plot_parts(const Plot& plot, const std::vector<Curve>& curves) {
  std::vector<std::string> parts, on_top, in_front;
  for (const Curve& curve : curves) {
    if (!curve.has_band() || curve.has_error_bars()) continue;
    parts.push_back(source_of(curve, "1:3:4") + "with filledcurves fc" +
                    rgb(curve.colour, kBandOpacity * curve.series->opacity) +
                    " fs solid noborder notitle");
  }
  for (const Curve& curve : curves) {
    if (curve.series->reference) {
      if (curve.in_legend) in_front.push_back("keyentry " + style_of(curve) + title_of(curve));
      on_top.push_back(source_of(curve, "1:2") + style_of(curve) + " notitle");
      continue;
    }
    const std::string x = curve.is_bars() ? "($1+" + rounded(curve.bar_offset) + ")" : "1";
    const std::string width = curve.is_bars() ? ":(" + rounded(curve.bar_width) + ")" : "";
    // Lines with a stroke at both ends; error bars of gnuplot would leave a gap around the point.
    const std::string error_bars = source_of(curve, x + ":3:(0):($4-$3)") +
                                   "with vectors heads size screen 0.012,90 lw 0.7 lc rgb '" +
                                   (curve.is_bars() ? std::string(kTextColour) : curve.colour) +
                                   "' notitle";
    // Over bars, but under markers.
    if (curve.has_error_bars() && !curve.is_bars()) parts.push_back(error_bars);
    parts.push_back(source_of(curve, x + ":2" + width) + style_of(curve) + title_of(curve));
    if (curve.has_error_bars() && curve.is_bars()) parts.push_back(error_bars);
  }
  parts.insert(parts.begin(), in_front.begin(), in_front.end());
  parts.insert(parts.end(), on_top.begin(), on_top.end());
  for (const ReferenceLine& line : plot.lines) {
    const bool horizontal = line.direction == ReferenceLine::Direction::kHorizontal;
    if (!horizontal || !std::isfinite(line.value) || (plot.log_y && line.value <= 0.)) continue;
    parts.push_back(number(line.value) + " with lines lw 0.7 lc rgb '" + std::string(kLineColour) +
                    "'" + dash_text(line.dash) + " notitle");
  }
  return parts;
}

/// Vertical lines, and the labels of all lines.
std::string lines_of(const Plot& plot) {
  std::string script;
  for (const ReferenceLine& line : plot.lines) {
    const bool horizontal = line.direction == ReferenceLine::Direction::kHorizontal;
    if (!std::isfinite(line.value) || (horizontal && plot.log_y && line.value <= 0.)) continue;
    const std::string at = number(line.value);
    if (!horizontal) {
      script += "set arrow from first " + at + ", graph 0 to first " + at +
                ", graph 1 nohead lw 0.7 lc rgb '" + std::string(kLineColour) + "'" +
                dash_text(line.dash) + "\n";
    }
    if (line.label.empty()) continue;
    script += "set label " + gnuplot_quoted(line.label) + " noenhanced tc rgb '" +
              std::string(kLineColour) + "' at " +
              (horizontal ? "graph 1, first " + at + " right offset -0.3, 0.45"
                          : "first " + at + ", graph 1 left offset 0.4, -0.6") +
              "\n";
  }
  return script;
}

/// Lines that the legend needs under the plot.
int legend_lines(const std::vector<Curve>& curves) {
  constexpr double kSampleCm = 1.1;  ///< line, marker and gap of an entry
  double widest = 0.;
  int n = 0;
  for (const Curve& curve : curves) {
    if (!curve.in_legend) continue;
    ++n;
    widest =
        std::max(widest, kSampleCm + kCharacterCm * static_cast<double>(curve.series->name.size()));
  }
  if (n == 0) return 0;
  const int columns = std::clamp(static_cast<int>(kWidthCm / widest), 1, n);
  return (n + columns - 1) / columns;
}

/// All that is shown in x.
Range x_range(const std::vector<Curve>& curves) {
  Range range;
  for (const Curve& curve : curves) {
    for (const double value : curve.series->x) range.add(value);
  }
  return range;
}

/// All that is shown in y.
Range y_range(const Plot& plot, const std::vector<Curve>& curves) {
  if (plot.y_range) return {plot.y_range->first, plot.y_range->second};
  Range range;
  for (const Curve& curve : curves) {
    if (curve.is_bars()) range.add(0.);
    for (const double value : curve.series->y) range.add(value);
    for (const double value : curve.series->y_low) range.add(value);
    for (const double value : curve.series->y_high) range.add(value);
  }
  return range;
}

/// Height of the figure apart from the legend.
double body_height_cm(const Plot& plot, const std::vector<Curve>& curves) {
  constexpr double kUsual = 5.2, kAxesCm = 1.2, kUsableCm = 7.2, kLeast = 3.5, kMost = 12.;
  if (!plot.equal_axes) return kUsual;
  const Range x = x_range(curves), y = y_range(plot, curves);
  if (!(x.size() > 0.)) return kUsual;
  return std::clamp(kAxesCm + kUsableCm * y.size() / x.size(), kLeast, kMost);
}

/// Distance of tics: 1, 2 or 5 times a power of ten, such that there are at most so many.
double tic_step(double size, double max_tics) {
  const double least = size / max_tics;
  const double power = std::pow(10., std::floor(std::log10(least)));
  for (const double factor : {1., 2., 5.}) {
    if (factor * power >= least) return factor * power;
  }
  return 10. * power;
}

/// Powers of ten; for few of them 1, 2, 5 and so on.
std::string log_axis(const Range& range) {
  constexpr double kFewDecades = 2.;
  std::string script = "set logscale y\n";
  if (!(range.low > 0.) || std::log10(range.high / range.low) > kFewDecades) {
    return script + "set ytics enhanced\nset format y '10^{%L}'\n";
  }
  std::string tics;
  const double last = std::floor(std::log10(range.high));
  for (double k = std::floor(std::log10(range.low)); k <= last; k += 1.) {
    for (const double digit : {1., 2., 5.}) {
      tics += (tics.empty() ? "" : ", ") + number(digit * std::pow(10., k));
    }
  }
  return script + "set ytics (" + tics + ")\n";
}

std::string script_of(const Plot& plot, const std::string& name, FigureFormat format,
                      const std::vector<Curve>& curves) {
  const bool lines_only = std::none_of(curves.begin(), curves.end(), [](const Curve& curve) {
    return curve.is_bars() || curve.series->draw != Draw::kLines;
  });
  const bool bars =
      std::any_of(curves.begin(), curves.end(), [](const Curve& curve) { return curve.is_bars(); });
  const int legend = legend_lines(curves);
  double height_cm = body_height_cm(plot, curves) + kLineCm * legend;
  std::string axes;
  const std::vector<std::string> categories = categories_of(curves);
  if (!categories.empty()) {
    height_cm += place_names(categories, axes);
    axes += "set xrange [-0.6:" + number(static_cast<double>(categories.size()) - 0.4) + "]\n";
  } else if (lines_only) {
    axes += "set autoscale xfix\n";
  }
  if (plot.equal_axes) {
    axes += "set size ratio -1\n";
    // The same in both directions: tics of their own would be crowded on the shorter axis.
    const double size = std::max(x_range(curves).size(), y_range(plot, curves).size());
    if (size > 0. && std::isfinite(size)) {
      const std::string step = number(tic_step(size, 8.));
      axes += "set xtics " + step + "\nset ytics " + step + "\n";
    }
  }
  if (plot.log_y) axes += log_axis(y_range(plot, curves));
  const double y_size = y_range(plot, curves).size();
  if (!plot.log_y && !plot.equal_axes && y_size > 0. && std::isfinite(y_size)) {
    axes += "set ytics " + number(tic_step(y_size, 6.)) + "\n";
  }
  if (plot.y_range) {
    axes +=
        "set yrange [" + number(plot.y_range->first) + ":" + number(plot.y_range->second) + "]\n";
  } else if (bars && !plot.log_y) {
    axes += "set yrange [*<0:0<*]\n";
  }
  return script_header(name, format, height_cm) + "set border 3 lw 0.7 lc rgb '" +
         std::string(kAxisColour) + "'\nset xtics textcolor rgb '" + std::string(kTextColour) +
         "' offset 0,0.4\nset ytics textcolor rgb '" + std::string(kTextColour) +
         "'\nset grid lt 1 lw 0.5 lc rgb '" + std::string(kGridColour) + "'\n" +
         axis_labels(plot, 1., legend > 0) + axes +
         (legend > 0 ? "set key below center horizontal Left reverse noenhanced samplen 2\n"
                     : "unset key\n") +
         lines_of(plot) + plot_command(plot_parts(plot, curves));
}

}  // namespace

GnuplotFigure gnuplot_curves(const Plot& plot, const std::string& name, FigureFormat format,
                             Colours& colours) {
  const auto curves = curves_of(plot, colours);
  if (curves.empty()) return {};
  return {script_of(plot, name, format, curves), data_of(curves)};
}

}  // namespace viwo::report

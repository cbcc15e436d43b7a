#include "gnuplot_format.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "viwo/math/text_stream.hpp"
#include "viwo/math/utf8.hpp"

namespace viwo::report {
namespace {

constexpr double kFontPt = 8.;
constexpr double kPixelsPerCm = 96. / 2.54;  ///< of CSS, in which SVG counts
constexpr double kPixelsPerPt = 96. / 72.;

/// The text layout of pdfcairo counts 96 dots per inch, its page 72: hence fontscale.
std::string terminal(FigureFormat format, const std::string& name, double height_cm) {
  const bool svg = format == FigureFormat::kSvg;
  std::string text = svg ? "set terminal svg enhanced size " + rounded(kWidthCm * kPixelsPerCm) +
                               "," + rounded(height_cm * kPixelsPerCm) + " font 'sans-serif," +
                               rounded(kFontPt * kPixelsPerPt) +
                               "' linewidth 1.3 background rgb 'white'\n"
                         : "set terminal pdfcairo enhanced size " + rounded(kWidthCm) + "cm," +
                               rounded(height_cm) + "cm font 'sans-serif," + rounded(kFontPt) +
                               "' fontscale 0.75 linewidth 2\n";
  return text + "set output '" + name + (svg ? ".svg'\n" : ".pdf'\n");
}

}  // namespace

std::string number(double value) {
  if (!std::isfinite(value)) return "NaN";
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  return {buffer.data(), end};
}

std::string rounded(double value) {
  TextStream out;
  out.precision(4);
  out << value;
  return out.str();
}

std::string one_line(std::string_view text) {
  std::string result = valid_utf8(text);
  for (char& c : result) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  }
  return result;
}

std::string gnuplot_quoted(std::string_view text) {
  // Between single quotes nothing is special but the quote. gnuplot takes two of them for one, yet
  // not at the beginning of a string in an expression: the typographic apostrophe cannot end any.
  constexpr std::string_view kApostrophe = "\xe2\x80\x99";
  std::string result = "'";
  for (const char c : one_line(text)) {
    if (c == '\'') {
      result += kApostrophe;
    } else {
      result += c;
    }
  }
  return result + "'";
}

std::string script_header(const std::string& name, FigureFormat format, double height_cm) {
  return "# Draws a figure of a viwo report from " + name + ".dat; run: gnuplot " + name + ".gp\n" +
         terminal(format, name, height_cm) + "set encoding utf8\ndata = '" + name +
         ".dat'\nset tics nomirror out scale 0.5 noenhanced\nset format '%h'\n";
}

std::string axis_labels(const Plot& plot, double x_up, bool line_below) {
  std::string script;
  if (!plot.x_label.empty()) {
    script += "set xlabel " + gnuplot_quoted(plot.x_label) + (line_below ? ".\"\\n\"" : "") +
              " noenhanced offset 0," + rounded(x_up) + "\n";
  }
  if (!plot.y_label.empty()) {
    script += "set ylabel " + gnuplot_quoted(plot.y_label) + " noenhanced\n";
  }
  return script;
}

std::string name_tics(const std::vector<std::string>& names, std::size_t max_shown) {
  const std::size_t step = std::max<std::size_t>(
      1, (names.size() + max_shown - 1) / std::max<std::size_t>(1, max_shown));
  std::string tics;
  for (std::size_t i = 0; i < names.size(); i += step) {
    tics += (i > 0 ? ", " : "") + gnuplot_quoted(names[i]) + " " + std::to_string(i);
  }
  return tics;
}

double place_names(const std::vector<std::string>& names, std::string& script) {
  constexpr std::size_t kMaxShown = 16;
  constexpr double kAxisCm = 5.8;
  std::size_t longest = 0;
  for (const std::string& name : names) longest = std::max(longest, name.size());
  const double text_cm = kCharacterCm * static_cast<double>(longest);
  const auto shown = static_cast<double>(std::min(names.size(), kMaxShown));
  const bool turned = shown * (text_cm + 0.15) > kAxisCm;
  script += "set xtics (" + name_tics(names, kMaxShown) + ") scale 0 noenhanced" +
            (turned ? " rotate by 60 right\n" : "\n");
  return turned ? 0.87 * text_cm : kLineCm;
}

std::string plot_command(const std::vector<std::string>& parts) {
  std::string text = "plot ";
  for (std::size_t i = 0; i < parts.size(); ++i) {
    text += (i > 0 ? ", \\\n     " : "") + parts[i];
  }
  return text + "\n";
}

}  // namespace viwo::report

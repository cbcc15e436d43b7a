// What all gnuplot scripts have in common: sizes, colours, and texts made harmless.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "viwo/report/document.hpp"
#include "viwo/report/figures.hpp"

namespace viwo::report {

inline constexpr double kWidthCm = 8.8;        ///< of a column of a two-column paper
inline constexpr double kCharacterCm = 0.135;  ///< mean width of a character
inline constexpr double kLineCm = 0.36;        ///< height of a line of text

inline constexpr std::string_view kGridColour = "#e6e9ed";
inline constexpr std::string_view kAxisColour = "#8a939c";
inline constexpr std::string_view kTextColour = "#1c2024";
inline constexpr std::string_view kLineColour = "#444444";

/// Shortest text that reads back the same; NaN for what is not finite.
std::string number(double value);

/// Four significant digits, for lengths and widths.
std::string rounded(double value);

/// Valid UTF-8 on one line without control characters.
std::string one_line(std::string_view text);

/// `text` as a gnuplot string: one line between single quotes, in which nothing is special; an
/// apostrophe becomes the typographic one.
std::string gnuplot_quoted(std::string_view text);

/// The beginning of a script: what it is, terminal, output, name of the data file as `data`.
std::string script_header(const std::string& name, FigureFormat format, double height_cm);

/// Labels of the axes of a plot that has some; that of x moved up by `x_up` lines, with a line more
/// below it if something follows.
std::string axis_labels(const Plot& plot, double x_up, bool line_below);

/// Names of places 0, 1, ... as tics, "'a' 0, 'b' 1"; every so many if more than `max_shown`.
std::string name_tics(const std::vector<std::string>& names, std::size_t max_shown);

/// Puts names under the axis of x, turned if they do not fit side by side; gives the centimetres
/// that they need. `script` gets the command.
double place_names(const std::vector<std::string>& names, std::string& script);

/// "plot a, b, ..." from its parts.
std::string plot_command(const std::vector<std::string>& parts);

}  // namespace viwo::report

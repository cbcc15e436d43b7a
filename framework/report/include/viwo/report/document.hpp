// The content of a report, without any HTML: sections of text, tables, plots and images.
#pragma once

#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace viwo::report {

/// Text or a number. Numbers that are not finite are shown as a dash.
struct Cell {
  std::variant<std::string, double> value;

  Cell(std::string text) : value(std::move(text)) {}
  Cell(const char* text) : value(std::string(text)) {}
  template <class Number>
  requires std::is_arithmetic_v<Number> Cell(Number number) : value(static_cast<double>(number)) {}
};

/// How the numbers of a column are written.
struct NumberFormat {
  enum class Style {
    kSignificant,  ///< `digits` significant digits; whole numbers as they are
    kFixed,        ///< `digits` after the decimal point
  };
  Style style = Style::kSignificant;
  int digits = 4;
};

struct Paragraph {
  enum class Tone { kNormal, kNote, kWarning };
  std::string text;
  Tone tone = Tone::kNormal;
};

struct KeyValue {
  std::string key;
  Cell value;  ///< numbers with six significant digits
};

struct KeyValues {
  std::vector<KeyValue> entries;
};

/// Which value of a column is emphasised. Nothing is when all values are equal.
enum class Best {
  kNone,
  kLowest,
  kHighest,
  kNearest,  ///< to Column::target
};

struct Column {
  std::string heading;  ///< with the unit: "RPE 10 m [m]"
  NumberFormat format = {};
  Best best = Best::kNone;
  double target = 0.;  ///< for Best::kNearest
};

/// Every row has one cell per column.
struct Table {
  std::string caption;
  std::vector<Column> columns;
  std::vector<std::vector<Cell>> rows;
};

enum class Dash { kSolid, kDashed, kDotted };
enum class Draw {
  kLines,
  kMarkers,
  kLinesAndMarkers,
  kBars,  ///< from zero; the bars of several series stand side by side
};

/// One curve. Points that are not finite interrupt it.
struct Series {
  std::string name;
  std::vector<double> x;
  std::vector<double> y;  ///< as many as x
  /// Series of one group (of one variant, say) have one colour in the whole document and are shown
  /// and hidden together; empty: the name. In one plot a name is listed once per group.
  std::string group = {};
  std::optional<int> colour = {};  ///< index into the palette instead of the group's colour
  Dash dash = Dash::kSolid;
  Draw draw = Draw::kLines;
  bool reference = false;  ///< the truth: black and dashed
  /// With y_high: a band, of curves as an area, of markers and bars as error bars. As many as x.
  std::vector<double> y_low = {};
  std::vector<double> y_high = {};
  double width = 1.8;   ///< of the line, in pixels
  double opacity = 1.;  ///< of the line and of its band; 0 to 1
  /// Instead of x, for bars: one name per y, in the order of the axis. Then x is empty, and so it
  /// is in every other series of the plot.
  std::vector<std::string> categories = {};
};

/// A straight line across the plot.
struct ReferenceLine {
  enum class Direction { kHorizontal, kVertical };
  Direction direction = Direction::kHorizontal;
  double value = 0.;
  std::string label = {};
  Dash dash = Dash::kDotted;
};

/// A matrix of coloured cells; the first row of `z` is on top.
struct HeatMap {
  std::vector<std::string> x;                  ///< names of the columns
  std::vector<std::string> y;                  ///< names of the rows
  std::vector<std::vector<double>> z;          ///< z[row][column]; not finite: empty
  std::vector<std::vector<std::string>> text;  ///< shown in the cells; empty or as large as z
  std::string colour_label = {};               ///< what z is, with unit
  std::optional<double> z_min = {};            ///< ends of the colour scale; from z when not given
  std::optional<double> z_max = {};
};

struct Plot {
  std::string title;
  std::string x_label;  ///< with unit: "time [s]"
  std::string y_label;
  std::vector<Series> series = {};
  std::vector<ReferenceLine> lines = {};
  std::optional<HeatMap> heat_map = {};
  bool equal_axes = false;  ///< one metre in x is as long as one metre in y
  bool log_y = false;
  bool half_width = false;  ///< two such plots in sequence stand side by side
  int height_px = 0;        ///< 0: a height that suits the plot
  std::string caption = {};
  /// What is shown of y at first; a reader can zoom out. Without: everything.
  std::optional<std::pair<double, double>> y_range = {};
};

struct Image {
  std::string caption;
  std::string alternative;  ///< what the image shows, in words
  std::string mime_type;    ///< "image/png", "image/jpeg" or "image/svg+xml"
  std::string bytes;        ///< the file
};

/// Text that is only shown when the reader asks for it.
struct Details {
  std::string summary;  ///< what is always shown
  std::string text;     ///< as it is, in a typewriter face
};

using Block = std::variant<Paragraph, KeyValues, Table, Plot, Image, Details>;

struct Section {
  std::string heading;
  std::vector<Block> blocks = {};  ///< in the order of the page
};

struct Document {
  std::string title;
  std::string subtitle;
  std::vector<Section> sections;
};

}  // namespace viwo::report

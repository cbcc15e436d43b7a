#include "plots.hpp"

#include <array>
#include <cstddef>
#include <stdexcept>
#include <vector>

namespace viwo::report {

namespace {

constexpr std::string_view kReferenceColour = "#000000";

/// Okabe and Ito's palette for all kinds of colour vision, without black (the reference) and
/// without yellow (too faint on white); grey comes last.
constexpr std::array<std::string_view, 7> kPalette{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                   "#e69f00", "#56b4e9", "#7a7a7a"};

std::string_view text_of(Dash dash) {
  switch (dash) {
    case Dash::kSolid:
      return "solid";
    case Dash::kDashed:
      return "dash";
    case Dash::kDotted:
      return "dot";
  }
  throw std::invalid_argument("report: not a dash style");
}

std::string_view text_of(Draw draw) {
  switch (draw) {
    case Draw::kLines:
      return "lines";
    case Draw::kMarkers:
      return "markers";
    case Draw::kLinesAndMarkers:
      return "lines+markers";
    case Draw::kBars:
      return "bars";
  }
  throw std::invalid_argument("report: not a drawing style");
}

const std::string& group_of(const Series& series) {
  return series.group.empty() ? series.name : series.group;
}

nlohmann::json series_json(const Series& series, const std::string& plot_title, Colours& colours) {
  const bool named = !series.categories.empty();
  const std::size_t n = named ? series.categories.size() : series.x.size();
  const bool has_band = !series.y_low.empty() || !series.y_high.empty();
  if (series.y.size() != n || (named && !series.x.empty()) ||
      (has_band && (series.y_low.size() != n || series.y_high.size() != n))) {
    throw std::invalid_argument("report: plot '" + plot_title + "', series '" + series.name +
                                "': x, y and the band differ in size");
  }
  nlohmann::json json = {{"name", series.name},
                         {"group", group_of(series)},
                         {"colour", colours.of(series)},
                         {"dash", text_of(series.reference ? Dash::kDashed : series.dash)},
                         {"draw", text_of(series.draw)},
                         {"reference", series.reference},
                         {"width", series.width},
                         {"opacity", series.opacity},
                         {"y", series.y}};
  if (named) {
    json["x"] = series.categories;
  } else {
    json["x"] = series.x;
  }
  if (has_band) {
    json["y_low"] = series.y_low;
    json["y_high"] = series.y_high;
  }
  return json;
}

template <class Value>
bool has_size(const std::vector<std::vector<Value>>& rows, std::size_t n_rows, std::size_t n_cols) {
  if (rows.size() != n_rows) return false;
  for (const auto& row : rows) {
    if (row.size() != n_cols) return false;
  }
  return true;
}

nlohmann::json heat_map_json(const HeatMap& map, const std::string& plot_title) {
  if (!has_size(map.z, map.y.size(), map.x.size()) ||
      !(map.text.empty() || has_size(map.text, map.y.size(), map.x.size()))) {
    throw std::invalid_argument(
        "report: plot '" + plot_title +
        "': z and text of the heat map need a row per y and a column per x");
  }
  nlohmann::json json = {
      {"x", map.x}, {"y", map.y}, {"z", map.z}, {"colour_label", map.colour_label}};
  if (!map.text.empty()) json["text"] = map.text;
  if (map.z_min) json["z_min"] = *map.z_min;
  if (map.z_max) json["z_max"] = *map.z_max;
  return json;
}

}  // namespace

std::string_view Colours::of(const Series& series) {
  if (series.reference) return kReferenceColour;
  if (series.colour) {
    if (*series.colour < 0) throw std::invalid_argument("report: negative colour index");
    return kPalette[static_cast<std::size_t>(*series.colour) % kPalette.size()];
  }
  const auto [entry, is_new] =
      index_of_group_.try_emplace(group_of(series), index_of_group_.size());
  return kPalette[entry->second % kPalette.size()];
}

nlohmann::json plot_json(const Plot& plot, Colours& colours) {
  nlohmann::json json = {{"title", plot.title},
                         {"x_label", plot.x_label},
                         {"y_label", plot.y_label},
                         {"equal_axes", plot.equal_axes},
                         {"log_y", plot.log_y},
                         {"height_px", plot.height_px},
                         {"series", nlohmann::json::array()},
                         {"lines", nlohmann::json::array()}};
  for (const Series& series : plot.series) {
    json["series"].push_back(series_json(series, plot.title, colours));
  }
  for (const ReferenceLine& line : plot.lines) {
    const bool horizontal = line.direction == ReferenceLine::Direction::kHorizontal;
    json["lines"].push_back({{"axis", horizontal ? "y" : "x"},
                             {"value", line.value},
                             {"label", line.label},
                             {"dash", text_of(line.dash)}});
  }
  if (plot.y_range) json["y_range"] = {plot.y_range->first, plot.y_range->second};
  if (plot.heat_map) json["heat_map"] = heat_map_json(*plot.heat_map, plot.title);
  return json;
}

}  // namespace viwo::report

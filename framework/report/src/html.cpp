#include "viwo/report/html.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <stdexcept>
#include <string_view>

#include "assets.hpp"
#include "plots.hpp"
#include "text.hpp"

namespace viwo::report {

namespace {

/// A table of contents pays from this many sections on.
constexpr std::size_t kMinSectionsForContents = 4;

constexpr NumberFormat kKeyValueFormat{NumberFormat::Style::kSignificant, 6};

/// The body of the page as it grows, and the plots found on the way.
struct Page {
  std::string html;
  nlohmann::json plots = nlohmann::json::array();
  Colours colours;
};

std::string shown(const Cell& cell, const NumberFormat& format) {
  if (const auto* text = std::get_if<std::string>(&cell.value)) return escaped(*text);
  return formatted(std::get<double>(cell.value), format);
}

bool is_number(const Cell& cell) { return std::holds_alternative<double>(cell.value); }

void add(const Paragraph& paragraph, Page& page) {
  switch (paragraph.tone) {
    case Paragraph::Tone::kNormal:
      page.html += "<p>";
      break;
    case Paragraph::Tone::kNote:
      page.html += "<p class=\"note\">";
      break;
    case Paragraph::Tone::kWarning:
      page.html += "<p class=\"warning\" role=\"alert\">";
      break;
  }
  page.html += escaped(paragraph.text) + "</p>\n";
}

void add(const KeyValues& list, Page& page) {
  page.html += "<dl>\n";
  for (const KeyValue& entry : list.entries) {
    page.html += "<div><dt>" + escaped(entry.key) + "</dt><dd>" +
                 shown(entry.value, kKeyValueFormat) + "</dd></div>\n";
  }
  page.html += "</dl>\n";
}

/// How far a value is from what its column calls good; lower is better.
double badness(double value, const Column& column) {
  switch (column.best) {
    case Best::kNone:
      break;
    case Best::kLowest:
      return value;
    case Best::kHighest:
      return -value;
    case Best::kNearest:
      return std::abs(value - column.target);
  }
  return 0.;
}

/// Badness of the best value of a column; NaN, which equals nothing, when there is none.
double best_badness(const Table& table, std::size_t i) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  double least = std::numeric_limits<double>::infinity();
  double most = -least;
  for (const auto& row : table.rows) {
    if (!is_number(row[i])) continue;
    const double value = std::get<double>(row[i].value);
    if (!std::isfinite(value)) continue;
    least = std::min(least, badness(value, table.columns[i]));
    most = std::max(most, badness(value, table.columns[i]));
  }
  return least < most ? least : kNaN;
}

void add_row(const Table& table, const std::vector<Cell>& row, const std::vector<double>& best,
             Page& page) {
  page.html += "<tr>";
  for (std::size_t i = 0; i < row.size(); ++i) {
    const bool number = is_number(row[i]);
    const bool is_best =
        number && badness(std::get<double>(row[i].value), table.columns[i]) == best[i];
    page.html += is_best ? "<td class=\"number best\">" : number ? "<td class=\"number\">" : "<td>";
    page.html += shown(row[i], table.columns[i].format) + "</td>";
  }
  page.html += "</tr>\n";
}

void add(const Table& table, Page& page) {
  std::vector<double> best;
  for (const auto& row : table.rows) {
    if (row.size() != table.columns.size()) {
      throw std::invalid_argument("report: table '" + table.caption +
                                  "': a row does not have one cell per column");
    }
  }
  page.html += "<div class=\"table\"><table>\n";
  if (!table.caption.empty()) page.html += "<caption>" + escaped(table.caption) + "</caption>\n";
  page.html += "<thead><tr>";
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    best.push_back(best_badness(table, i));
    const bool number = std::any_of(table.rows.begin(), table.rows.end(),
                                    [i](const auto& row) { return is_number(row[i]); });
    page.html += number ? "<th scope=\"col\" class=\"number\">" : "<th scope=\"col\">";
    page.html += escaped(table.columns[i].heading) + "</th>";
  }
  page.html += "</tr></thead>\n<tbody>\n";
  for (const auto& row : table.rows) add_row(table, row, best, page);
  page.html += "</tbody>\n</table></div>\n";
}

void add(const Plot& plot, Page& page) {
  page.html += plot.half_width ? "<figure class=\"plot half\"" : "<figure class=\"plot\"";
  page.html += " data-plot=\"" + std::to_string(page.plots.size()) + "\">\n";
  if (!plot.title.empty()) page.html += "<h3>" + escaped(plot.title) + "</h3>\n";
  page.html += "<div class=\"canvas\"></div>\n";
  if (!plot.caption.empty()) {
    page.html += "<figcaption>" + escaped(plot.caption) + "</figcaption>\n";
  }
  page.html += "</figure>\n";
  page.plots.push_back(plot_json(plot, page.colours));
}

void add(const Image& image, Page& page) {
  // A list, not any text: the type goes into the address of the image.
  if (image.mime_type != "image/png" && image.mime_type != "image/jpeg" &&
      image.mime_type != "image/svg+xml") {
    throw std::invalid_argument("report: image '" + image.caption + "' is of type '" +
                                image.mime_type + "', not PNG, JPEG or SVG");
  }
  page.html += "<figure class=\"image\">\n<img alt=\"" + escaped(image.alternative) +
               "\" src=\"data:" + image.mime_type + ";base64," + base64(image.bytes) + "\">\n";
  if (!image.caption.empty()) {
    page.html += "<figcaption>" + escaped(image.caption) + "</figcaption>\n";
  }
  page.html += "</figure>\n";
}

void add(const Details& details, Page& page) {
  // HTML drops a newline right after <pre>; the one here is it, so that the text keeps its own.
  page.html += "<details>\n<summary>" + escaped(details.summary) + "</summary>\n<pre>\n" +
               escaped(details.text) + "</pre>\n</details>\n";
}

std::string section_id(std::size_t i) { return "section-" + std::to_string(i + 1); }

std::string contents(const Document& document) {
  if (document.sections.size() < kMinSectionsForContents) return {};
  std::string html = "<nav aria-label=\"Contents\">\n<ol>\n";
  for (std::size_t i = 0; i < document.sections.size(); ++i) {
    html += "<li><a href=\"#" + section_id(i) + "\">" + escaped(document.sections[i].heading) +
            "</a></li>\n";
  }
  return html + "</ol>\n</nav>\n";
}

/// JSON that may stand inside of a script element: no '<', hence neither "</script" nor "<!--".
/// In JSON a '<' is only found in strings, where the escape means the same.
std::string script_safe(const nlohmann::json& json) {
  const std::string text = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  std::string result;
  result.reserve(text.size());
  for (const char c : text) {
    if (c == '<') {
      result += "\\u003c";
    } else {
      result += c;
    }
  }
  return result;
}

/// Replaces each {{name}} of the template, in one pass: what is put in is not looked at again.
std::string filled(std::string_view page_template,
                   const std::map<std::string_view, std::string_view>& values) {
  std::string result;
  std::size_t at = 0;
  while (true) {
    const std::size_t open = page_template.find("{{", at);
    result += page_template.substr(at, open - at);
    if (open == std::string_view::npos) return result;
    const std::size_t close = page_template.find("}}", open);
    if (close == std::string_view::npos) throw std::logic_error("report: template has no '}}'");
    result += values.at(page_template.substr(open + 2, close - open - 2));
    at = close + 2;
  }
}

}  // namespace

std::string to_html(const Document& document) {
  Page page;
  for (std::size_t i = 0; i < document.sections.size(); ++i) {
    const Section& section = document.sections[i];
    page.html +=
        "<section id=\"" + section_id(i) + "\">\n<h2>" + escaped(section.heading) + "</h2>\n";
    for (const Block& block : section.blocks) {
      std::visit([&page](const auto& content) { add(content, page); }, block);
    }
    page.html += "</section>\n";
  }
  const std::string title = escaped(document.title);
  const std::string subtitle = escaped(document.subtitle);
  const std::string navigation = contents(document);
  const std::string data = script_safe({{"plots", std::move(page.plots)}});
  const std::string license = escaped(assets::plotly_license());
  return filled(assets::page_template(), {{"title", title},
                                          {"subtitle", subtitle},
                                          {"contents", navigation},
                                          {"body", page.html},
                                          {"data", data},
                                          {"style", assets::style()},
                                          {"script", assets::script()},
                                          {"plotly", assets::plotly()},
                                          {"plotly_version", assets::plotly_version()},
                                          {"plotly_license", license},
                                          {"viwo_version", VIWO_REPORT_VERSION}});
}

}  // namespace viwo::report

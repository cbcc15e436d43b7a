#include "viwo/report/figures.hpp"

#include <array>
#include <system_error>
#include <vector>

#include "gnuplot.hpp"
#include "viwo/files/files.hpp"

namespace viwo::report {
namespace {

/// Of what is there of a figure.
constexpr std::array<const char*, 4> kExtensions = {".svg", ".pdf", ".dat", ".gp"};

/// A title as part of a file name: small letters and digits of ASCII, '_' for everything else.
std::string slug(const std::string& title) {
  constexpr std::size_t kMaxSize = 60;
  std::string result;
  for (const char c : title) {
    const bool upper = c >= 'A' && c <= 'Z';
    if (upper || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) {
      result += upper ? static_cast<char>(c - 'A' + 'a') : c;
    } else if (!result.empty() && result.back() != '_') {
      result += '_';
    }
    if (result.size() == kMaxSize) break;
  }
  while (!result.empty() && result.back() == '_') result.pop_back();
  return result.empty() ? "plot" : result;
}

void make_figure(const std::filesystem::path& folder, const std::string& name,
                 const GnuplotFigure& figure, FigureFormat format) {
  files::write_text(folder / (name + ".dat"), figure.data);
  files::write_text(folder / (name + ".gp"), figure.script);
  run_gnuplot(folder, name + ".gp");
  files::sync_to_disk(folder / (name + (format == FigureFormat::kSvg ? ".svg" : ".pdf")));
}

/// Those of a document before, by their scripts.
void clear_figures(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> scripts;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();  // NN_TITLE.gp
    const bool is_own = name.find('_') >= 2 &&
                        name.find_first_not_of("0123456789") == name.find('_') &&
                        name.ends_with(".gp");
    if (is_own) scripts.push_back(entry.path());
  }
  for (std::filesystem::path file : scripts) {
    for (const char* extension : kExtensions) {
      std::filesystem::remove(file.replace_extension(extension), ignored);
    }
  }
}

}  // namespace

void write_figures(const std::filesystem::path& folder, const Document& document,
                   FigureFormat format) {
  require_gnuplot();
  if (document.sections.empty()) return;
  clear_figures(folder);  // the page that they belong to is gone
  files::NewResults results(folder);
  Colours colours;
  int n = 0;
  for (const Section& section : document.sections) {
    for (const Block& block : section.blocks) {
      const auto* plot = std::get_if<Plot>(&block);
      if (plot == nullptr) continue;
      // Checks the sizes, and hands out the colours in the order in which the page does.
      plot_json(*plot, colours);
      ++n;
      const std::string name = (n < 10 ? "0" : "") + std::to_string(n) + "_" + slug(plot->title);
      const GnuplotFigure figure = plot->heat_map ? gnuplot_heat_map(*plot, name, format)
                                                  : gnuplot_curves(*plot, name, format, colours);
      if (figure.script.empty()) continue;
      make_figure(results.folder(), name, figure, format);
    }
  }
  results.commit({});
}

}  // namespace viwo::report

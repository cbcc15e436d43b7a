#include "viwo/report/figures.hpp"

#include <array>
#include <cerrno>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "gnuplot.hpp"

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

/// What is there goes: it may be a link to a file that is none of the figures.
void clear(const std::filesystem::path& path) {
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
}

void write(const std::filesystem::path& path, const std::string& text) {
  clear(path);
  errno = 0;
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file << text;
  file.close();
  if (!file) {
    throw std::runtime_error("cannot write figure '" + path.string() +
                             "': " + std::generic_category().message(errno));
  }
}

/// One figure, or nothing of it.
void make_figure(const std::filesystem::path& folder, const std::string& name,
                 const GnuplotFigure& figure) {
  try {
    write(folder / (name + ".dat"), figure.data);
    write(folder / (name + ".gp"), figure.script);
    run_gnuplot(folder, name + ".gp");
  } catch (...) {
    for (const char* extension : kExtensions) clear(folder / (name + extension));
    throw;
  }
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
    for (const char* extension : kExtensions) clear(file.replace_extension(extension));
  }
}

}  // namespace

void write_figures(const std::filesystem::path& folder, const Document& document,
                   FigureFormat format) {
  require_gnuplot();
  if (!document.sections.empty()) clear_figures(folder);
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
      make_figure(folder, name, figure);
    }
  }
}

}  // namespace viwo::report

// Plots as gnuplot scripts, and gnuplot as a process.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>

#include "plots.hpp"
#include "viwo/report/figures.hpp"

namespace viwo::report {

/// A plot as two files.
struct GnuplotFigure {
  std::string script;
  std::string data;
};

/// The files NAME.gp and NAME.dat of a plot's curves; the script writes NAME.svg or NAME.pdf. Texts
/// are shown as they are, whatever they contain. Both are empty when there is no finite point.
/// Sizes must fit (plot_json()).
GnuplotFigure gnuplot_curves(const Plot& plot, const std::string& name, FigureFormat format,
                             Colours& colours);

/// The same of a plot's heat map.
GnuplotFigure gnuplot_heat_map(const Plot& plot, const std::string& name, FigureFormat format);

/// Runs `gnuplot SCRIPT` in `folder`, without a shell. Throws InputError when there is no gnuplot
/// in PATH, std::runtime_error with what it wrote to its standard error when it fails, or is not
/// done in time (a figure takes a fraction of a second) and is stopped.
void run_gnuplot(const std::filesystem::path& folder, const std::string& script,
                 std::chrono::milliseconds limit = std::chrono::seconds(60));

/// Throws InputError when gnuplot cannot be run.
void require_gnuplot();

}  // namespace viwo::report

// The plots of a Document as static figures for a paper, drawn by gnuplot.
#pragma once

#include <filesystem>

#include "viwo/report/document.hpp"

namespace viwo::report {

enum class FigureFormat { kSvg, kPdf };

/// Writes every plot of the document to `folder`, which must exist: NN_TITLE.svg (or .pdf), with
/// the script NN_TITLE.gp that draws it from NN_TITLE.dat. To change a figure, edit the script and
/// run `gnuplot NN_TITLE.gp` in the folder. A figure has the width of a column of a paper, 8.8 cm,
/// text of 8 pt, and the colours of the page. A plot without a single finite point has no figure.
/// Figures of a document before go first; of the new ones there are all, or, after an error, none.
///
/// Throws InputError when there is no gnuplot, std::runtime_error with gnuplot's own message when
/// it fails or when a file cannot be written, and std::invalid_argument like to_html().
void write_figures(const std::filesystem::path& folder, const Document& document,
                   FigureFormat format);

}  // namespace viwo::report

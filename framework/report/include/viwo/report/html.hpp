// A Document as one HTML file that needs nothing else: style, data and plot library are inside.
#pragma once

#include <string>

#include "viwo/report/document.hpp"

namespace viwo::report {

/// The page. The same document gives the same bytes. Throws std::invalid_argument, naming the
/// table, plot or image, when sizes in the document do not fit.
std::string to_html(const Document& document);

}  // namespace viwo::report

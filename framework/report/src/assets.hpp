// The files of web/ and the plot library, compiled into the program.
#pragma once

#include <string_view>

namespace viwo::report::assets {

std::string_view page_template();   ///< template.html
std::string_view style();           ///< report.css
std::string_view script();          ///< report.js
std::string_view plotly();          ///< Plotly.js, minified
std::string_view plotly_license();  ///< its licence text
std::string_view plotly_version();  ///< "2.35.3"

}  // namespace viwo::report::assets

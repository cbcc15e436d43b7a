#include "assets.hpp"

// The assembler copies the file into the object: no generated source, and megabytes cost nothing.
// The symbols are hidden so that the addresses are known at link time in a shared library too.
#define VIWO_EMBED(name, file)                                                              \
  asm(".pushsection .rodata\n"                                                              \
      ".global viwo_report_" #name "_begin\n.hidden viwo_report_" #name                     \
      "_begin\n"                                                                            \
      ".global viwo_report_" #name "_end\n.hidden viwo_report_" #name                       \
      "_end\n"                                                                              \
      "viwo_report_" #name "_begin:\n.incbin \"" file                                       \
      "\"\n"                                                                                \
      "viwo_report_" #name                                                                  \
      "_end:\n"                                                                             \
      ".popsection\n");                                                                     \
  extern "C" __attribute__((visibility("hidden"))) const char viwo_report_##name##_begin[]; \
  extern "C" __attribute__((visibility("hidden"))) const char viwo_report_##name##_end[]

VIWO_EMBED(template, VIWO_REPORT_TEMPLATE);
VIWO_EMBED(style, VIWO_REPORT_STYLE);
VIWO_EMBED(script, VIWO_REPORT_SCRIPT);
VIWO_EMBED(plotly, VIWO_REPORT_PLOTLY);
VIWO_EMBED(plotly_license, VIWO_REPORT_PLOTLY_LICENSE);

namespace viwo::report::assets {

std::string_view page_template() { return {viwo_report_template_begin, viwo_report_template_end}; }

std::string_view style() { return {viwo_report_style_begin, viwo_report_style_end}; }

std::string_view script() { return {viwo_report_script_begin, viwo_report_script_end}; }

std::string_view plotly() { return {viwo_report_plotly_begin, viwo_report_plotly_end}; }

std::string_view plotly_license() {
  return {viwo_report_plotly_license_begin, viwo_report_plotly_license_end};
}

std::string_view plotly_version() { return VIWO_REPORT_PLOTLY_VERSION; }

}  // namespace viwo::report::assets

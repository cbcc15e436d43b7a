// Plots as the data that web/report.js draws.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "viwo/report/document.hpp"

namespace viwo::report {

/// Colours of groups, in the order in which groups first appear; the same in all plots of a page.
class Colours {
 public:
  /// "#rrggbb"
  std::string_view of(const Series& series);

 private:
  std::map<std::string, std::size_t, std::less<>> index_of_group_;
};

/// What report.js reads; numbers that are not finite become null when written.
/// Throws std::invalid_argument when sizes do not fit.
nlohmann::json plot_json(const Plot& plot, Colours& colours);

}  // namespace viwo::report

// The tables of an experiment on the terminal.
#include <algorithm>
#include <cmath>
#include <ostream>

#include "experiment_statistics.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/text_stream.hpp"
#include "viwo/results/run_output.hpp"

namespace viwo::experiment {
namespace {

std::string padded(const std::string& text, std::size_t width) {
  return text + std::string(width > text.size() ? width - text.size() : 0, ' ');
}

std::string right(const std::string& text, std::size_t width) {
  return "  " + std::string(width > text.size() ? width - text.size() : 0, ' ') + text;
}

void add_means(const ExperimentResult& result, const Group& group, std::ostream& out) {
  std::size_t width = 8;
  for (const Variant& variant : result.setup.variants) width = std::max(width, variant.name.size());
  width = std::max(width, group.value.size());
  const auto metrics = metrics_of(result);
  const auto column = [](const Metric& m) { return std::max<std::size_t>(14, m.heading.size()); };
  out << "\n" << padded(group.value, width) << right("not ok", 6) << right("doubtful", 8);
  for (const Metric& metric : metrics) out << right(metric.heading, column(metric));
  out << "\n";
  for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
    const RunCounts counts = counts_of(result, v, group);
    out << padded(result.setup.variants[v].name, width) << right(std::to_string(counts.not_ok()), 6)
        << right(std::to_string(counts.doubtful), 8);
    for (const Metric& metric : metrics) {
      const double mean = eval::mean(values_of(result, v, metric, group));
      out << right(compact(metric.table_scale * mean, 4), column(metric));
    }
    out << "\n";
  }
  for (const std::string& fewer : means_of_fewer(result, group)) out << "  " << fewer << "\n";
}

/// A row for each metric: how much more of it each variant has than the baseline.
void add_paired(const ExperimentResult& result, const Group& all, std::ostream& out) {
  const ExperimentSetup& setup = result.setup;
  if (setup.variants.size() < 2) return;
  const auto metrics = metrics_of(result);
  std::size_t first = 16;
  for (const Metric& metric : metrics) first = std::max(first, metric.heading.size());
  out << "\ndifference to " << setup.variants[setup.baseline].name
      << " over pairs of runs, 95 % interval (* without zero)\n"
      << padded("", first);
  std::vector<std::size_t> widths;
  for (const Variant& variant : setup.variants) {
    widths.push_back(std::max<std::size_t>(22, variant.name.size()));
    if (widths.size() - 1 != setup.baseline) out << right(variant.name, widths.back());
  }
  out << "\n";
  for (const Metric& metric : metrics) {
    out << padded(metric.heading, first);
    for (std::size_t v = 0; v < setup.variants.size(); ++v) {
      if (v == setup.baseline) continue;
      const eval::PairedDifference d = paired(result, v, metric, all);
      std::string text = compact(metric.table_scale * d.mean, 3);
      if (std::isfinite(d.high)) {
        text += " +- " + compact(metric.table_scale * (d.high - d.mean), 2);
      }
      out << right(text + (is_significant(d) ? " *" : "  "), widths[v]);
    }
    out << "\n";
  }
}

/// A row per group and variant, a column per kind of parameter: how much of the prior is left.
void add_calibration_by_group(const ExperimentResult& result, const std::vector<Group>& groups,
                              std::ostream& out) {
  std::size_t width = 8;
  for (const Variant& variant : result.setup.variants) {
    width = std::max(width, variant.name.size() + 2);
  }
  std::vector<std::string> shown;
  for (std::size_t g = 1; g < groups.size(); ++g) {
    bool named = false;
    for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
      const auto families = calibration_families(result, v, groups[g]);
      if (families.empty()) continue;
      std::vector<std::string> names;
      for (const CalibrationFamily& family : families) names.push_back(family.name);
      if (names != shown) {
        out << "\ncalibration: rmse at the end, % of the prior sigma (" << kNees << ")\n"
            << padded("", width);
        for (const std::string& name : names) out << right(name, 18);
        out << "\n";
        shown = names;
      }
      if (!named) out << groups[g].value << "\n";
      named = true;
      out << padded("  " + result.setup.variants[v].name, width);
      for (const CalibrationFamily& family : families) {
        out << right(compact(100. * family.left, 3) + " (" + nees_text(family) + ")", 18);
      }
      out << "\n";
    }
  }
}

void add_calibration(const ExperimentResult& result, const Group& all, std::ostream& out) {
  for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
    const auto statistics = calibration_statistics(result, v, all);
    if (statistics.empty()) continue;
    out << "\ncalibration of " << result.setup.variants[v].name
        << ": rmse at the end (part of the prior sigma; " << kNees << ")\n";
    std::size_t column = 0;
    for (const CalibrationStatistics& c : statistics) {
      const std::string text = "  " + c.name + " " + significant(c.rmse, 3) + " (" +
                               significant(100. * c.rmse / c.prior_sigma, 3) + " %; " +
                               nees_text(c) + ")";
      out << padded(text, std::max<std::size_t>(42, text.size() + 1));
      if (++column % 3 == 0) out << "\n";
    }
    if (column % 3 != 0) out << "\n";
  }
}

}  // namespace

std::string describe(const ExperimentResult& result) {
  TextStream out;
  const auto groups = groups_of(result);
  for (const Group& group : groups) add_means(result, group, out);
  add_paired(result, groups.front(), out);
  if (groups.size() > 1) {
    add_calibration_by_group(result, groups, out);
  } else {
    add_calibration(result, groups.front(), out);
  }
  const RealtimeFactors factors = realtime_factors(result);
  out << "\none core runs " << compact(factors.core, 3) << " times faster than real time";
  if (std::isfinite(factors.overall)) {
    out << "; the experiment with " << result.jobs << (result.jobs == 1 ? " job " : " jobs ")
        << compact(factors.overall, 3) << " times";
  }
  out << "\n";
  return out.str();
}

}  // namespace viwo::experiment

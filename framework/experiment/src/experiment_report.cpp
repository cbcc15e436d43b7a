// The page of an experiment: what ran, its tables, and the plots of experiment_plots.cpp.
#include <algorithm>
#include <cmath>

#include "experiment_plots.hpp"
#include "experiment_statistics.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/report/curves.hpp"
#include "viwo/results/run_output.hpp"

namespace viwo::experiment {
namespace {

using namespace report;

constexpr NumberFormat kThreeDigits{NumberFormat::Style::kSignificant, 3};

/// "1 seed", "20 seeds"
std::string counted(std::size_t n, const std::string& what) {
  return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

/// "motion" or "recording".
std::string axis_of(const ExperimentSetup& setup) {
  const auto& labels = setup.recordings.front().labels;
  return labels.contains("motion") && !labels.contains("recording") ? "motion" : "recording";
}

std::string axes_of(const ExperimentSetup& setup) {
  std::string text = counted(setup.variants.size(), "variant");
  if (!setup.recordings.front().name.empty()) {
    text += ", " + counted(setup.recordings.size(), axis_of(setup));
  }
  return text + ", " + counted(static_cast<std::size_t>(setup.seeds), "seed");
}

Section what_ran(const ExperimentResult& result) {
  const ExperimentSetup& setup = result.setup;
  const RealtimeFactors factors = realtime_factors(result);
  std::string recordings;
  for (const Recording& recording : setup.recordings) {
    if (!recordings.empty()) recordings += ", ";
    recordings += recording.name;
  }
  KeyValues facts;
  facts.entries = {{"viwo", viwo_version()},
                   {"base", setup.base_file.filename().string()},
                   {"runs", result.runs.size()},
                   {"seeds", setup.seeds},
                   {"jobs", result.jobs},
                   {"wall time", significant(result.wall_s, 3) + " s"},
                   {"speed of one core", compact(factors.core, 3) + " x real time"},
                   {"baseline", setup.variants[setup.baseline].name}};
  Section section{"What ran", {facts}};
  if (!recordings.empty()) {
    section.blocks.emplace_back(
        Paragraph{(axis_of(setup) == "motion" ? "Motions: " : "Recordings: ") + recordings + "."});
  }
  config::Node variants = config::Node::empty_map();
  for (const Variant& variant : setup.variants) variants.set(variant.name, variant.overrides);
  section.blocks.emplace_back(
      Details{"Variants, as what they override", config::to_yaml(variants)});
  section.blocks.emplace_back(Details{"Base configuration", config::to_yaml(setup.base)});
  return section;
}

Table means_table(const ExperimentResult& result, const Group& group) {
  Table table;
  table.caption =
      group.label.empty() ? "Mean over all runs" : "Mean over " + group.label + " " + group.value;
  table.columns = {{"variant"}, {"runs"}, {"not ok"}, {"doubtful"}};
  const auto metrics = metrics_of(result);
  for (const Metric& metric : metrics) {
    table.columns.push_back({metric.heading, kThreeDigits,
                             metric.target > 0. ? Best::kNearest : Best::kLowest, metric.target});
  }
  for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
    const RunCounts counts = counts_of(result, v, group);
    std::vector<Cell> row{result.setup.variants[v].name, counts.runs, counts.not_ok(),
                          counts.doubtful};
    for (const Metric& metric : metrics) {
      row.emplace_back(metric.table_scale * eval::mean(values_of(result, v, metric, group)));
    }
    table.rows.push_back(std::move(row));
  }
  for (const std::string& fewer : means_of_fewer(result, group)) table.caption += "; " + fewer;
  return table;
}

/// Keeps a browser from breaking a line.
std::string unbroken(const std::string& text) {
  std::string result;
  for (const char c : text) result += c == ' ' ? std::string("\u00a0") : std::string(1, c);
  return result;
}

/// A row per metric and a column per variant but for those that `skip`; `cell` gives the text.
template <class CellOf>
Table metrics_table(const ExperimentResult& result, std::optional<std::size_t> skip,
                    const CellOf& cell) {
  Table table;
  table.columns = {{"metric"}};
  for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
    if (v != skip) table.columns.push_back({result.setup.variants[v].name});
  }
  for (const Metric& metric : metrics_of(result)) {
    std::vector<Cell> row{unbroken(metric.heading)};
    for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
      if (v != skip) row.emplace_back(cell(v, metric));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// "-1.2 ± 0.3 ▼"
std::string difference_text(const eval::PairedDifference& d, const Metric& metric) {
  if (d.pairs == 0) return "-";
  std::string text = compact(metric.table_scale * d.mean, 3);
  if (!std::isfinite(d.high)) return text;
  text += " ± " + compact(metric.table_scale * (d.high - d.mean), 2);
  return unbroken(is_significant(d) ? text + (d.mean > 0. ? " ▲" : " ▼") : text);
}

Table paired_table(const ExperimentResult& result, const Group& group) {
  const std::size_t baseline = result.setup.baseline;
  Table table = metrics_table(result, baseline, [&](std::size_t variant, const Metric& metric) {
    return difference_text(paired(result, variant, metric, group), metric);
  });
  const bool one = result.setup.recordings.size() == 1;
  table.caption = "Difference to " + result.setup.variants[baseline].name +
                  " over pairs of the same " + (one ? "" : axis_of(result.setup) + " and ") +
                  "seed, with its 95 % interval; ▲ more, ▼ less: without zero";
  return table;
}

/// The difference in one metric by the values of a label.
Table paired_table_by(const ExperimentResult& result, const std::string& label,
                      const Metric& metric) {
  const std::size_t baseline = result.setup.baseline;
  Table table;
  table.caption =
      metric.heading + ": difference to " + result.setup.variants[baseline].name + " by " + label;
  table.columns = {{label}};
  for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
    if (v != baseline) table.columns.push_back({result.setup.variants[v].name});
  }
  for (const Group& group : groups_of(result)) {
    if (group.label != label) continue;
    std::vector<Cell> row{group.value};
    for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
      if (v != baseline)
        row.emplace_back(difference_text(paired(result, v, metric, group), metric));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table spread_table(const ExperimentResult& result, const Group& group) {
  Table table = metrics_table(result, std::nullopt, [&](std::size_t variant, const Metric& metric) {
    const auto values = values_of(result, variant, metric, group);
    const auto text = [&](double p) {
      return significant(metric.table_scale * eval::quantile(values, p), 3);
    };
    if (values.empty()) return std::string("-");
    return text(0.5) + " (" + text(0.05) + " .. " + text(0.95) + ")";
  });
  table.caption = "Median over all runs (5 % – 95 %)";
  return table;
}

/// Runs that are not ok; at most so many that the page stays one.
void add_failures(const ExperimentResult& result, Section& section) {
  constexpr std::size_t kMaxRows = 50;
  Table table;
  table.columns = {{"variant"}, {"recording"}, {"seed"}, {"status"}, {"cause"}};
  std::size_t count = 0;
  for (const ExperimentRun& run : result.runs) {
    if (is_trusted(run.result) || ++count > kMaxRows) continue;
    table.rows.push_back(
        {result.setup.variants[run.variant].name, result.setup.recordings[run.recording].name,
         static_cast<double>(run.seed), status_text(run.result), reason(run.result)});
  }
  if (count == 0) return;
  table.caption = "Runs that failed, diverged or are doubtful: " + std::to_string(count);
  if (count > kMaxRows) table.caption += ", the first " + std::to_string(kMaxRows);
  section.blocks.emplace_back(std::move(table));
}

/// A row per value of a label and variant, a column per kind of parameter: how much of the prior
/// is left.
void add_calibration_by(const ExperimentResult& result, const std::string& label,
                        Section& section) {
  Table table;
  std::vector<std::string> names;  // of all families: variants may estimate different ones
  for (const Group& group : groups_of(result)) {
    if (group.label != label) continue;
    for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
      const auto families = calibration_families(result, v, group);
      if (families.empty()) continue;
      for (const CalibrationFamily& family : families) add_once(names, family.name);
      std::vector<Cell> row{group.value, result.setup.variants[v].name};
      row.resize(2 + names.size(), "-");
      for (const CalibrationFamily& family : families) {
        const auto column = std::find(names.begin(), names.end(), family.name) - names.begin();
        row[2 + static_cast<std::size_t>(column)] =
            unbroken(compact(100. * family.left, 3) + " % (" + nees_text(family) + ")");
      }
      table.rows.push_back(std::move(row));
    }
  }
  if (table.rows.empty()) return;
  table.columns = {{label}, {"variant"}};
  for (const std::string& name : names) table.columns.push_back({name});
  for (std::vector<Cell>& row : table.rows) row.resize(table.columns.size(), "-");
  table.caption = "Calibration by " + label + ": rmse at the end / prior sigma (" + kNees +
                  "), of the runs that are ok";
  section.blocks.emplace_back(std::move(table));
}

/// A row per parameter: the prior, then rmse and NEES of each variant that estimated something.
void add_calibration_table(const ExperimentResult& result, const Group& all, Section& section) {
  Table table;
  table.caption =
      std::string("Calibration at the end: root mean square error over the runs that are ok (") +
      kNees + ")";
  table.columns = {{"parameter"}, {"prior sigma"}};
  std::vector<std::string> names;
  std::vector<std::vector<CalibrationStatistics>> columns;
  for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
    columns.push_back(calibration_statistics(result, v, all));
    if (columns.back().empty()) {
      columns.pop_back();
      continue;
    }
    table.columns.push_back({result.setup.variants[v].name});
    for (const auto& c : columns.back()) add_once(names, c.name);
  }
  if (columns.empty()) return;
  for (const std::string& parameter : names) {
    std::vector<Cell> row{parameter, 0.};
    const auto found = result.units.find(parameter);
    std::optional<report::DisplayUnit> unit;
    double prior_sigma = 0.;  // of the first variant that estimates it
    for (const auto& column : columns) {
      const auto c = std::find_if(column.begin(), column.end(),
                                  [&](const auto& s) { return s.name == parameter; });
      if (c == column.end()) {
        row.emplace_back("-");
        continue;
      }
      if (!unit) {
        unit = report::display_unit(found != result.units.end() ? found->second : "", c->rmse);
        row[0] = unbroken(report::with_unit(parameter, unit->name));
        prior_sigma = c->prior_sigma;
        row[1] = rounded(unit->scale * prior_sigma);
      }
      const bool is_other = std::abs(c->prior_sigma - prior_sigma) > 1e-6 * prior_sigma;
      row.emplace_back(
          unbroken(compact(unit->scale * c->rmse, 3) + " (" + nees_text(*c) + ")" +
                   (is_other ? ", prior " + compact(unit->scale * c->prior_sigma, 3) : "")));
    }
    table.rows.push_back(std::move(row));
  }
  section.blocks.emplace_back(std::move(table));
}

/// What became of the factors: a row per variant, two columns per update.
void add_gate_table(const ExperimentResult& result, Section& section) {
  std::vector<std::string> updates;
  for (const ExperimentRun& run : result.runs) {
    for (const UpdateTrack& update : run.result.updates) add_once(updates, update.name);
  }
  if (updates.empty()) return;
  Table table;
  table.caption = "Factors of each update in a run, and the share of them that was not believed";
  table.columns = {{"variant"}};
  for (const std::string& update : updates) {
    table.columns.push_back({update + ": factors"});
    table.columns.push_back({"rejected [%]", kThreeDigits});
  }
  for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
    std::vector<Cell> row{result.setup.variants[v].name};
    for (const std::string& name : updates) {
      double factors = 0., rejected = 0., runs = 0.;
      for (const ExperimentRun& run : result.runs) {
        if (run.variant != v) continue;
        for (const UpdateTrack& update : run.result.updates) {
          if (update.name != name) continue;
          factors += static_cast<double>(update.total.applied + update.total.rejected);
          rejected += static_cast<double>(update.total.rejected);
          runs += 1.;
        }
      }
      row.emplace_back(runs > 0. ? factors / runs : std::nan(""));
      row.emplace_back(factors > 0. ? 100. * rejected / factors : std::nan(""));
    }
    table.rows.push_back(std::move(row));
  }
  section.blocks.emplace_back(std::move(table));
}

void append(std::vector<Block> blocks, Section& section) {
  for (Block& block : blocks) section.blocks.push_back(std::move(block));
}

}  // namespace

Document report_of(const ExperimentResult& result) {
  Document document{result.setup.name, axes_of(result.setup), {what_ran(result)}};
  const auto groups = groups_of(result);
  const auto add = [&](Section section) {
    if (!section.blocks.empty()) document.sections.push_back(std::move(section));
  };
  Section summary{"Summary", {means_table(result, groups.front())}};
  if (result.setup.variants.size() > 1) {
    summary.blocks.emplace_back(paired_table(result, groups.front()));
  }
  for (const std::string& label : result.setup.report_by) {
    add_calibration_by(result, label, summary);
  }
  summary.blocks.emplace_back(spread_table(result, groups.front()));
  add_failures(result, summary);
  add(std::move(summary));
  for (const std::string& label : result.setup.report_by) {
    Section section{"By " + label, {}};
    for (const Group& group : groups) {
      if (group.label == label) section.blocks.emplace_back(means_table(result, group));
    }
    if (result.setup.variants.size() > 1) {
      for (const Metric& metric : metrics_of(result)) {
        if (metric.key == "ate_m") {
          section.blocks.emplace_back(paired_table_by(result, label, metric));
        }
      }
    }
    add(std::move(section));
  }
  Section calibration{"Calibration", {}};
  add_calibration_table(result, groups.front(), calibration);
  append(sigma_ratio_maps(result), calibration);
  append(calibration_plots(result), calibration);
  for (Section& section : recording_sections(result)) add(std::move(section));
  add(std::move(calibration));
  Section work{"Updates and time", {}};
  add_gate_table(result, work);
  append(stage_plots(result), work);
  add(std::move(work));
  return document;
}

}  // namespace viwo::experiment

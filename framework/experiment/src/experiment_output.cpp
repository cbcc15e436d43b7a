// What an experiment leaves behind: runs.csv, summary.json, report.html.
#include <algorithm>
#include <cmath>

#include "experiment_statistics.hpp"
#include "run_journal.hpp"
#include "viwo/eval/json.hpp"
#include "viwo/files/files.hpp"
#include "viwo/log/text.hpp"
#include "viwo/math/text_stream.hpp"
#include "viwo/report/html.hpp"
#include "viwo/results/run_output.hpp"

namespace viwo::experiment {
namespace {

using nlohmann::json;

json metrics_json(const ExperimentResult& result, std::size_t variant, const Group& group) {
  json metrics = json::object();
  for (const Metric& metric : all_metrics(result)) {
    const auto values = values_of(result, variant, metric, group);
    metrics[metric.key] = {{"n", values.size()},
                           {"mean", number_or_null(eval::mean(values))},
                           {"median", number_or_null(eval::median(values))},
                           {"std", number_or_null(eval::sample_standard_deviation(values))},
                           {"p5", number_or_null(eval::quantile(values, 0.05))},
                           {"p95", number_or_null(eval::quantile(values, 0.95))}};
  }
  return metrics;
}

json counts_json(const ExperimentResult& result, std::size_t variant, const Group& group) {
  const RunCounts counts = counts_of(result, variant, group);
  return {{"runs", counts.runs},
          {"diverged", counts.diverged},
          {"failed", counts.failed},
          {"doubtful", counts.doubtful}};
}

json paired_json(const ExperimentResult& result, const Group& group) {
  json variants = json::object();
  for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
    if (v == result.setup.baseline) continue;
    json& entry = variants[result.setup.variants[v].name] = json::object();
    for (const Metric& metric : all_metrics(result)) {
      const eval::PairedDifference d = paired(result, v, metric, group);
      entry[metric.key] = {{"pairs", d.pairs},
                           {"mean", number_or_null(d.mean)},
                           {"std", number_or_null(d.standard_deviation)},
                           {"low", number_or_null(d.low)},
                           {"high", number_or_null(d.high)}};
    }
  }
  return {{"baseline", result.setup.variants[result.setup.baseline].name},
          {"confidence", kConfidence},
          {"variants", variants}};
}

/// Mean relative pose errors by length.
json rpe_json(const ExperimentResult& result, const json& metrics) {
  json all = json::object();
  for (const double length_m : segment_lengths_m(result)) {
    const std::string length = eval::length_text(length_m);
    all[length] = {{"m", metrics.at("rpe_" + length + "_m").at("mean")},
                   {"deg", metrics.at("rpe_" + length + "_deg").at("mean")}};
  }
  return all;
}

json calibration_json(const ExperimentResult& result, std::size_t variant, const Group& group) {
  json calibration = json::object();
  for (const CalibrationStatistics& c : calibration_statistics(result, variant, group)) {
    calibration[c.name] = {{"runs", c.runs},
                           {"rmse", number_or_null(c.rmse)},
                           {"mean_sigma", number_or_null(c.mean_sigma)},
                           {"prior_sigma", number_or_null(c.prior_sigma)},
                           {"mean_error_sigmas", number_or_null(c.mean_error)},
                           {"nees", number_or_null(c.nees)},
                           {"nees_bounds", {c.nees_bounds.low, c.nees_bounds.high}},
                           {"widened_nees", number_or_null(c.widened_nees)}};
  }
  return calibration;
}

json variant_json(const ExperimentResult& result, std::size_t variant, const Group& all) {
  json entry = counts_json(result, variant, all);
  std::int64_t rank_deficient = 0;
  for (const ExperimentRun& run : result.runs) {
    if (run.variant == variant) rank_deficient += run.result.total.rank_deficient;
  }
  const json metrics = metrics_json(result, variant, all);
  entry["rank_deficient_samples"] = rank_deficient;
  entry["rpe"] = rpe_json(result, metrics);
  entry["nees_pose"] = metrics.at("nees_pose").at("mean");
  entry["nees_pose_median"] = metrics.at("nees_pose").at("median");
  entry["calibration"] = calibration_json(result, variant, all);
  entry["metrics"] = metrics;
  return entry;
}

json summary_of(const ExperimentResult& result) {
  const auto groups = groups_of(result);
  json variants = json::object();
  for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
    variants[result.setup.variants[v].name] = variant_json(result, v, groups.front());
  }
  json by = json::object();
  for (std::size_t g = 1; g < groups.size(); ++g) {
    json& group = by[groups[g].label][groups[g].value];
    for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
      json entry = counts_json(result, v, groups[g]);
      entry["metrics"] = metrics_json(result, v, groups[g]);
      entry["calibration"] = calibration_json(result, v, groups[g]);
      group["variants"][result.setup.variants[v].name] = entry;
    }
    group["paired"] = paired_json(result, groups[g]);
  }
  return {{"experiment", result.setup.name},
          {"viwo_version", viwo_version()},
          {"jobs", result.jobs},
          {"wall_s", result.wall_s},
          {"realtime_factor", number_or_null(realtime_factors(result).core)},
          {"variants", variants},
          {"paired", paired_json(result, groups.front())},
          {"by", by}};
}

/// One field of a CSV line: in quotes if it needs them, on one line. Texts of files may be in it:
/// none of them is a formula for who opens the table.
std::string csv_field(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  text = log::printable(text);
  if (text.find_first_of("=+-@") == 0) text.insert(0, 1, '\'');
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string field = "\"";
  for (const char c : text) {
    if (c == '"') field += '"';
    field += c;
  }
  return field + '"';
}

std::string runs_csv(const ExperimentResult& result) {
  const std::vector<Metric> metrics = all_metrics(result);
  TextStream csv;
  csv.precision(12);
  csv << "variant,recording,seed,status,duration_s,wall_s,samples,rank_deficient,gated";
  for (const Metric& metric : metrics) csv << ',' << metric.key;
  csv << ",cause\n";
  for (const ExperimentRun& run : result.runs) {
    csv << result.setup.variants[run.variant].name << ','
        << result.setup.recordings[run.recording].name << ',' << run.seed << ','
        << status_text(run.result) << ',' << run.result.duration_s << ',' << run.result.wall_s;
    const PreintegratedPose& total = run.result.total;
    if (total.samples > 0) {
      csv << ',' << total.samples << ',' << total.rank_deficient << ',' << total.gated;
    } else {
      csv << ",,,";  // of a filter: its updates count for themselves
    }
    for (const Metric& metric : metrics) {
      csv << ',';
      if (const double value = metric.of(run.result); std::isfinite(value)) csv << value;
    }
    csv << ',' << csv_field(reason(run.result)) << '\n';
  }
  return csv.str();
}

}  // namespace

void write_experiment(const std::filesystem::path& folder, const ExperimentResult& result) {
  files::NewResults out(folder);
  files::write_text(out.file("runs.csv"), runs_csv(result));
  files::write_text(out.file("summary.json"), json_text(summary_of(result)));
  files::write_text(out.file("report.html"), report::to_html(report_of(result)));
  out.commit(kResults);
  RunJournal(folder).remove();
}

}  // namespace viwo::experiment

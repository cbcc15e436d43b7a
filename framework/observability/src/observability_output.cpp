// What an analysis leaves behind: observability.json, report.html, the table on the terminal.
#include <algorithm>
#include <cmath>

#include "viwo/eval/json.hpp"
#include "viwo/files/files.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/text_stream.hpp"
#include "viwo/observability/observability.hpp"
#include "viwo/report/html.hpp"
#include "viwo/results/run_output.hpp"

namespace viwo::observability {
namespace {

using nlohmann::json;

/// Weights below this part of the largest one are rounding.
constexpr double kNoWeight = 1e-6;

std::string motion_name(const ObservabilityReport& report, const ObservabilityResult& result) {
  const std::string& name = report.setup.recordings[result.motion].name;
  return name.empty() ? report.setup.name : name;
}

const std::string& variant_name(const ObservabilityReport& report,
                                const ObservabilityResult& result) {
  return report.setup.variants[result.variant].name;
}

/// "4 + 3": global directions, and how many a free gauge adds.
std::string sum_text(const ObservabilityResult& result) {
  return std::to_string(result.held.unobservable) + " + " +
         std::to_string(result.free.unobservable - result.held.unobservable);
}

/// What explains the null space: "constant steering 8, t_OtoI 1"; global directions and gauge are
/// counted elsewhere.
std::string explanation(const Observability& state) {
  std::string text;
  for (const ExplainedDirections& set : state.explained) {
    if (set.adds == 0) continue;
    if (set.name == "global position and yaw" || set.name == "placement of O") continue;
    text += (text.empty() ? "" : ", ") + set.name + " " + std::to_string(set.adds);
  }
  if (state.unexplained > 0) {
    text += (text.empty() ? "" : ", ") + std::to_string(state.unexplained) + " others";
  }
  return text;
}

json to_json(const Observability& state) {
  json out = {{"state_size", state.state_size},
              {"rank", state.rank},
              {"unobservable", state.unobservable},
              {"gap", number_or_null(state.gap)}};
  out["null_directions"] = json::array();
  for (Eigen::Index k = 0; k < state.null_basis.cols(); ++k) {
    json direction = json::object();
    for (Eigen::Index i = 0; i < state.null_basis.rows(); ++i) {
      const double weight = state.null_basis(i, k);
      if (std::abs(weight) > kNoWeight)
        direction[state.states[static_cast<std::size_t>(i)]] = weight;
    }
    out["null_directions"].push_back(direction);
  }
  out["singular_values"] = std::vector<double>(
      state.singular_values.data(), state.singular_values.data() + state.singular_values.size());
  for (const ExplainedDirections& set : state.explained) {
    out["explained"][set.name] = {{"when", set.when},
                                  {"dimension", set.dimension},
                                  {"hidden", set.hidden},
                                  {"adds", set.adds},
                                  {"max_angle_rad", set.max_angle_rad}};
  }
  if (!state.explained.empty()) out["unexplained"] = state.unexplained;
  return out;
}

json to_json(const SigmaOverTime& sigma) {
  const auto numbers = [](const std::vector<double>& values) {
    json out = json::array();
    for (const double value : values) out.push_back(number_or_null(value));
    return out;
  };
  return {{"t_s", sigma.t_s}, {"hidden", numbers(sigma.hidden)}, {"others", numbers(sigma.others)}};
}

json to_json(const ObservabilityReport& report) {
  json motions = json::object();
  for (const ObservabilityResult& result : report.results) {
    json entry = to_json(result.held);
    entry["gauge_free"] = to_json(result.free);
    if (result.wheels_alone >= 0) {
      entry["wheels_alone"] = {{"intrinsics", result.n_intrinsics},
                               {"unobservable", result.wheels_alone}};
      if (result.wheels_and_mount >= 0) {
        entry["wheels_alone"]["unobservable_with_mount"] = result.wheels_and_mount;
      }
    }
    entry["parameters"] = json::object();
    for (const ObservedParameter& parameter : result.parameters) {
      entry["parameters"][parameter.name] = {
          {"observable", parameter.observable},
          {"sigma_ratio", number_or_null(parameter.sigma_ratio)}};
    }
    entry["hidden_calibration"] = result.hidden_calibration;
    entry["sigma_over_time"] = {{"without_noise", to_json(result.without_noise)},
                                {"as_configured", to_json(result.as_configured)}};
    motions[motion_name(report, result)][variant_name(report, result)] = entry;
  }
  return {{"name", report.setup.name},
          {"tolerance", report.tolerance},
          {"wall_s", report.wall_s},
          {"notes", report.notes},
          {"motions", motions}};
}

std::vector<std::string> parameter_names(const ObservabilityReport& report) {
  std::vector<std::string> names;
  for (const ObservabilityResult& result : report.results) {
    for (const ObservedParameter& parameter : result.parameters) {
      if (std::find(names.begin(), names.end(), parameter.name) == names.end()) {
        names.push_back(parameter.name);
      }
    }
  }
  return names;
}

/// "0.14", "✗" for what cannot be told, "✗ 0.6" where its prior still shrinks.
std::string cell_text(const ObservedParameter& parameter) {
  const double ratio = parameter.sigma_ratio;
  if (parameter.observable) return significant(ratio, ratio < 0.01 ? 1 : 2);
  return ratio > 0.95 ? "✗" : "✗ " + significant(ratio, 1);
}

/// Parameters over motions for one variant: log10 of the sigma ratio, marked where unobservable.
report::Plot heat_map(const ObservabilityReport& report, std::size_t variant) {
  report::Plot plot{report.setup.variants[variant].name, "", ""};
  report::HeatMap map;
  map.y = parameter_names(report);
  map.z.resize(map.y.size());
  map.text.resize(map.y.size());
  for (const ObservabilityResult& result : report.results) {
    if (result.variant != variant) continue;
    map.x.push_back(motion_name(report, result));
    for (std::size_t i = 0; i < map.y.size(); ++i) {
      double ratio = std::nan("");
      std::string text;
      for (const ObservedParameter& parameter : result.parameters) {
        if (parameter.name != map.y[i]) continue;
        ratio = parameter.sigma_ratio;
        text = cell_text(parameter);
      }
      map.z[i].push_back(std::log10(ratio));
      map.text[i].push_back(text);
    }
  }
  map.colour_label = "log10(sigma after / before)";
  map.z_min = -3.;
  map.z_max = 0.;
  plot.heat_map = map;
  plot.caption =
      "Sigma of the estimator after the motion over its prior sigma; ✗: the parameter is part of "
      "an "
      "unobservable direction.";
  return plot;
}

/// Per motion: sigma along the hidden directions (dotted) and along the others, of each variant.
report::Plot sigma_plot(const ObservabilityReport& report, std::size_t motion) {
  report::Plot plot{"", "time [s]", "sigma / prior sigma"};
  plot.half_width = plot.log_y = true;
  for (const ObservabilityResult& result : report.results) {
    if (result.motion != motion) continue;
    plot.title = motion_name(report, result);
    const SigmaOverTime& sigma = result.as_configured;
    report::Series others{variant_name(report, result), sigma.t_s, sigma.others};
    report::Series hidden{variant_name(report, result) + ", hidden", sigma.t_s, sigma.hidden};
    hidden.group = variant_name(report, result);
    hidden.dash = report::Dash::kDotted;
    plot.series.push_back(others);
    if (result.hidden_calibration > 0) plot.series.push_back(hidden);
  }
  return plot;
}

report::Table dimensions_table(const ObservabilityReport& report) {
  report::Table table;
  table.caption = "Unobservable directions: with the gauge held + what a free gauge adds";
  table.columns = {{"motion"},
                   {"variant"},
                   {"state"},
                   {"unobservable"},
                   {"wheels alone"},
                   {"with planar mount"},
                   {"what they are (gauge free, besides global and placement of O)"},
                   {"gap"}};
  for (const ObservabilityResult& result : report.results) {
    const auto count = [](int n) { return n < 0 ? std::nan("") : static_cast<double>(n); };
    table.rows.push_back({motion_name(report, result), variant_name(report, result),
                          result.free.state_size, sum_text(result), count(result.wheels_alone),
                          count(result.wheels_and_mount), explanation(result.free),
                          result.free.gap});
  }
  return table;
}

}  // namespace

report::Document report_of(const ObservabilityReport& report) {
  report::Document document{report.setup.name,
                            "observability: " + std::to_string(report.setup.recordings.size()) +
                                " motions, " + std::to_string(report.setup.variants.size()) +
                                " variants",
                            {{"Null spaces", {dimensions_table(report)}}}};
  for (const std::string& note : report.notes) {
    document.sections[0].blocks.emplace_back(
        report::Paragraph{note, report::Paragraph::Tone::kWarning});
  }
  document.sections[0].blocks.emplace_back(report::Paragraph{
      "Rank of the observability matrix built from the estimator's own Jacobians without noise; "
      "columns scaled to unit length, singular values below " +
          significant(report.tolerance, 2) +
          " of the largest count as zero. The gap is the smallest one kept over the largest one "
          "dropped. Wheels alone: null space of the intrinsics with the poses known.",
      report::Paragraph::Tone::kNote});
  report::Section parameters{"Parameters", {}};
  for (std::size_t v = 0; v < report.setup.variants.size(); ++v) {
    parameters.blocks.emplace_back(heat_map(report, v));
  }
  document.sections.push_back(parameters);
  report::Section sigma{"What shrinks and what does not", {}};
  sigma.blocks.emplace_back(report::Paragraph{
      "Root mean square sigma of the calibration in units of the prior sigmas, of the filter on "
      "the "
      "run as configured, with its noise: along the directions that the analysis says are hidden "
      "(dotted: they must stay at 1), and along all others.",
      report::Paragraph::Tone::kNote});
  for (std::size_t m = 0; m < report.setup.recordings.size(); ++m) {
    sigma.blocks.emplace_back(sigma_plot(report, m));
  }
  document.sections.push_back(sigma);
  return document;
}

void write_observability(const std::filesystem::path& folder, const ObservabilityReport& report) {
  files::NewResults out(folder);
  files::write_text(out.file("observability.json"), json_text(to_json(report)));
  files::write_text(out.file("report.html"), report::to_html(report_of(report)));
  out.commit({"observability.json", "report.html"});
}

std::string describe(const ObservabilityReport& report) {
  TextStream out;
  std::size_t motion_width = 6, variant_width = 7;
  for (const ObservabilityResult& result : report.results) {
    motion_width = std::max(motion_width, motion_name(report, result).size());
    variant_width = std::max(variant_width, variant_name(report, result).size());
  }
  const auto left = [&](const std::string& text, std::size_t width) {
    out << text << std::string(width > text.size() ? width - text.size() : 0, ' ') << "  ";
  };
  left("motion", motion_width);
  left("variant", variant_width);
  out << "state  unobservable  wheels alone  (+ mount)  what they are\n";
  for (const ObservabilityResult& result : report.results) {
    left(motion_name(report, result), motion_width);
    left(variant_name(report, result), variant_width);
    left(std::to_string(result.free.state_size), 5);
    left(sum_text(result), 12);
    const auto count = [](int n) { return n < 0 ? std::string("-") : std::to_string(n); };
    left(result.wheels_alone < 0
             ? "-"
             : count(result.wheels_alone) + " of " + std::to_string(result.n_intrinsics),
         12);
    left(count(result.wheels_and_mount), 9);
    out << explanation(result.free) << "\n";
  }
  return out.str();
}

}  // namespace viwo::observability

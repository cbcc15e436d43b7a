#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "remedies.hpp"
#include "viwo/api/status.hpp"
#include "viwo/config/overrides.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/eval/json.hpp"
#include "viwo/files/files.hpp"
#include "viwo/inspect/inspection.hpp"
#include "viwo/report/html.hpp"

namespace viwo::inspect {
namespace {

std::vector<std::string> sensors_of(const Inspection& inspection) {
  std::vector<std::string> sensors;
  for (const Finding& finding : inspection.findings) {
    if (sensors.empty() || sensors.back() != finding.sensor) sensors.push_back(finding.sensor);
  }
  return sensors;
}

std::size_t count_of(const Inspection& inspection, Severity severity) {
  return static_cast<std::size_t>(
      std::count_if(inspection.findings.begin(), inspection.findings.end(),
                    [&](const Finding& f) { return f.severity == severity; }));
}

/// What is as it should be, and how many things are not.
std::string verdict_of(const Inspection& inspection, const std::string& sensor) {
  std::string text;
  std::size_t faults = 0, notes = 0;
  for (const Finding& finding : inspection.findings) {
    if (finding.sensor != sensor) continue;
    if (finding.severity == Severity::kFits) text += (text.empty() ? "" : "; ") + finding.what;
    if (finding.severity == Severity::kNote) ++notes;
    if (finding.severity == Severity::kFault) ++faults;
  }
  const std::string end = faults > 0  ? std::to_string(faults) + " wrong"
                          : notes > 0 ? "fits, with notes"
                                      : "fits";
  return (text.empty() ? "" : text + ": ") + end;
}

std::string line_of(const Remedy& remedy) { return remedy.key + ": " + remedy.value; }

std::string plural(std::size_t n, const std::string& what) {
  return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

std::vector<std::pair<Remedy, std::string>> remedies_of(const Inspection& inspection) {
  std::vector<std::pair<Remedy, std::string>> all;
  for (const Finding& finding : inspection.findings) {
    if (finding.severity != Severity::kFault) continue;
    for (const Remedy& remedy : finding.remedies) {
      all.emplace_back(remedy, finding.sensor + ": " + finding.what);
    }
  }
  return all;
}

/// Where the channels are not those of the joints.
bool is_for_hands(const config::Node& configuration, const Remedy& remedy) {
  const std::size_t n = channels_of(configuration, remedy).size();
  const config::Node value = config::parse(remedy.value, "--fix");
  return n > 0 && value.is_list() && value.items().size() != n;
}

}  // namespace

std::string describe(const Inspection& inspection) {
  std::string text;
  for (const std::string& sensor : sensors_of(inspection)) {
    text += sensor + ": " + verdict_of(inspection, sensor) + "\n";
  }
  for (const Severity severity : {Severity::kFault, Severity::kNote}) {
    const std::size_t n = count_of(inspection, severity);
    if (n == 0) continue;
    text += "\n" + plural(n, severity == Severity::kFault ? "finding" : "note") + ":\n";
    for (const Finding& finding : inspection.findings) {
      if (finding.severity != severity) continue;
      text += "  " + finding.sensor + ": " + finding.what + "\n";
      for (const Remedy& remedy : finding.remedies) {
        text += "      write  " + line_of(remedy) + "\n";
      }
    }
  }
  if (!inspection.has_faults()) text += "\nno findings\n";
  return text;
}

nlohmann::json to_json(const Inspection& inspection) {
  using nlohmann::json;
  json findings = json::array();
  for (const Finding& finding : inspection.findings) {
    json figures = json::object(), remedies = json::object();
    for (const Figure& figure : finding.figures) {
      figures[figure.name] = {
          {"value", std::isfinite(figure.value) ? json(figure.value) : json(nullptr)},
          {"unit", figure.unit}};
    }
    for (const Remedy& remedy : finding.remedies) remedies[remedy.key] = remedy.value;
    findings.push_back({{"sensor", finding.sensor},
                        {"severity", name(finding.severity)},
                        {"check", finding.check},
                        {"what", finding.what},
                        {"figures", figures},
                        {"write", remedies}});
  }
  return {{"name", inspection.name},
          {"faults", count_of(inspection, Severity::kFault)},
          {"notes", count_of(inspection, Severity::kNote)},
          {"findings", findings}};
}

report::Document report_of(const Inspection& inspection) {
  using namespace report;
  Document document;
  document.title = "Inspection: " + inspection.name;
  document.subtitle = plural(count_of(inspection, Severity::kFault), "finding") + ", " +
                      plural(count_of(inspection, Severity::kNote), "note");
  Section findings{"Findings"};
  for (const Finding& finding : inspection.findings) {
    if (finding.severity == Severity::kFits) continue;
    std::string text = finding.sensor + ": " + finding.what;
    for (const Remedy& remedy : finding.remedies) text += ". Write " + line_of(remedy);
    findings.blocks.push_back(Paragraph{text, finding.severity == Severity::kFault
                                                  ? Paragraph::Tone::kWarning
                                                  : Paragraph::Tone::kNote});
  }
  if (findings.blocks.empty()) findings.blocks.push_back(Paragraph{"None."});
  Section sensors{"Sensors"};
  for (const std::string& sensor : sensors_of(inspection)) {
    Table table;
    table.caption = sensor;
    table.columns = {{"check"}, {"figure"}, {"value"}, {"unit"}};
    for (const Finding& finding : inspection.findings) {
      if (finding.sensor != sensor) continue;
      for (const Figure& figure : finding.figures) {
        table.rows.push_back({finding.check, figure.name, figure.value, figure.unit});
      }
    }
    if (!table.rows.empty()) sensors.blocks.push_back(std::move(table));
  }
  Section plots{"Plots"};
  for (const Plot& plot : inspection.plots) plots.blocks.push_back(plot);
  document.sections = {std::move(findings), std::move(plots), std::move(sensors)};
  return document;
}

void write_inspection(const std::filesystem::path& folder, const Inspection& inspection) {
  files::NewResults out(folder);
  files::write_text(out.file("inspection.json"), json_text(to_json(inspection)));
  files::write_text(out.file("report.html"), report::to_html(report_of(inspection)));
  out.commit(kResults);
}

namespace {

/// The configuration with the remedies that can be written, and why the others cannot.
/// `one_by_one`: those with which the recording can be read no more are among these.
std::string with_remedies(const RunSetup& setup, const Inspection& inspection,
                          PluginRegistry& plugins, bool one_by_one) {
  config::Node fixed = setup.resolved;
  std::string head = "# " + setup.name + ", as viwo inspect would have it.\n";
  std::map<std::string, std::string> comments;
  for (const auto& [remedy, reason] : remedies_of(inspection)) {
    const auto leave_out = [&, &remedy = remedy, &reason = reason](const std::string& why) {
      head += "# " + why + ": " + line_of(remedy) + "  (" + reason + ")\n";
    };
    // All keys that there are have a value here.
    if (fixed.at_path(remedy.key) == nullptr) {
      leave_out("Not in here, for want of such a key");
      continue;
    }
    if (is_for_hands(fixed, remedy)) {
      leave_out("To be combined by hand with what is there");
      continue;
    }
    if (comments.contains(remedy.key)) {
      leave_out("Not in here, for what is found first has this key");
      continue;
    }
    config::Node next = fixed;
    config::set_path(next, remedy.key, config::parse(remedy.value, "--fix"));
    if (one_by_one) {
      try {
        read_run(config::parse(config::to_yaml(next), "--fix"), plugins);
      } catch (const InputError& error) {
        const std::string what = error.what();
        leave_out("Not in here, for with it nothing can be read (" +
                  what.substr(0, what.find('\n')) + ")");
        continue;
      }
    }
    fixed = std::move(next);
    comments[remedy.key] = reason;
  }
  return head + config::to_yaml(fixed, comments);
}

}  // namespace

std::string fixed_configuration(const RunSetup& setup, const Inspection& inspection,
                                PluginRegistry& plugins) {
  std::string text = with_remedies(setup, inspection, plugins, false);
  try {
    read_run(config::parse(text, "--fix"), plugins);
  } catch (const InputError&) {
    text = with_remedies(setup, inspection, plugins, true);
    read_run(config::parse(text, "--fix"), plugins);
  }
  return text;
}

}  // namespace viwo::inspect

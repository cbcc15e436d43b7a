#include "viwo/conformance/conformance.hpp"

#include <algorithm>

#include "checks.hpp"

namespace viwo::conformance {

bool Conformance::passed() const {
  return std::all_of(checks.begin(), checks.end(), [](const CheckResult& c) { return c.passed(); });
}

Conformance check_plugin(const std::filesystem::path& file, const Options& options) {
  Subject subject(file, options);
  Conformance out;
  out.plugin = subject.info();
  const auto run = [&](const std::string& name, const Check& check) {
    out.checks.push_back(run_apart(name, options.time_limit_s, check));
    return out.checks.back().passed();
  };
  run("schema", [&](Findings& findings) { check_schema(subject.info(), findings); });

  subject.choose_section(options);
  const bool constructs = run("construction", [&](Findings& findings) {
    if (!subject.no_section().empty()) return findings.fail(subject.no_section());
    const std::string refusal = subject.try_section(subject.section());
    if (!refusal.empty()) findings.fail("no object: " + refusal);
  });
  if (!constructs) return out;  // there is nothing to check the rest on
  run("parameters", [&](Findings& findings) { check_parameters(subject, findings); });

  const std::string& kind = subject.info().kind;
  const std::vector<NamedCheck> checks = kind == "kinematics" ? kinematics_checks(subject)
                                         : kind == "sensor"   ? sensor_checks(subject)
                                         : kind == "update"   ? update_checks(subject)
                                                              : std::vector<NamedCheck>();
  for (const auto& [name, check] : checks) {
    const bool needed = kind == "update"       ? name == "declarations" || name == "start"
                        : kind == "kinematics" ? name == "repeatable"
                                               : false;
    if (run(name, check) || !needed) continue;
    out.checks.back().failures.emplace_back(
        "the checks behind this one need it, and were left out");
    break;
  }
  return out;
}

std::string to_text(const CheckResult& result, bool verbose) {
  const char* const answer = !result.passed()          ? "FAILED  "
                             : !result.skipped.empty() ? "skipped "
                                                       : "ok      ";
  std::string text = answer + result.name + "\n";
  if (!result.skipped.empty()) text += "          " + result.skipped + "\n";
  for (const std::string& failure : result.failures) text += "          " + failure + "\n";
  for (const std::string& warning : result.warnings) text += "          warning: " + warning + "\n";
  if (!verbose) return text;
  for (const std::string& note : result.notes) text += "          note: " + note + "\n";
  return text;
}

}  // namespace viwo::conformance

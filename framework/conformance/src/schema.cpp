#include <array>
#include <cctype>
#include <cmath>
#include <regex>

#include "checks.hpp"

namespace viwo::conformance {
namespace {

using config::Node;

/// How a unit ends a key: "rad/s^2" as "rad_per_s2", "m/s^2/sqrt(Hz)" as "m_per_s2_sqrt_hz".
std::string key_suffix(const std::string& unit) {
  std::string suffix;
  bool first = true;
  for (const char c : unit) {
    if (c == '/') {
      suffix += first ? "_per_" : "_";
      first = false;
    } else if (c == '(') {
      suffix += '_';
    } else if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      suffix += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  return suffix;
}

constexpr std::array kUnitSuffixes = {
    "m",  "mm",  "rad",     "deg",       "s",   "ms",        "ns",       "hz",        "px",
    "kg", "mps", "m_per_s", "rad_per_s", "rpm", "deg_per_s", "m_per_s2", "rad_per_s2"};

bool ends_in(const std::string& name, const std::string& suffix) {
  return name == suffix || name.ends_with("_" + suffix);
}

void check_unit(const ParamSpec& spec, Findings& findings) {
  const std::string name = spec.name, unit = spec.unit;
  if (!unit.empty() && unit != "1") {
    const std::string suffix = key_suffix(unit);
    if (!ends_in(name, suffix)) {
      findings.fail("parameter '" + name + "' is in " + unit + ", but its name does not say so - " +
                    "end it in '_" + suffix + "'");
    }
    return;
  }
  const bool is_number = spec.type == ParamType::kInt || spec.type == ParamType::kNumber ||
                         spec.type == ParamType::kNumbers;
  for (const std::string suffix : kUnitSuffixes) {
    if (is_number && name.ends_with("_" + suffix)) {
      findings.fail("parameter '" + name + "' ends in '_" + suffix +
                    "', but its table gives no unit - set .unit, or rename it");
      return;
    }
  }
}

Node with(const Node& section, const ParamSpec& spec, Node value) {
  Node changed = section;
  changed.set(spec.name, std::move(value));
  return changed;
}

Node numbers(const ParamSpec& spec, double value, int count) {
  char text[40] = ".nan";
  if (!std::isnan(value)) std::snprintf(text, sizeof(text), "%.17g", value);
  if (spec.type != ParamType::kNumbers) return Node::scalar_of(text);
  Node list = Node::list_of();
  for (int i = 0; i < count; ++i) list.items().push_back(Node::scalar_of(text));
  return list;
}

/// How many entries the section (or the default) has for a list.
int count_of(const Node& section, const ParamSpec& spec) {
  const Node* value = section.find(spec.name);
  return value != nullptr && value->is_list() ? std::max(1, static_cast<int>(value->items().size()))
                                              : 1;
}

/// Values that the table does not allow.
std::vector<double> outside(const ParamSpec& spec) {
  std::vector<double> values;
  if (spec.type != ParamType::kInt) values.push_back(std::nan(""));
  if (std::isfinite(spec.lowest())) {
    values.push_back(spec.lowest() - 1. - 1e-3 * std::abs(spec.lowest()));
    if (spec.excludes_lowest()) values.push_back(spec.lowest());
  }
  if (std::isfinite(spec.max)) values.push_back(spec.max + 1. + 1e-3 * std::abs(spec.max));
  return values;
}

/// Values at the edge of what it allows.
std::vector<double> at_the_edge(const ParamSpec& spec) {
  std::vector<double> values;
  if (std::isfinite(spec.lowest())) {
    values.push_back(spec.lowest() + (spec.excludes_lowest() ? 1e-9 : 0.));
  }
  if (std::isfinite(spec.max)) values.push_back(spec.max);
  if (spec.type == ParamType::kInt && !values.empty()) values.front() = std::ceil(values.front());
  return values;
}

/// The plugin's answer must be an object or an InputError.
void expect_answer(const Subject& subject, const Node& section, const std::string& what,
                   Findings& findings) {
  try {
    subject.try_section(section);
  } catch (const PluginFailure& failure) {
    findings.fail(what + ": the constructor threw '" + failure.text() +
                  "' - throw ParamError(\"parameter\", \"what is wrong\") for values that do not "
                  "work");
  }
}

}  // namespace

bool is_snake_case(const std::string& text) {
  static const std::regex form(
      "([a-z][a-z0-9]*|[A-Z][0-9]?|[A-Z][A-Za-z]{0,2}[0-9]?(to|in|wrt)[A-Z][A-Za-z]{0,2}[0-9]?)"
      "(_([a-z0-9]+|[A-Z][A-Z]?[0-9]?|[A-Z][A-Za-z]{0,2}[0-9]?(to|in|wrt)[A-Z][A-Za-z]{0,2}[0-9]?))"
      "*");
  return std::regex_match(text, form);
}

void check_schema(const PluginInfo& info, Findings& findings) {
  if (!is_snake_case(info.name)) {
    findings.fail("the plugin's name '" + info.name + "' is not in snake_case");
  }
  const std::pair<const char*, const std::string*> texts[] = {
      {"version", &info.version}, {"summary", &info.summary}, {"license", &info.license}};
  for (const auto& [what, text] : texts) {
    if (text->empty()) findings.fail(std::string("VIWO_REGISTER gives no ") + what);
  }
  for (const ParamSpec& spec : info.params) {
    const std::string name = spec.name;
    if (!is_snake_case(name)) findings.fail("parameter '" + name + "' is not in snake_case");
    if (spec.help.empty()) {
      findings.fail("parameter '" + name + "' has no help - say in one sentence what it does");
    }
    if (!(spec.lowest() <= spec.max)) {
      findings.fail("parameter '" + name + "': min " + number(spec.lowest()) + " is above max " +
                    number(spec.max));
    }
    check_unit(spec, findings);
  }
}

void check_parameters(const Subject& subject, Findings& findings) {
  const Node& section = subject.section();
  for (const ParamSpec& spec : subject.info().params) {
    const bool is_list = spec.type == ParamType::kNumbers;
    if (!is_list && spec.type != ParamType::kNumber && spec.type != ParamType::kInt) continue;
    const std::string name = spec.name;
    const int count = count_of(section, spec);
    for (const double value : outside(spec)) {
      if (!subject.try_section(with(section, spec, numbers(spec, value, count))).empty()) continue;
      findings.fail("parameter '" + name + "' is taken as " + number(value) +
                    ", which its table does not allow");
    }
    // A sensor may well do all of its work in the constructor.
    if (subject.info().kind == "sensor") continue;
    for (const double value : at_the_edge(spec)) {
      expect_answer(subject, with(section, spec, numbers(spec, value, count)),
                    "parameter '" + name + "' at its limit " + number(value), findings);
    }
    const double allowed =
        spec.excludes_lowest() ? spec.lowest() + 1. : std::max(spec.lowest(), 0.);
    for (const int n : {0, 1, 7, 100}) {
      if (!is_list) break;
      expect_answer(subject, with(section, spec, numbers(spec, std::min(allowed, spec.max), n)),
                    "parameter '" + name + "' with " + std::to_string(n) + " entries", findings);
    }
  }
  Node unknown = section;
  unknown.set("no_such_parameter", Node::scalar_of("1"));
  if (subject.try_section(unknown).empty()) findings.fail("an unknown parameter is not refused");
}

}  // namespace viwo::conformance

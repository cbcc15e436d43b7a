#include "subject.hpp"

#include <algorithm>
#include <cmath>
#include <system_error>

#include "findings.hpp"
#include "viwo/config/params.hpp"
#include "viwo/config/yaml.hpp"

namespace viwo::conformance {
namespace {

namespace fs = std::filesystem;
using config::Node;

/// The first section, in the order of the file, that says `type: name`.
const Node* find_section(const Node& node, const std::string& name) {
  const Node* type = node.find("type");
  if (type != nullptr && type->is_scalar() && type->scalar() == name) return &node;
  for (const auto& entry : node.entries()) {
    if (const Node* found = find_section(entry.value, name)) return found;
  }
  for (const Node& item : node.items()) {
    if (const Node* found = find_section(item, name)) return found;
  }
  return nullptr;
}

double within(const ParamSpec& spec, double value) {
  const double lowest = spec.lowest() + (spec.excludes_lowest() ? 1e-3 : 0.);
  return std::clamp(value, lowest, std::max(lowest, spec.max));
}

/// Entry `j` of `n` of a list: places go around a circle, all else is a little different each.
double made_up(const ParamSpec& spec, int j, int n) {
  const char axis = spec.name[0];
  const bool is_place =
      spec.name[1] == '_' && (axis == 'x' || axis == 'y') && !(spec.lowest() >= 0.);
  const double angle = 2. * M_PI * (j + 0.37) / n;
  const double value = !is_place     ? 0.1 + 0.003 * j
                       : axis == 'x' ? 0.3 * std::cos(angle)
                                     : 0.27 * std::sin(angle);
  return within(spec, value);
}

Node made_up(const ParamSpec& spec, int n) {
  const int count = spec.size > 0 ? spec.size : n;
  const auto list = [count](const auto& item) {
    Node node = Node::list_of();
    for (int j = 0; j < count; ++j) node.items().push_back(Node::scalar_of(item(j)));
    return node;
  };
  std::string choice = spec.choices.empty() ? "a" : config::choices_of(spec).front();
  switch (spec.type) {
    case ParamType::kBool:
      return Node::scalar_of("true");
    case ParamType::kInt:
      return Node::scalar_of(number(std::ceil(within(spec, 1.))));
    case ParamType::kNumber:
      return Node::scalar_of(number(within(spec, 0.3)));
    case ParamType::kNumbers:
      return list([&](int j) { return number(made_up(spec, j, count)); });
    case ParamType::kString:
      return Node::scalar_of(choice);
    case ParamType::kStrings:
      return list([&](int) { return choice; });
    case ParamType::kPath:
    case ParamType::kKinematics:
      break;
  }
  return {};
}

/// The folder of the file, then the others except those with another file of that name: nobody
/// could tell which of the two was meant.
std::vector<fs::path> search_path(const fs::path& file, const Options& options) {
  std::error_code error;
  const fs::path own = fs::canonical(file, error).parent_path();
  std::vector<fs::path> folders{own.empty() ? file.parent_path() : own};
  for (const fs::path& folder : PluginRegistry::default_search_path(options.plugin_path)) {
    const fs::path other = folder / file.filename();
    if (fs::exists(other, error) && !fs::equivalent(other, file, error)) continue;
    folders.push_back(folder);
  }
  return folders;
}

}  // namespace

std::vector<Node> made_up_sections(const PluginInfo& info, std::string& missing) {
  std::vector<Node> sections;
  for (const int n : {4, 2, 3, 1, 6, 8}) {
    Node section = Node::empty_map();
    section.set("type", Node::scalar_of(info.name));
    bool has_list = false;
    for (const ParamSpec& spec : info.params) {
      if (!spec.required) continue;
      const Node value = made_up(spec, n);
      if (value.is_null()) {
        missing = spec.name;
        return {};
      }
      has_list = has_list || value.is_list();
      section.set(spec.name, value);
    }
    sections.push_back(std::move(section));
    if (!has_list) break;
  }
  return sections;
}

Subject::Subject(const fs::path& file, const Options& options)
    : registry_(std::make_shared<PluginRegistry>(
          search_path(file, options), [](const PluginInfo&, LogLevel, std::string_view) {})),
      info_(registry_->check(file)) {}

void Subject::choose_section(const Options& options) {
  if (options.config) {
    const Node root = config::load_file(*options.config);
    const Node* found = find_section(root, info_.name);
    if (found == nullptr) {
      throw InputError(options.config->string() + ": no section says 'type: " + info_.name +
                       "', the plugin that is to be checked");
    }
    section_ = *found;
    // Keys of the host, beside the plugin's own.
    std::erase_if(section_.entries(), [&](const Node::Entry& entry) {
      return entry.key == "enabled" || (info_.kind == "update" && entry.key == "sensor");
    });
    return;
  }
  std::string missing;
  const std::vector<Node> sections = made_up_sections(info_, missing);
  if (sections.empty()) {
    no_section_ = "the parameter '" + missing +
                  "' has no default and no value can be made up for it - give --config FILE, with "
                  "a section {type: " +
                  info_.name + ", ...}";
  }
  for (const Node& section : sections) {
    // The constructor may do anything.
    const CheckResult tried = run_apart("", options.time_limit_s, [&](Findings& findings) {
      const std::string refusal = try_section(section);
      if (!refusal.empty()) findings.fail(refusal);
    });
    if (tried.passed()) {
      section_ = section;
      no_section_.clear();
      return;
    }
    if (no_section_.empty()) {
      no_section_ = "no object could be made with made-up values for what has no default (" +
                    tried.failures.front() +
                    ") - give --config FILE, with a section {type: " + info_.name + ", ...}";
    }
  }
}

template <>
Loaded<KinematicModel> Subject::make(const Node& section, std::uint64_t seed) const {
  config::Errors errors;
  auto loaded = registry_->make_kinematics(section, "kinematics", seed, errors);
  errors.throw_if_any();
  return loaded;
}

template <>
Loaded<Sensor> Subject::make(const Node& section, std::uint64_t seed) const {
  constexpr std::string_view kHostKeys[] = {"input"};
  config::Errors errors;
  auto loaded = registry_->make_sensor(section, "sensor", seed, errors, kHostKeys);
  errors.throw_if_any();
  const Node* input = section.find("input");
  if (!guarded(loaded.info, "takes_input", [&] { return loaded.object->takes_input(); })) {
    if (input != nullptr) config::fail(input->mark(), "'" + loaded.info.name + "' takes no input");
    return loaded;
  }
  if (input == nullptr || !input->is_map()) {
    throw InputError("'" + loaded.info.name +
                     "' works on what another sensor gives - give --config FILE, with 'input: "
                     "{type: ...}', the section of that sensor, beside its own parameters");
  }
  const auto source = make<Sensor>(*input, seed).object;
  guarded(loaded.info, "connect", [&] { loaded.object->connect(*source); });
  // Both live as long as what is returned.
  struct Pair {
    std::shared_ptr<Sensor> source, sensor;
  };
  const auto pair = std::make_shared<Pair>(Pair{source, loaded.object});
  loaded.object = std::shared_ptr<Sensor>(pair, pair->sensor.get());
  return loaded;
}

template <>
Loaded<Update> Subject::make(const Node& section, std::uint64_t seed) const {
  config::Errors errors;
  auto loaded = registry_->make_update(section, "update", seed, errors);
  errors.throw_if_any();
  return loaded;
}

Loaded<Update> Subject::make_exact_update() const {
  config::Errors errors;
  auto loaded = registry_->make_update(section_, "update", 1, errors, {}, true);
  errors.throw_if_any();
  return loaded;
}

std::string Subject::try_section(const Node& section) const {
  try {
    if (info_.kind == "kinematics") make<KinematicModel>(section);
    if (info_.kind == "sensor") make<Sensor>(section);
    if (info_.kind == "update") make<Update>(section);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

}  // namespace viwo::conformance

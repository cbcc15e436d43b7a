#include "viwo/setup/configuration.hpp"

#include <algorithm>
#include <set>

#include "viwo/config/file_kind.hpp"
#include "viwo/config/overrides.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/config/yaml.hpp"

namespace viwo {
namespace {

using config::Node;

const std::string& scalar(const Node& node, const std::string& what) {
  if (!node.is_scalar()) config::fail(node.mark(), what + " must be a single value");
  return node.scalar();
}

Recording read_recording(const Node& item) {
  Recording recording;
  recording.mark = item.mark();
  if (item.is_scalar()) {
    recording.name = item.scalar();
    recording.labels["recording"] = item.scalar();
    return recording;
  }
  if (!item.is_map()) {
    config::fail(item.mark(),
                 "a recording is a name or a section of labels, such as "
                 "{recording: 1, motion: forward}");
  }
  for (const auto& entry : item.entries()) {
    recording.labels[entry.key] = scalar(entry.value, "label '" + entry.key + "'");
  }
  for (const char* key : {"name", "recording", "motion"}) {
    const auto found = recording.labels.find(key);
    if (found == recording.labels.end()) continue;
    recording.name = found->second;
    return recording;
  }
  config::fail(item.mark(),
               "this recording has none of 'name', 'recording' and 'motion' to be "
               "called by");
}

/// A placeholder's value: where it is given.
struct Definition {
  std::string name;
  config::Mark mark;
};

/// Adds those in the section `placeholders` of a run.
void find_definitions(const Node& run, std::vector<Definition>& defined) {
  const Node* section = run.find("placeholders");
  if (section == nullptr) return;
  for (const auto& entry : section->entries()) defined.push_back({entry.key, entry.key_mark});
}

/// Adds the labels of the recordings that replace placeholders or, by their spelling, were to.
void find_labels(const Node& configuration, const std::set<std::string>& used,
                 std::vector<Definition>& defined) {
  const std::vector<std::string> names(used.begin(), used.end());
  std::set<std::string> grouped{"name"};
  for (const char* key : {"report_by", "leave_out_by"}) {
    const Node* labels = configuration.find(key);
    if (labels == nullptr) continue;
    if (labels->is_scalar()) grouped.insert(labels->scalar());
    for (const Node& label : labels->items()) {
      if (label.is_scalar()) grouped.insert(label.scalar());
    }
  }
  for (const char* axis : {"recordings", "motions"}) {
    const Node* list = configuration.find(axis);
    if (list == nullptr) continue;
    for (const Node& item : list->items()) {
      if (item.is_scalar()) {
        defined.push_back({axis == std::string("motions") ? "motion" : "recording", item.mark()});
        break;  // all of them are the same placeholder
      }
      for (const auto& label : item.entries()) {
        // Others are there to group by, or to know what is what.
        const bool misspelt =
            !grouped.contains(label.key) && !config::nearest(label.key, names).empty();
        if (used.contains(label.key) || misspelt) defined.push_back({label.key, label.key_mark});
      }
    }
  }
}

/// InputError for placeholders that are given a value and are used nowhere. Nothing where some are
/// used that have none: that is an error of its own, likely of the same spelling.
void refuse_unused(const std::vector<Definition>& defined, const Node& run,
                   const std::set<std::string>& used) {
  std::set<std::string> missing;
  config::find_placeholders(run, missing);
  for (const Definition& definition : defined) missing.erase(definition.name);
  if (!missing.empty()) return;
  const std::vector<std::string> names(used.begin(), used.end());
  config::Errors errors;
  for (const Definition& definition : defined) {
    if (used.contains(definition.name)) continue;
    errors.add(definition.mark, "placeholder '" + definition.name + "' is used nowhere" +
                                    config::did_you_mean(definition.name, names));
  }
  errors.throw_if_any();
}

/// InputError for a placeholder on the command line of which each recording has a value of its own.
void refuse_overruled(const std::vector<std::string>& assignments, const Node& configuration) {
  const std::vector<Recording> recordings = read_recordings(configuration);
  for (const std::string& text : assignments) {
    const config::Assignment assignment = config::parse_assignment(text);
    constexpr std::string_view kSection = "placeholders.";
    if (!assignment.path.starts_with(kSection)) continue;
    const std::string name = assignment.path.substr(kSection.size());
    const bool is_overruled = std::all_of(recordings.begin(), recordings.end(),
                                          [&](const auto& r) { return r.labels.contains(name); });
    if (!is_overruled) continue;
    config::fail(assignment.value.mark(), "each recording of " + configuration.mark().file +
                                              " has its own '" + name + "': change the list there");
  }
}

Node load_run(const std::filesystem::path& file) {
  Node run = config::load_file(file);
  if (!run.is_map()) config::fail(run.mark(), "a run configuration is a section of keys");
  config::require_file_of("run", run);
  return run;
}

}  // namespace

Node load_run_configuration(const std::filesystem::path& file,
                            const std::vector<std::string>& assignments) {
  Node run = load_run(file);
  std::set<std::string> used;
  config::find_placeholders(run, used);  // also what assignments then write over
  config::apply(run, assignments);
  config::find_placeholders(run, used);
  std::vector<Definition> defined;
  find_definitions(run, defined);
  refuse_unused(defined, run, used);
  return run;
}

Node resolve_placeholders(const Node& run, const std::map<std::string, std::string>& labels) {
  std::map<std::string, std::string> values;
  if (const Node* defaults = run.find("placeholders")) {
    if (!defaults->is_map() && !defaults->is_null()) {
      config::fail(defaults->mark(), "'placeholders' is a section of names and their values");
    }
    for (const auto& entry : defaults->entries()) {
      values[entry.key] = scalar(entry.value, "placeholder '" + entry.key + "'");
    }
  }
  for (const auto& [name, value] : labels) values[name] = value;
  Node resolved = run;
  auto& entries = resolved.entries();
  std::erase_if(entries, [](const Node::Entry& entry) { return entry.key == "placeholders"; });
  config::Errors errors;
  config::substitute(resolved, values, errors);
  errors.throw_if_any();
  return resolved;
}

std::vector<Recording> read_recordings(const Node& section) {
  const Node* recordings = section.find("recordings");
  const Node* motions = section.find("motions");
  if (recordings != nullptr && motions != nullptr) {
    config::fail(motions->mark(), "give either 'recordings' or 'motions', not both");
  }
  const Node* list = recordings != nullptr ? recordings : motions;
  if (list == nullptr) return {Recording{"", {}, section.mark()}};
  if (!list->is_list() || list->items().empty()) {
    config::fail(list->mark(), "this must be a list with at least one element");
  }
  std::vector<Recording> result;
  std::set<std::string> names;
  for (const Node& item : list->items()) {
    Recording recording = read_recording(item);
    if (list == motions && item.is_scalar()) recording.labels = {{"motion", recording.name}};
    require_file_name(recording.name, item.mark());
    if (!names.insert(recording.name).second) {
      config::fail(item.mark(), "'" + recording.name + "' is in this list twice");
    }
    result.push_back(std::move(recording));
  }
  return result;
}

void require_labels(const std::vector<std::string>& labels,
                    const std::vector<Recording>& recordings, const Node& configuration,
                    const char* key) {
  std::set<std::string> known;
  for (const Recording& recording : recordings) {
    for (const auto& [label, value] : recording.labels) known.insert(label);
  }
  const std::vector<std::string> candidates(known.begin(), known.end());
  for (const std::string& label : labels) {
    if (known.contains(label)) continue;
    const Node* where = configuration.find(key);
    config::fail(where != nullptr ? where->mark() : configuration.mark(),
                 std::string(key) + ": no recording has the label '" + label + "'" +
                     config::did_you_mean(label, candidates));
  }
}

void require_file_name(const std::string& name, const config::Mark& mark) {
  constexpr std::string_view kAllowed =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+.";
  if (!name.empty() && name.front() != '.' &&
      name.find_first_not_of(kAllowed) == std::string::npos) {
    return;
  }
  config::fail(mark, "'" + name +
                         "' must be usable as a file name: letters, digits, '_', '-', '+' "
                         "and '.'");
}

Node load_base(const Node& configuration, const std::vector<std::string>& assignments) {
  const Node* base = configuration.find("base");
  if (base == nullptr) config::fail(configuration.mark(), "required key 'base' is missing");
  const std::filesystem::path file =
      std::filesystem::path(base->mark().file).parent_path() / scalar(*base, "'base'");
  config::require_file_of_key("base", *base, file);
  Node run = load_run(file.lexically_normal());
  refuse_overruled(assignments, configuration);
  std::set<std::string> used;
  config::find_placeholders(run, used);
  if (const Node* overrides = configuration.find("set")) config::merge(run, *overrides);
  config::apply(run, assignments);
  config::find_placeholders(run, used);
  config::find_placeholders(configuration, used);  // of all variants
  std::vector<Definition> defined;
  find_definitions(run, defined);
  if (const Node* variants = configuration.find("variants")) {
    for (const auto& variant : variants->entries()) {
      Node overrides = Node::empty_map();
      if (variant.value.is_map()) config::merge(overrides, variant.value);
      find_definitions(overrides, defined);
    }
  }
  find_labels(configuration, used, defined);
  refuse_unused(defined, run, used);
  return run;
}

}  // namespace viwo

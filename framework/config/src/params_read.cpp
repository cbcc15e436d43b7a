#include <algorithm>
#include <filesystem>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "parse_text.hpp"
#include "path.hpp"
#include "scalars.hpp"
#include "units.hpp"
#include "viwo/api/status.hpp"
#include "viwo/config/params.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/math/number_text.hpp"

namespace viwo::config {
namespace {

bool is_allowed(const std::string& text, const std::vector<std::string>& choices) {
  return choices.empty() || std::find(choices.begin(), choices.end(), text) != choices.end();
}

const char* type_text(ParamType type) {
  switch (type) {
    case ParamType::kBool:
      return "true or false";
    case ParamType::kInt:
      return "an integer";
    case ParamType::kNumber:
      return "a number";
    case ParamType::kString:
      return "text";
    case ParamType::kPath:
      return "a file or folder";
    case ParamType::kNumbers:
      return "a list of numbers";
    case ParamType::kStrings:
      return "a list of texts";
    case ParamType::kKinematics:
      break;
  }
  return "a section with a kinematic model";
}

/// Relative paths are relative to the folder of the file that `mark` is in.
std::string resolve_path(const std::string& text, const Mark& mark) {
  namespace fs = std::filesystem;
  const fs::path folder = mark.line > 0 ? fs::path(mark.file).parent_path() : fs::path();
  const fs::path path = fs::absolute(folder / text).lexically_normal();
  // "logs/" and "logs" are one folder.
  return (path.has_filename() ? path : path.parent_path()).string();
}

/// Reads the value of one row of the table.
class ValueReader {
 public:
  ValueReader(const ParamSpec& spec, std::string path, const ReadContext& context, Errors& errors)
      : spec_(spec), path_(std::move(path)), context_(context), errors_(errors) {}

  std::optional<ParamValue> read(const Node& node) {
    switch (spec_.type) {
      case ParamType::kBool:
        if (expect_scalar(node)) return accept(node, path_, parse_bool(node.scalar()));
        return std::nullopt;
      case ParamType::kInt:
        if (expect_scalar(node))
          return read_bounded(node, path_, parse_integer(node.scalar(), spec_));
        return std::nullopt;
      case ParamType::kNumber:
        if (expect_scalar(node))
          return read_bounded(node, path_, parse_number(node.scalar(), spec_));
        return std::nullopt;
      case ParamType::kString:
        if (expect_scalar(node)) return read_choice(node, path_);
        return std::nullopt;
      case ParamType::kPath:
        return read_path(node);
      case ParamType::kNumbers:
        return read_numbers(node);
      case ParamType::kStrings:
        return read_list<std::string>(node, [this](const Node& item, const std::string& path) {
          return read_choice(item, path);
        });
      case ParamType::kKinematics:
        return read_kinematics(node);
    }
    throw std::logic_error(path_ + ": unknown type of parameter");
  }

 private:
  void error(const Node& node, const std::string& path, const std::string& text) {
    errors_.add(node.mark(), path + ": " + text);
  }

  void wrong_kind(const Node& node) {
    error(node, path_,
          "expected " +
              (spec_.size > 0 ? std::to_string(spec_.size) + " numbers" : type_text(spec_.type)) +
              ", got " + std::string(node.kind_text()) + meaning_text(spec_));
  }

  bool expect_scalar(const Node& node) {
    if (!node.is_scalar()) wrong_kind(node);
    return node.is_scalar();
  }

  template <class T>
  std::optional<T> accept(const Node& node, const std::string& path, Parsed<T> parsed) {
    if (const T* value = std::get_if<T>(&parsed)) return *value;
    error(node, path, std::get<std::string>(parsed));
    return std::nullopt;
  }

  template <class T>
  std::optional<T> read_bounded(const Node& node, const std::string& path, Parsed<T> parsed) {
    const std::optional<T> value = accept(node, path, std::move(parsed));
    if (!value || within_bounds(static_cast<double>(*value), spec_)) return value;
    error(node, path, node.scalar() + " violates " + bounds_text(spec_) + meaning_text(spec_));
    return std::nullopt;
  }

  std::optional<std::string> read_choice(const Node& node, const std::string& path) {
    const std::vector<std::string> choices = choices_of(spec_);
    const std::string& text = node.scalar();
    if (is_allowed(text, choices)) return text;
    error(node, path, "unknown value '" + text + "'" + did_you_mean(text, choices));
    return std::nullopt;
  }

  /// An empty path means "none", where that is the default.
  std::optional<ParamValue> read_path(const Node& node) {
    if (!expect_scalar(node)) return std::nullopt;
    if (!node.scalar().empty()) return resolve_path(node.scalar(), node.mark());
    if (!spec_.required && std::get<std::string>(spec_.fallback).empty()) return std::string();
    error(node, path_, "is empty" + meaning_text(spec_));
    return std::nullopt;
  }

  std::optional<ParamValue> read_numbers(const Node& node) {
    auto values = read_list<double>(node, [this](const Node& item, const std::string& path) {
      return read_bounded(item, path, parse_number(item.scalar(), spec_));
    });
    const auto n = values ? std::get<std::vector<double>>(*values).size() : 0;
    if (!values || spec_.size == 0 || n == static_cast<std::size_t>(spec_.size)) return values;
    error(node, path_,
          "needs " + std::to_string(spec_.size) + " numbers, not " + std::to_string(n) +
              meaning_text(spec_));
    return std::nullopt;
  }

  template <class T, class ReadItem>
  std::optional<ParamValue> read_list(const Node& node, const ReadItem& read_item) {
    std::vector<T> values;
    if (node.is_scalar()) {
      const auto value = read_item(node, path_);
      if (!value) return std::nullopt;
      return std::vector<T>{*value};
    }
    if (!node.is_list()) {
      wrong_kind(node);
      return std::nullopt;
    }
    bool complete = true;
    for (std::size_t i = 0; i < node.items().size(); ++i) {
      const Node& item = node.items()[i];
      const std::string path = path_ + "[" + std::to_string(i) + "]";
      if (!item.is_scalar()) {
        error(item, path, "expected a single value, got " + std::string(item.kind_text()));
        complete = false;
      } else if (const auto value = read_item(item, path)) {
        values.push_back(*value);
      } else {
        complete = false;
      }
    }
    if (!complete) return std::nullopt;
    return values;
  }

  std::optional<ParamValue> read_kinematics(const Node& node) {
    if (!node.is_map()) {
      wrong_kind(node);
      return std::nullopt;
    }
    if (!context_.make_kinematics) {
      throw std::logic_error(path_ + ": no way to build a kinematic model here");
    }
    const KinematicModel* model = context_.make_kinematics(node, path_, errors_);
    if (model == nullptr) return std::nullopt;
    return model;
  }

  const ParamSpec& spec_;
  std::string path_;
  const ReadContext& context_;
  Errors& errors_;
};

/// If `key` is a parameter written with another unit, or without: the advice; else "".
std::string unit_advice(const std::string& key, std::span<const ParamSpec> specs) {
  const KeyUnit given = split_unit(key);
  for (const ParamSpec& spec : specs) {
    const KeyUnit known = split_unit(spec.name);
    if (known.suffix.empty() || known.base != given.base) continue;
    const std::string unit = !spec.unit.empty() ? spec.unit : unit_text(known.suffix);
    return " - " + std::string(known.base) + " is in " + unit + ", did you mean '" + spec.name +
           "'?";
  }
  return "";
}

void check_keys(const Node& map, std::string_view what, std::span<const ParamSpec> specs,
                std::span<const std::string_view> other_keys, Errors& errors) {
  std::vector<std::string> known;
  for (const ParamSpec& spec : specs) known.emplace_back(spec.name);
  known.insert(known.end(), other_keys.begin(), other_keys.end());
  const std::string prefix = what.empty() ? "" : std::string(what) + ": ";
  for (const Node::Entry& entry : map.entries()) {
    if (std::find(known.begin(), known.end(), entry.key) != known.end()) continue;
    std::string advice = unit_advice(entry.key, specs);
    if (advice.empty()) advice = did_you_mean(entry.key, known);
    errors.add(entry.key_mark, prefix + "unknown key '" + entry.key + "'" + advice);
  }
}

/// The default section of a nested model. Throws std::logic_error if it is not YAML.
Node fallback_section(const ParamSpec& spec) {
  try {
    return parse_text(spec.fallback_section, "default of '" + spec.name + "'", false);
  } catch (const InputError& error) {
    throw std::logic_error(error.what());
  }
}

/// The copy constructor of libstdc++'s std::variant (12) crashes when memory runs out in it: of
/// texts and lists it destroys what it has not made.
ParamValue copy_of(const ParamValue& value) {
  return std::visit(
      [](const auto& held) {
        auto copy = held;  // what can fail
        return ParamValue(std::move(copy));
      },
      value);
}

/// What a configuration that is silent means. Only a nested model may fail: its plugin is not
/// installed.
std::optional<ParamValue> read_fallback(const ParamSpec& spec, const std::string& path,
                                        const Mark& where, const ReadContext& context,
                                        Errors& errors) {
  if (spec.type == ParamType::kKinematics) {
    return ValueReader(spec, path, context, errors).read(fallback_section(spec));
  }
  if (spec.type != ParamType::kPath || std::get<std::string>(spec.fallback).empty()) {
    return copy_of(spec.fallback);
  }
  return resolve_path(std::get<std::string>(spec.fallback), where);
}

/// Throws std::logic_error when a table refuses its own default.
void check_fallback(const ParamSpec& spec) {
  const auto refuse = [&](const std::string& text) {
    throw std::logic_error("default of '" + spec.name + "': " + text);
  };
  const auto check_number = [&](double value) {
    if (!within_bounds(value, spec)) refuse(number_text(value) + " violates " + bounds_text(spec));
  };
  const auto check_choice = [&](const std::string& text) {
    if (!is_allowed(text, choices_of(spec))) refuse("'" + text + "' is none of " + spec.choices);
  };
  switch (spec.type) {
    case ParamType::kInt:
      return check_number(static_cast<double>(std::get<std::int64_t>(spec.fallback)));
    case ParamType::kNumber:
      return check_number(std::get<double>(spec.fallback));
    case ParamType::kNumbers:
      for (const double value : std::get<std::vector<double>>(spec.fallback)) check_number(value);
      return;
    case ParamType::kString:
      return check_choice(std::get<std::string>(spec.fallback));
    case ParamType::kStrings:
      for (const auto& t : std::get<std::vector<std::string>>(spec.fallback)) check_choice(t);
      return;
    case ParamType::kKinematics:
      if (!fallback_section(spec).is_map()) refuse("not a section");
      return;
    case ParamType::kBool:
    case ParamType::kPath:
      return;
  }
}

}  // namespace

std::vector<std::string> choices_of(const ParamSpec& spec) {
  std::vector<std::string> choices;
  for (std::string_view text = spec.choices; !text.empty();) {
    const std::size_t end = std::min(text.find('|'), text.size());
    choices.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return choices;
}

ParamSet read_params(const Node& map, const Mark& where, std::string_view what,
                     std::span<const ParamSpec> specs, std::span<const std::string_view> other_keys,
                     const ReadContext& context, Errors& errors) {
  ParamSet params;
  const std::string_view section = what.substr(0, what.find(" ("));
  if (!map.is_map() && !map.is_null()) {
    errors.add(map.mark(), std::string(what) +
                               ": expected a section (lines of 'key: value'), got " +
                               std::string(map.kind_text()));
    return params;
  }
  check_keys(map, what, specs, other_keys, errors);
  for (const ParamSpec& spec : specs) {
    const std::string path = join(section, spec.name);
    if (const Node* node = map.find(spec.name)) {
      auto value = ValueReader(spec, path, context, errors).read(*node);
      if (value) params.insert_or_assign(spec.name, *std::move(value));
    } else if (!spec.required) {
      auto value = read_fallback(spec, path, where, context, errors);
      if (value) params.insert_or_assign(spec.name, *std::move(value));
    } else {
      errors.add(where, (what.empty() ? "" : std::string(what) + ": ") + "'" + spec.name +
                            "' is missing" + meaning_text(spec));
    }
  }
  return params;
}

void check_specs(std::span<const ParamSpec> specs) {
  std::set<std::string_view> names;
  for (const ParamSpec& spec : specs) {
    if (spec.name.empty()) throw std::logic_error("a parameter without a name");
    if (!names.insert(spec.name).second) {
      throw std::logic_error("parameter '" + spec.name + "' is in the table twice");
    }
    if (!spec.required) check_fallback(spec);
  }
}

}  // namespace viwo::config

#include "viwo/config/overrides.hpp"

#include <cctype>
#include <utility>
#include <vector>

#include "parse_text.hpp"
#include "path.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/config/yaml.hpp"

namespace viwo::config {
namespace {

std::string in_quotes(std::string_view text) {
  std::string quoted{'\''};
  quoted += text;
  quoted += '\'';
  return quoted;
}

/// The node at `path`, created as null if missing.
Node& make_path(Node& root, std::string_view path, const Mark& key_mark) {
  Node* node = &root;
  std::string_view rest = path;
  std::string done;
  do {
    const std::string component{take_component(rest)};
    if (component.empty() || path.ends_with('.')) {
      fail(key_mark, in_quotes(path) + " is not a path (as in kinematics.type)");
    }
    if (node->is_scalar()) {
      fail(key_mark, in_quotes(done) + " is a single value: cannot set " + in_quotes(path));
    }
    if (node->is_list()) {
      const auto index = list_index(component);
      if (!index || *index >= node->items().size()) {
        fail(key_mark, in_quotes(done) + " is a list of " + std::to_string(node->items().size()) +
                           " (counted from 0), it has no element " + in_quotes(component));
      }
      node = &node->items()[*index];
    } else if (Node* child = node->find(component)) {
      node = child;
    } else {
      node = &node->set(component, Node::null(key_mark), key_mark);
    }
    if (!done.empty()) done += '.';
    done += component;
  } while (!rest.empty());
  return *node;
}

/// Gives the entry that holds the last component of `path` the position of the override.
void mark_key(Node& root, std::string_view path, const Mark& key_mark) {
  const std::size_t dot = path.rfind('.');
  const bool nested = dot != std::string_view::npos;
  Node* found = root.at_path(nested ? path.substr(0, dot) : std::string_view{});
  if (found == nullptr) return;
  for (Node::Entry& entry : found->entries()) {
    if (entry.key == path.substr(nested ? dot + 1 : 0)) entry.key_mark = key_mark;
  }
}

bool is_identifier(std::string_view text) {
  if (text.empty() || std::isdigit(static_cast<unsigned char>(text.front())) != 0) return false;
  for (const char c : text) {
    if (c != '_' && std::isalnum(static_cast<unsigned char>(c)) == 0) return false;
  }
  return true;
}

/// `text` with every {name} replaced by what `value_of` gives for its name.
template <class ValueOf>
std::string replaced(const std::string& text, const ValueOf& value_of) {
  std::string out;
  std::size_t from = 0;
  while (from < text.size()) {
    const std::size_t open = text.find('{', from);
    const std::size_t close = open == std::string::npos ? open : text.find('}', open);
    if (close == std::string::npos) break;
    const std::string name = text.substr(open + 1, close - open - 1);
    if (!is_identifier(name)) {
      out += text.substr(from, open + 1 - from);
      from = open + 1;
      continue;
    }
    out += text.substr(from, open - from) + value_of(name);
    from = close + 1;
  }
  return out + text.substr(from);
}

/// `made`: characters that placeholders have become.
std::string substituted(const Node& scalar, const std::map<std::string, std::string>& values,
                        std::size_t& made, Errors& errors) {
  const std::string& text = scalar.scalar();
  return replaced(text, [&](const std::string& name) {
    const auto value = values.find(name);
    if (value != values.end()) {
      made += value->second.size();
      if (made > kMaxYamlBytes) {
        fail(scalar.mark(), "placeholders become more than " + std::to_string(kMaxYamlBytes >> 20) +
                                " MiB of text, as in no configuration that viwo reads");
      }
      return value->second;
    }
    std::vector<std::string> known;
    for (const auto& entry : values) known.push_back(entry.first);
    errors.add(scalar.mark(), "unknown placeholder '{" + name + "}' in '" + text + "'" +
                                  did_you_mean(name, known));
    return std::string();
  });
}

}  // namespace

void set_path(Node& root, std::string_view path, const Node& value, const Mark& key_mark) {
  make_path(root, path, key_mark) = value;
  mark_key(root, path, key_mark);
}

void set_path(Node& root, std::string_view path, const Node& value) {
  set_path(root, path, value, value.mark());
}

void merge(Node& base, const Node& overrides) {
  if (overrides.is_null()) return;
  if (!overrides.is_map()) {
    fail(overrides.mark(),
         "expected a section of overrides, got " + std::string(overrides.kind_text()));
  }
  for (const Node::Entry& entry : overrides.entries()) {
    Node& slot = make_path(base, entry.key, entry.key_mark);
    if (!entry.value.is_map()) {
      slot = entry.value;
    } else {
      // A section that names its type is complete: parameters of another type do not fit it.
      if (!slot.is_map() || entry.value.find("type") != nullptr) {
        slot = Node::empty_map(entry.value.mark());
      }
      merge(slot, entry.value);
    }
    mark_key(base, entry.key, entry.key_mark);
  }
}

Assignment parse_assignment(std::string_view text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string_view::npos || equals == 0) {
    fail(Mark{"--set " + std::string(text)}, "expected path.to.key=value");
  }
  std::string path{text.substr(0, equals)};
  // Every value keeps it as its position.
  constexpr std::size_t kMaxPath = 1000;
  if (path.size() > kMaxPath)
    fail(Mark{"--set"}, "a path of " + std::to_string(path.size()) + " characters");
  Node value = parse_text(text.substr(equals + 1), "--set " + path, false);
  return {std::move(path), std::move(value)};
}

void apply(Node& root, std::span<const std::string> assignments) {
  for (const std::string& text : assignments) {
    const Assignment assignment = parse_assignment(text);
    set_path(root, assignment.path, assignment.value);
  }
}

void find_placeholders(const Node& node, std::set<std::string>& names) {
  if (node.is_scalar()) {
    replaced(node.scalar(), [&](const std::string& name) { return *names.insert(name).first; });
  }
  for (const Node& item : node.items()) find_placeholders(item, names);
  for (const Node::Entry& entry : node.entries()) find_placeholders(entry.value, names);
}

void substitute(Node& node, const std::map<std::string, std::string>& values, Errors& errors) {
  std::size_t made = 0;
  const auto visit = [&](const auto& self, Node& part) -> void {
    if (part.is_scalar()) {
      part = Node::scalar_of(substituted(part, values, made, errors), part.mark(), part.quoted());
    }
    for (Node& item : part.items()) self(self, item);
    for (Node::Entry& entry : part.entries()) self(self, entry.value);
  };
  visit(visit, node);
}

}  // namespace viwo::config

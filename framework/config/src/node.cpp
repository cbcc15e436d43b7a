#include "viwo/config/node.hpp"

#include <stdexcept>
#include <utility>

#include "path.hpp"

namespace viwo::config {

Node::Node() = default;
Node::~Node() = default;
Node::Node(const Node&) = default;
Node::Node(Node&&) noexcept = default;
Node& Node::operator=(const Node&) = default;
Node& Node::operator=(Node&&) noexcept = default;

Node Node::null(Mark mark) {
  Node node;
  node.mark_ = std::move(mark);
  return node;
}

Node Node::scalar_of(std::string text, Mark mark, bool quoted) {
  Node node = null(std::move(mark));
  node.kind_ = Kind::kScalar;
  node.scalar_ = std::move(text);
  node.quoted_ = quoted;
  return node;
}

Node Node::list_of(std::vector<Node> items, Mark mark) {
  Node node = null(std::move(mark));
  node.kind_ = Kind::kList;
  node.items_ = std::move(items);
  return node;
}

Node Node::empty_map(Mark mark) {
  Node node = null(std::move(mark));
  node.kind_ = Kind::kMap;
  return node;
}

std::string_view Node::kind_text() const {
  switch (kind_) {
    case Kind::kScalar:
      return "a single value";
    case Kind::kList:
      return "a list";
    case Kind::kMap:
      return "a section";
    case Kind::kNull:
      break;
  }
  return "nothing";
}

const std::string& Node::scalar() const {
  if (kind_ != Kind::kScalar) {
    throw std::logic_error("scalar() of " + std::string(kind_text()) + " at " + mark_.text());
  }
  return scalar_;
}

const Node::Entry* Node::find_entry(std::string_view key) const {
  for (const Entry& entry : entries_) {
    if (entry.key == key) return &entry;
  }
  return nullptr;
}

const Node* Node::find(std::string_view key) const {
  const Entry* entry = find_entry(key);
  return entry != nullptr ? &entry->value : nullptr;
}

Node* Node::find(std::string_view key) { return const_cast<Node*>(std::as_const(*this).find(key)); }

const Node* Node::at_path(std::string_view path) const {
  const Node* node = this;
  while (!path.empty() && node != nullptr) {
    const std::string_view component = take_component(path);
    if (node->is_list()) {
      const auto index = list_index(component);
      node = index && *index < node->items_.size() ? &node->items_[*index] : nullptr;
    } else {
      node = node->find(component);
    }
  }
  return node;
}

Node* Node::at_path(std::string_view path) {
  return const_cast<Node*>(std::as_const(*this).at_path(path));
}

Node& Node::set(std::string key, Node value, Mark key_mark) {
  if (kind_ == Kind::kNull) kind_ = Kind::kMap;
  if (kind_ != Kind::kMap) {
    throw std::logic_error("set('" + key + "') on " + std::string(kind_text()));
  }
  for (Entry& entry : entries_) {
    if (entry.key != key) continue;
    entry.key_mark = std::move(key_mark);
    entry.value = std::move(value);
    return entry.value;
  }
  return entries_.emplace_back(Entry{std::move(key), std::move(key_mark), std::move(value)}).value;
}

bool operator==(const Node& a, const Node& b) {
  if (a.kind() != b.kind()) return false;
  if (a.is_scalar()) return a.scalar() == b.scalar();
  if (a.items() != b.items() || a.entries().size() != b.entries().size()) return false;
  for (std::size_t i = 0; i < a.entries().size(); ++i) {
    const Node::Entry& left = a.entries()[i];
    const Node::Entry& right = b.entries()[i];
    if (left.key != right.key || !(left.value == right.value)) return false;
  }
  return true;
}

}  // namespace viwo::config

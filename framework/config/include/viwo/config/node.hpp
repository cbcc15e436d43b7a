// A configuration as a tree of values that know where they were written.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "viwo/config/errors.hpp"

namespace viwo::config {

/// Null, scalar, list or map; a value type. Map entries keep their order.
class Node {
 public:
  enum class Kind : std::uint8_t { kNull, kScalar, kList, kMap };
  struct Entry;

  Node();  ///< null without a position
  ~Node();
  Node(const Node&);
  Node(Node&&) noexcept;
  Node& operator=(const Node&);
  Node& operator=(Node&&) noexcept;

  static Node null(Mark mark = {});
  /// `quoted`: to be written in quotes, so that text such as "null" stays text.
  static Node scalar_of(std::string text, Mark mark = {}, bool quoted = false);
  static Node list_of(std::vector<Node> items = {}, Mark mark = {});
  static Node empty_map(Mark mark = {});

  Kind kind() const { return kind_; }
  bool is_null() const { return kind_ == Kind::kNull; }
  bool is_scalar() const { return kind_ == Kind::kScalar; }
  bool is_list() const { return kind_ == Kind::kList; }
  bool is_map() const { return kind_ == Kind::kMap; }
  /// "nothing", "a single value", "a list", "a section": for messages.
  std::string_view kind_text() const;

  const Mark& mark() const { return mark_; }
  void set_mark(Mark mark) { mark_ = std::move(mark); }

  /// Text of a scalar. Throws std::logic_error on another kind.
  const std::string& scalar() const;
  bool quoted() const { return quoted_; }

  /// Elements of a list; empty for the other kinds.
  const std::vector<Node>& items() const { return items_; }
  std::vector<Node>& items() { return items_; }

  /// Entries of a map, in order; empty for the other kinds.
  const std::vector<Entry>& entries() const { return entries_; }
  std::vector<Entry>& entries() { return entries_; }

  /// The value at `key` of a map; nullptr if there is none or this is not a map.
  const Node* find(std::string_view key) const;
  Node* find(std::string_view key);
  const Entry* find_entry(std::string_view key) const;

  /// The value at a dotted path, "kinematics.type"; a component into a list is an index. nullptr if
  /// there is none; the empty path is the node itself.
  const Node* at_path(std::string_view path) const;
  Node* at_path(std::string_view path);

  /// Replaces or appends an entry of a map (null becomes a map) and returns its value. Throws
  /// std::logic_error on a scalar or a list.
  Node& set(std::string key, Node value, Mark key_mark = {});

 private:
  Kind kind_ = Kind::kNull;
  bool quoted_ = false;
  Mark mark_;
  std::string scalar_;
  std::vector<Node> items_;
  std::vector<Entry> entries_;
};

struct Node::Entry {
  std::string key;
  Mark key_mark;
  Node value;
};

/// Same kinds, texts and order; positions and quotes do not matter.
bool operator==(const Node& a, const Node& b);

}  // namespace viwo::config

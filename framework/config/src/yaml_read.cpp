#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "parse_text.hpp"
#include "viwo/config/yaml.hpp"

namespace viwo::config {
namespace {

// Aliases make a small text a tree of any size, or of infinite depth when a value contains itself.
constexpr int kMaxDepth = 100;
constexpr int kMaxNodes = 1'000'000;

/// Copies a yaml-cpp tree; aliases become copies.
class Converter {
 public:
  Converter(std::string origin, bool with_positions)
      : origin_(std::move(origin)), with_positions_(with_positions) {}

  Mark mark_of(const YAML::Mark& mark) const {
    if (!with_positions_ || mark.is_null()) return Mark{origin_};
    return Mark{origin_, mark.line + 1, mark.column + 1};
  }

  Node convert(const YAML::Node& yaml, int depth = 0) {
    const Mark mark = mark_of(yaml.Mark());
    if (depth > kMaxDepth) fail(mark, "nested too deeply (does an alias contain itself?)");
    if (++nodes_ > kMaxNodes) fail(mark, "too large (aliases of aliases?)");
    switch (yaml.Type()) {
      case YAML::NodeType::Scalar:
        return Node::scalar_of(yaml.Scalar(), mark, is_quoted(yaml));
      case YAML::NodeType::Sequence: {
        Node list = Node::list_of({}, mark);
        for (const YAML::Node& item : yaml) list.items().push_back(convert(item, depth + 1));
        return list;
      }
      case YAML::NodeType::Map:
        return convert_map(yaml, mark, depth);
      default:
        return Node::null(mark);
    }
  }

 private:
  static bool is_quoted(const YAML::Node& scalar) { return scalar.Tag() == "!"; }

  Node convert_map(const YAML::Node& yaml, const Mark& mark, int depth) {
    Node map = Node::empty_map(mark);
    std::vector<Node> merged;
    for (const auto& pair : yaml) {
      const Mark key_mark = mark_of(pair.first.Mark());
      if (!pair.first.IsScalar()) fail(key_mark, "a key must be text");
      const std::string& key = pair.first.Scalar();
      Node value = convert(pair.second, depth + 1);
      if (key == "<<" && !is_quoted(pair.first)) {
        take_merged(std::move(value), key_mark, merged);
        continue;
      }
      // yaml-cpp places a missing value anywhere; where its key is helps more.
      if (value.is_null()) value.set_mark(key_mark);
      if (const Node::Entry* first = map.find_entry(key)) {
        fail(key_mark, "key '" + key + "' appears twice (first at " + first->key_mark.text() + ")");
      }
      map.set(key, std::move(value), key_mark);
    }
    for (Node& source : merged) {
      for (Node::Entry& entry : source.entries()) {
        if (map.find(entry.key) != nullptr) continue;
        map.set(entry.key, std::move(entry.value), entry.key_mark);
      }
    }
    return map;
  }

  static void take_merged(Node value, const Mark& mark, std::vector<Node>& merged) {
    if (value.is_map()) {
      merged.push_back(std::move(value));
      return;
    }
    if (!value.is_list()) fail(mark, "'<<' needs a section or a list of sections");
    for (Node& item : value.items()) {
      if (!item.is_map()) fail(mark, "'<<' needs a section or a list of sections");
      merged.push_back(std::move(item));
    }
  }

  std::string origin_;
  bool with_positions_;
  int nodes_ = 0;
};

}  // namespace

Node parse_text(std::string_view text, const std::string& origin, bool with_positions) {
  Converter converter(origin, with_positions);
  if (text.find('\0') != std::string_view::npos) fail(Mark{origin}, "is not a text file");
  try {
    const std::vector<YAML::Node> documents = YAML::LoadAll(std::string(text));
    if (documents.empty()) return Node::null(Mark{origin, with_positions ? 1 : 0, 1});
    if (documents.size() > 1) {
      fail(converter.mark_of(documents[1].Mark()), "a second YAML document: only one is allowed");
    }
    return converter.convert(documents.front());
  } catch (const YAML::Exception& error) {
    fail(converter.mark_of(error.mark), "not valid YAML: " + error.msg);
  }
}

Node parse(std::string_view text, const std::string& origin) {
  return parse_text(text, origin, true);
}

Node load_file(const std::filesystem::path& file) {
  const Mark mark{file.string()};
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (status.type() == std::filesystem::file_type::not_found) fail(mark, "no such file");
  if (std::filesystem::is_directory(status)) fail(mark, "is a folder, not a file");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) fail(mark, std::string("cannot be read: ") + std::strerror(errno));
  const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (stream.bad()) fail(mark, "cannot be read");
  return parse(text, file.string());
}

}  // namespace viwo::config

#include <algorithm>
#include <map>
#include <string>

#include <yaml-cpp/yaml.h>

#include "path.hpp"
#include "viwo/config/yaml.hpp"

namespace viwo::config {
namespace {

/// Plain text that a reader would take for something else than this text.
bool needs_quotes(const std::string& text) {
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20; };
  return std::any_of(text.begin(), text.end(), is_control) || text.empty() || text == "<<" ||
         text == "~" || text == "null" || text == "Null" || text == "NULL";
}

void emit_text(YAML::Emitter& out, const std::string& text, bool quoted) {
  if (quoted || needs_quotes(text)) out << YAML::DoubleQuoted;
  out << text;
}

using Comments = std::map<std::string, std::string>;

/// `path`: of the node.
void emit(YAML::Emitter& out, const Node& node, const Comments& comments, const std::string& path) {
  switch (node.kind()) {
    case Node::Kind::kNull:
      out << YAML::Null;
      return;
    case Node::Kind::kScalar:
      emit_text(out, node.scalar(), node.quoted());
      return;
    case Node::Kind::kList: {
      const bool flat = std::all_of(node.items().begin(), node.items().end(), [](const Node& item) {
        return item.is_scalar() || item.is_null();
      });
      out << (flat ? YAML::Flow : YAML::Block) << YAML::BeginSeq;
      for (std::size_t i = 0; i < node.items().size(); ++i) {
        emit(out, node.items()[i], comments, join(path, std::to_string(i)));
      }
      out << YAML::EndSeq;
      return;
    }
    case Node::Kind::kMap:
      out << (node.entries().empty() ? YAML::Flow : YAML::Block) << YAML::BeginMap;
      for (const Node::Entry& entry : node.entries()) {
        out << YAML::Key;
        emit_text(out, entry.key, false);
        out << YAML::Value;
        const std::string place = join(path, entry.key);
        emit(out, entry.value, comments, place);
        if (const auto comment = comments.find(place); comment != comments.end()) {
          out << YAML::Comment(comment->second);
        }
      }
      out << YAML::EndMap;
      return;
  }
}

}  // namespace

std::string to_yaml(const Node& node, const std::map<std::string, std::string>& comments) {
  YAML::Emitter out;
  emit(out, node, comments, "");
  return std::string(out.c_str(), out.size()) + "\n";
}

}  // namespace viwo::config

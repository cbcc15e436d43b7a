#include <algorithm>
#include <map>
#include <optional>
#include <sstream>
#include <system_error>
#include <utility>
#include <vector>

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include "parse_text.hpp"
#include "viwo/config/regular_file.hpp"
#include "viwo/config/yaml.hpp"

namespace viwo::config {
namespace {

// Aliases make a small text a tree of any size, and everything that is done with a tree goes down
// into it. No configuration comes near any of these.
constexpr int kMaxDepth = 100;
constexpr std::size_t kMaxValues = 100'000;
constexpr std::size_t kMaxCharacters = 4 * kMaxYamlBytes;

constexpr std::string_view kBlanks = " \t\r\n";

/// Behind the tag or the anchor that begins there, which a value in brackets may follow at once.
std::size_t end_of_property(std::string_view text, std::size_t begin) {
  if (text.substr(begin).starts_with("!<")) {
    const std::size_t end = text.find('>', begin);
    return end == std::string_view::npos ? text.size() : end + 1;
  }
  constexpr std::string_view kAnchorEnds = " \t\r\n,[]{}", kTagEnds = " \t\r\n,[]{}\"";
  return text.find_first_of(text[begin] == '!' ? kTagEnds : kAnchorEnds, begin);
}

/// What a value needs, with all that is below it.
struct Extent {
  std::size_t values = 1;
  std::size_t characters = 0;
  int depth = 0;  ///< of what is deepest below it

  void add(const Extent& below) {
    values += below.values;
    characters += below.characters;
    depth = std::max(depth, below.depth + 1);
  }
};

Extent extent_of(const Node& node) {
  Extent extent;
  if (node.is_scalar()) extent.characters = node.scalar().size();
  for (const Node& item : node.items()) extent.add(extent_of(item));
  for (const Node::Entry& entry : node.entries()) {
    extent.add(extent_of(entry.value));
    extent.characters += entry.key.size();
  }
  return extent;
}

/// A section whose end has not been read yet.
class OpenMap {
 public:
  explicit OpenMap(const Mark& mark) : map_(Node::empty_map(mark)) {}

  /// Keys and values in turn.
  void add(Node node) {
    if (!key_) {
      if (!node.is_scalar()) fail(node.mark(), "a key must be text");
      key_ = std::move(node);
      return;
    }
    const Node key = *std::exchange(key_, std::nullopt);
    if (key.scalar() == "<<" && !key.quoted()) return take_merged(std::move(node), key.mark());
    // yaml-cpp places a missing value anywhere; where its key is helps more.
    if (node.is_null()) node.set_mark(key.mark());
    const auto [first, is_new] = written_.emplace(key.scalar(), key.mark());
    if (!is_new) {
      fail(key.mark(),
           "key '" + key.scalar() + "' appears twice (first at " + first->second.text() + ")");
    }
    map_.entries().push_back({key.scalar(), key.mark(), std::move(node)});
  }

  Node close() && {
    for (Node& source : merged_) {
      for (Node::Entry& entry : source.entries()) {
        if (!written_.emplace(entry.key, entry.key_mark).second) continue;
        map_.entries().push_back(std::move(entry));
      }
    }
    return std::move(map_);
  }

 private:
  void take_merged(Node value, const Mark& mark) {
    if (value.is_map()) {
      merged_.push_back(std::move(value));
      return;
    }
    if (!value.is_list()) fail(mark, "'<<' needs a section or a list of sections");
    for (Node& item : value.items()) {
      if (!item.is_map()) fail(mark, "'<<' needs a section or a list of sections");
      merged_.push_back(std::move(item));
    }
  }

  Node map_;
  std::optional<Node> key_;  ///< whose value comes next
  std::map<std::string, Mark> written_;
  std::vector<Node> merged_;
};

/// Makes the tree of one document from the parser's events, and ends with the first that goes too
/// far: what is refused has not been built. Aliases become copies.
class TreeBuilder final : public YAML::EventHandler {
 public:
  TreeBuilder(std::string_view text, std::string origin, bool with_positions)
      : text_(text), origin_(std::move(origin)), with_positions_(with_positions) {}

  Mark mark_of(const YAML::Mark& mark) const {
    if (!with_positions_ || mark.is_null()) return Mark{origin_};
    return Mark{origin_, mark.line + 1, mark.column + 1};
  }

  Node take() && { return root_ ? std::move(*root_) : Node::null(mark_of({})); }

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ == 1) return;
    // What the parser does not know in this place ends a document for it.
    const auto at = std::min(static_cast<std::size_t>(std::max(mark.pos, 0)), text_.size());
    const std::string_view rest = text_.substr(at);
    if (rest.empty() || rest.starts_with("---")) {
      fail(mark_of(mark), "a second YAML document: only one is allowed");
    }
    fail(mark_of(mark), std::string("not valid YAML: '") + rest.front() + "' does not belong here");
  }
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    count(mark, {});
    add(Node::null(mark_of(mark)), anchor, mark);
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    count(mark, {.characters = value.size()});
    if (value.find('\0') != std::string::npos) fail(mark_of(mark), "a text with a zero byte");
    require_readable_quotes(mark);
    add(Node::scalar_of(value, mark_of(mark), tag == "!"), anchor, mark);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto found = anchored_.find(anchor);
    if (found == anchored_.end()) fail(mark_of(mark), "this alias stands within its own value");
    count(mark, extent_of(found->second));
    add(found->second, YAML::NullAnchor, mark);
  }

  void OnSequenceStart(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value /*style*/) override {
    count(mark, {});
    open_.push_back({anchor, mark, Node::list_of({}, mark_of(mark)), std::nullopt});
  }
  void OnMapStart(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value /*style*/) override {
    count(mark, {});
    open_.push_back({anchor, mark, {}, OpenMap(mark_of(mark))});
  }
  void OnSequenceEnd() override { close(); }
  void OnMapEnd() override { close(); }

 private:
  /// The parser takes the end of the text for that of a quoted value, with all that is between, and
  /// half of a character for each of two escapes.
  void require_readable_quotes(const YAML::Mark& mark) {
    auto begin = static_cast<std::size_t>(std::max(mark.pos, 0));
    std::size_t& i = looked_at_;
    if (begin < i) return;  // no byte twice, wherever the parser says that a value is
    while (begin < text_.size() && (text_[begin] == '&' || text_[begin] == '!')) {
      begin = text_.find_first_not_of(kBlanks, end_of_property(text_, begin));
    }
    i = std::min(begin, text_.size());
    if (i == text_.size()) return;
    const char quote = text_[i];
    if (quote != '"' && quote != '\'') return;
    for (++i; i < text_.size(); ++i) {
      if (quote == '"' && text_[i] == '\\') {
        if (const auto escape = text_.substr(i++, 2); escape == "\\N" || escape == "\\_") {
          fail(mark_of(mark),
               std::string(escape) + " within quotes is not read: write the character itself");
        }
      } else if (text_[i] == quote) {
        if (quote == '"' || i + 1 == text_.size() || text_[i + 1] != quote) return;
        ++i;
      }
    }
    fail(mark_of(mark), std::string("not valid YAML: this quote (") + quote + ") is never closed");
  }

  /// A list or a section.
  struct Open {
    YAML::anchor_t anchor;
    YAML::Mark mark;
    Node list;
    std::optional<OpenMap> map;
  };

  /// Refuses what goes beyond the limits.
  void count(const YAML::Mark& mark, const Extent& more) {
    if (static_cast<int>(open_.size()) + more.depth > kMaxDepth) {
      fail(mark_of(mark), "nested deeper than " + std::to_string(kMaxDepth));
    }
    total_.add(more);
    if (total_.values > kMaxValues) {
      fail(mark_of(mark), "more than " + std::to_string(kMaxValues) +
                              " values, with those that aliases stand for");
    }
    if (total_.characters > kMaxCharacters) {
      fail(mark_of(mark), "more than " + std::to_string(kMaxCharacters >> 20) +
                              " MiB of text, with that which aliases stand for");
    }
  }

  void add(Node node, YAML::anchor_t anchor, const YAML::Mark& mark) {
    if (anchor != YAML::NullAnchor) {
      count(mark, extent_of(node));  // it is kept, too
      anchored_.insert_or_assign(anchor, node);
    }
    if (open_.empty()) {
      root_ = std::move(node);
    } else if (open_.back().map) {
      open_.back().map->add(std::move(node));
    } else {
      open_.back().list.items().push_back(std::move(node));
    }
  }

  void close() {
    Open last = std::move(open_.back());
    open_.pop_back();
    add(last.map ? std::move(*last.map).close() : std::move(last.list), last.anchor, last.mark);
  }

  std::string_view text_;
  std::string origin_;
  bool with_positions_;
  std::size_t looked_at_ = 0;  ///< bytes of the text, for quotes
  int documents_ = 0;
  Extent total_{.values = 0};
  std::vector<Open> open_;
  std::map<YAML::anchor_t, Node> anchored_;
  std::optional<Node> root_;
};

bool is_indented_by_tab(std::string_view text, const YAML::Mark& mark) {
  if (mark.is_null()) return false;
  std::istringstream lines{std::string(text)};
  std::string line;
  for (int i = 0; i <= mark.line; ++i) std::getline(lines, line);
  return line.substr(0, line.find_first_not_of(" \t")).find('\t') != std::string::npos;
}

}  // namespace

Node parse_text(std::string_view text, const std::string& origin, bool with_positions) {
  if (text.size() > kMaxYamlBytes) {
    fail(Mark{origin}, "is larger than " + std::to_string(kMaxYamlBytes >> 20) +
                           " MiB, as no YAML that viwo reads is");
  }
  if (text.starts_with("\xfe\xff") || text.starts_with("\xff\xfe")) {
    fail(Mark{origin}, "is UTF-16, what is read is UTF-8");
  }
  if (text.find('\0') != std::string_view::npos) fail(Mark{origin}, "is not a text file");
  // All of them: the parser would leave one out, and its places were others than those of the text.
  while (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  TreeBuilder builder(text, origin, with_positions);
  try {
    std::istringstream stream{std::string(text)};
    YAML::Parser parser(stream);
    while (parser.HandleNextDocument(builder)) {
    }
    return std::move(builder).take();
  } catch (const YAML::Exception& error) {
    const bool by_tab = is_indented_by_tab(text, error.mark);
    fail(builder.mark_of(error.mark),
         "not valid YAML: " + error.msg +
             (by_tab ? " (YAML is indented by spaces, this line by a tab)" : ""));
  }
}

Node parse(std::string_view text, const std::string& origin) {
  return parse_text(text, origin, true);
}

Node load_file(const std::filesystem::path& file) {
  const Mark mark{file.string()};
  std::string text(kMaxYamlBytes + 1, '\0');  // no more of any file
  try {
    text.resize(RegularFile(file).read(text));
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::no_such_file_or_directory) fail(mark, "no such file");
    fail(mark, "cannot be read: " + error.code().message());
  }
  return parse(text, file.string());
}

}  // namespace viwo::config

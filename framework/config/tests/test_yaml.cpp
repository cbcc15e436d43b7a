// YAML text to trees and back, with positions.
#include <ctime>
#include <filesystem>
#include <fstream>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "message_of.hpp"
#include "viwo/config/yaml.hpp"

namespace viwo::config {
namespace {

using testing::error_of;

std::string parse_error(std::string_view text) {
  return error_of([&] { parse(text, "f.yaml"); });
}

TEST(Yaml, KnowsWhereEveryKeyAndValueIsWritten) {
  const Node root = parse("a: 1\nb:\n  c: [x, y]\n  d:\n", "f.yaml");
  EXPECT_EQ(root.find("a")->mark().text(), "f.yaml:1:4");
  EXPECT_EQ(root.find_entry("b")->key_mark.text(), "f.yaml:2:1");
  EXPECT_EQ(root.at_path("b.c.1")->mark().text(), "f.yaml:3:10");
  EXPECT_EQ(root.at_path("b.c.1")->scalar(), "y");
  EXPECT_TRUE(root.at_path("b.d")->is_null());
  EXPECT_EQ(root.at_path("b.d")->mark().text(), "f.yaml:4:3");
  EXPECT_EQ(root.at_path("b.c.2"), nullptr);
  EXPECT_EQ(root.at_path("b.e.f"), nullptr);
  EXPECT_EQ(root.at_path(""), &root);
}

TEST(Yaml, KeepsTheOrderOfKeys) {
  const Node root = parse("z: 1\na: 2\nm: 3\n", "f.yaml");
  ASSERT_EQ(root.entries().size(), 3u);
  EXPECT_EQ(root.entries()[0].key, "z");
  EXPECT_EQ(root.entries()[2].key, "m");
}

TEST(Yaml, TellsQuotedNullFromNull) {
  const Node root = parse("a: null\nb: \"null\"\nc: ''\nd: ~\n", "f.yaml");
  EXPECT_TRUE(root.find("a")->is_null());
  EXPECT_EQ(root.find("b")->scalar(), "null");
  EXPECT_EQ(root.find("c")->scalar(), "");
  EXPECT_TRUE(root.find("d")->is_null());
}

TEST(Yaml, ExpandsAliasesAsCopies) {
  Node root = parse("base: &b {r: 1}\nuse: *b\n", "f.yaml");
  EXPECT_EQ(root.at_path("use.r")->scalar(), "1");
  EXPECT_EQ(root.at_path("use.r")->mark().text(), "f.yaml:1:14");
  root.find("use")->set("r", Node::scalar_of("2"));
  EXPECT_EQ(root.at_path("base.r")->scalar(), "1");
}

TEST(Yaml, MergesBelowExplicitKeysAndInOrder) {
  const Node root =
      parse("a: &a {r: 1, s: 1, t: 1}\nb: &b {s: 2, u: 2}\nc: {<<: [*b, *a], t: 3}\n", "f.yaml");
  const Node& c = *root.find("c");
  EXPECT_EQ(c, parse("t: 3\ns: 2\nu: 2\nr: 1\n", ""));
}

TEST(Yaml, RefusesToMergeWhatIsNotASection) {
  EXPECT_EQ(parse_error("a: &a 1\nb:\n  <<: *a\n"),
            "f.yaml:3:3  '<<' needs a section or a list of sections");
}

TEST(Yaml, RefusesDuplicateKeys) {
  EXPECT_EQ(parse_error("a:\n  x: 1\n  y: 2\n  x: 3\n"),
            "f.yaml:4:3  key 'x' appears twice (first at f.yaml:2:3)");
}

TEST(Yaml, RefusesKeysThatAreNotText) {
  EXPECT_EQ(parse_error("[1, 2]: 3\n"), "f.yaml:1:1  a key must be text");
}

TEST(Yaml, ReportsASyntaxErrorWithItsPosition) {
  EXPECT_EQ(parse_error("a: 1\nb: [1, 2\nc: 3\n").substr(0, 31), "f.yaml:3:2  not valid YAML: end");
  // Newer versions of yaml-cpp add the name.
  EXPECT_THAT(
      parse_error("a: *nowhere\n"),
      ::testing::StartsWith("f.yaml:1:4  not valid YAML: the referenced anchor is not defined"));
}

/// Its end would be the end of the text, and all keys between a part of it.
TEST(Yaml, RefusesAQuoteThatIsNeverClosed) {
  EXPECT_EQ(parse_error("a: 1\nname: \"abc\n# no\nseed: 77\n"),
            "f.yaml:2:7  not valid YAML: this quote (\") is never closed");
  EXPECT_EQ(parse_error("a:\n  - 'it''s\nb: 2\n"),
            "f.yaml:2:5  not valid YAML: this quote (') is never closed");
  EXPECT_EQ(parse_error("a: \"x\\\"\n"),
            "f.yaml:1:4  not valid YAML: this quote (\") is never closed");
  const Node closed =
      parse("\"a\": 'it''s'\nb: \"\\\"\\\\\"\nc: \"two\n  lines\"\nd: 5'\ne: é\nf: 'é'", "f.yaml");
  EXPECT_EQ(closed.find("a")->scalar(), "it's");
  EXPECT_EQ(closed.find("b")->scalar(), "\"\\");
  EXPECT_EQ(closed.find("c")->scalar(), "two lines");
  EXPECT_EQ(closed.find("d")->scalar(), "5'");
  EXPECT_EQ(closed.find("f")->scalar(), "é");
}

TEST(Yaml, FindsTheQuoteBehindATagOrAnAnchor) {
  const std::string why = "  not valid YAML: this quote (\") is never closed";
  for (const std::string before :
       {"!a ", "!", "!a", "!<tag:a,b> ", "!<tag:a,b>", "&a ", "!a &b "}) {
    EXPECT_EQ(parse_error("k: " + before + "\"abc\nb: 1\n"), "f.yaml:1:4" + why) << before;
  }
  const Node list = parse("[!a,!b, &c !d , !<e>,\"f\", \"\"]", "f.yaml");
  ASSERT_EQ(list.items().size(), 6U);
  EXPECT_EQ(list.items()[4].scalar(), "f");
}

/// As many as there may be; each was looked for an end up to that of the text.
TEST(Yaml, ReadsManyTagsAtOnce) {
  std::string text = "[";
  for (int i = 0; i < 99'000; ++i) text += "!a,";
  const std::clock_t begin = std::clock();
  EXPECT_EQ(parse(text + "]", "f.yaml").items().size(), 99'000U);
  EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 15.);
}

TEST(Yaml, TakesEveryMarkOfUtf8OffTheBegin) {
  using namespace std::string_view_literals;
  const std::string mark = "\xef\xbb\xbf";
  // Three bytes before the second value is a quote, which is none.
  EXPECT_EQ(parse(mark + mark + "[a\"z,x]", "f.yaml").items()[1].scalar(), "x");
  for (const std::string_view utf16 : {"\xff\xfe"
                                       "a\0:\0"sv,
                                       "\xfe\xff"
                                       "\0a\0:"sv}) {
    EXPECT_EQ(parse_error(utf16), "f.yaml  is UTF-16, what is read is UTF-8");
  }
}

TEST(Yaml, RefusesASecondDocument) {
  EXPECT_EQ(parse_error("---\na: 1\n---\nb: 2\n"),
            "f.yaml:3:1  a second YAML document: only one is allowed");
  // With the mark that some editors put in front.
  EXPECT_EQ(parse_error("\xef\xbb\xbf"
                        "a: 1\n---\nb: 2\n"),
            "f.yaml:2:1  a second YAML document: only one is allowed");
}

// Of these the parser makes documents without end, or ends one in its middle.
TEST(Yaml, SaysWhatDoesNotBelongWhereItIs) {
  EXPECT_EQ(parse_error(","), "f.yaml:1:1  not valid YAML: ',' does not belong here");
  EXPECT_EQ(parse_error("\xef\xbb\xbf,"), "f.yaml:1:1  not valid YAML: ',' does not belong here");
  EXPECT_EQ(parse_error("# a\n,,,\n"), "f.yaml:2:1  not valid YAML: ',' does not belong here");
  EXPECT_EQ(parse_error("[a]\n[b]\n"), "f.yaml:2:1  not valid YAML: '[' does not belong here");
  EXPECT_EQ(parse_error("\"a\" \"b\"\n"), "f.yaml:1:5  not valid YAML: '\"' does not belong here");
}

std::string numbered(const char* prefix, int i) { return prefix + std::to_string(i); }

std::string repeated(const std::string& text, std::size_t n) {
  std::string all;
  for (std::size_t i = 0; i < n; ++i) all += text;
  return all;
}

constexpr const char* kTooMany = "  more than 100000 values, with those that aliases stand for";

TEST(Yaml, TakesAsManyValuesAsItSays) {
  const std::string row = "- [" + repeated("a,", 998) + "a]\n";  // 1000 values, with its list
  const std::string most = repeated(row, 99) + "- [" + repeated("a,", 997) + "a]\n";
  EXPECT_EQ(parse(most, "f.yaml").items().size(), 100U);
  EXPECT_EQ(parse_error(most + "- a\n"), std::string("f.yaml:101:3") + kTooMany);
  std::string keys;
  for (int i = 0; i < 49'999; ++i) keys += numbered("k", i) + ": 1\n";
  EXPECT_EQ(parse(keys, "f.yaml").entries().size(), 49'999U);
  EXPECT_EQ(parse_error(keys + "more: 1\n"), std::string("f.yaml:50000:7") + kTooMany);
}

TEST(Yaml, RefusesAliasesThatExplode) {
  std::string text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 10; ++i) {
    const std::string last = numbered("*a", i - 1);
    text += numbered("a", i) + ": " + numbered("&a", i) + " [" + last;
    text += repeated(", " + last, 9) + "]\n";
  }
  EXPECT_EQ(parse_error(text), std::string("f.yaml:5:40") + kTooMany);
  // What an anchor keeps counts, too: a hundred of them around the same values.
  std::string nested;
  for (int i = 0; i < 99; ++i) nested += numbered("&a", i) + " [";
  EXPECT_THAT(parse_error(nested + repeated("x,", 2000) + repeated("]", 99)),
              ::testing::EndsWith(kTooMany));
}

TEST(Yaml, RefusesAliasesOfALongText) {
  const std::string long_text(500'000, 'x');
  EXPECT_EQ(parse_error("a: &a " + long_text + "\nb: [" + repeated("*a, ", 10'000) + "]\n"),
            "f.yaml:2:29  more than 4 MiB of text, with that which aliases stand for");
}

TEST(Yaml, RefusesAValueThatContainsItself) {
  EXPECT_EQ(parse_error("a: &a [1, *a]\n"), "f.yaml:1:11  this alias stands within its own value");
  EXPECT_EQ(parse_error("a: &a\n  b:\n    <<: *a\n"),
            "f.yaml:3:9  this alias stands within its own value");
  // The name of an anchor may be given again.
  EXPECT_EQ(parse("- &a 1\n- *a\n- &a 2\n- *a\n", "f.yaml"), parse("[1, 1, 2, 2]", "f.yaml"));
}

TEST(Yaml, RefusesDeepNesting) {
  const auto lists = [](std::size_t n) { return std::string(n, '[') + std::string(n, ']'); };
  EXPECT_EQ(parse(lists(101), "f.yaml").items().size(), 1U);
  EXPECT_EQ(parse_error(lists(102)), "f.yaml:1:102  nested deeper than 100");
  for (const char* open : {"[", "- ", "? ", "{"}) {
    EXPECT_THAT(parse_error(repeated(open, 100'000)),
                ::testing::EndsWith("nested deeper than 100"));
  }
  // Neither half is too deep.
  const std::string half = std::string(60, '[') + "x" + std::string(60, ']');
  const std::string on_it = std::string(60, '[') + "*a" + std::string(60, ']');
  EXPECT_EQ(parse_error("a: &a " + half + "\nb: " + on_it + "\n"),
            "f.yaml:2:64  nested deeper than 100");
}

TEST(Yaml, RefusesWhatIsTooLarge) {
  const std::string text(kMaxYamlBytes, '#');
  EXPECT_TRUE(parse(text, "f.yaml").is_null());
  EXPECT_EQ(parse_error(text + "#"), "f.yaml  is larger than 1 MiB, as no YAML that viwo reads is");
}

TEST(Yaml, RefusesAZeroByteThatIsWrittenInLetters) {
  EXPECT_EQ(parse_error("a: \"b\\0c\"\n"), "f.yaml:1:4  a text with a zero byte");
}

TEST(Yaml, RefusesEscapesThatYieldHalfOfACharacter) {
  for (const std::string escape : {"\\N", "\\_"}) {
    for (const std::string before : {"", "&x ", "!!str "}) {
      EXPECT_EQ(parse_error("a: " + before + "\"b" + escape + "c\"\n"),
                "f.yaml:1:4  " + escape + " within quotes is not read: write the character itself");
    }
    EXPECT_EQ(parse("a: 'b" + escape + "'\n", "f.yaml").entries().front().value.scalar(),
              "b" + escape);
  }
}

TEST(Yaml, RefusesBinaryText) {
  EXPECT_EQ(parse_error(std::string_view("a: 1\0", 5)), "f.yaml  is not a text file");
}

TEST(Yaml, ReadsNothingAsNull) {
  EXPECT_TRUE(parse("", "f.yaml").is_null());
  EXPECT_TRUE(parse("# only a comment\n", "f.yaml").is_null());
}

TEST(Yaml, SaysWhichFileIsMissing) {
  EXPECT_EQ(error_of([] { load_file("/no/such/file.yaml"); }), "/no/such/file.yaml  no such file");
}

TEST(Yaml, SaysThatAFolderIsNotAFile) {
  const auto folder = std::filesystem::temp_directory_path();
  EXPECT_EQ(error_of([&] { load_file(folder); }), folder.string() + "  is a folder, not a file");
}

TEST(Yaml, ReadsNoPipesAndDevices) {
  const auto pipe = std::filesystem::temp_directory_path() / "viwo_test_yaml_pipe";
  std::filesystem::remove(pipe);
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(error_of([&] { load_file(pipe); }), pipe.string() + "  is a pipe, not a file");
  std::filesystem::remove(pipe);
  EXPECT_EQ(error_of([] { load_file("/dev/zero"); }), "/dev/zero  is a device, not a file");
}

TEST(Yaml, LoadsAFile) {
  const auto file = std::filesystem::temp_directory_path() / "viwo_test_yaml_load.yaml";
  std::ofstream(file) << "a:\r\n  b: 1\r\n";
  const Node root = load_file(file);
  EXPECT_EQ(root.at_path("a.b")->scalar(), "1");
  EXPECT_EQ(root.at_path("a.b")->mark().text(), file.string() + ":2:6");
  std::filesystem::remove(file);
}

TEST(Yaml, WritesListsOfScalarsOnOneLine) {
  const Node root = parse("r:\n  - 1\n  - 2\nw:\n  - a: 1\n  - [2, 3]\ne: {}\nf: []\n", "");
  EXPECT_EQ(to_yaml(root), "r: [1, 2]\nw:\n  - a: 1\n  - [2, 3]\ne: {}\nf: []\n");
}

TEST(Yaml, RoundTripsAwkwardTexts) {
  Node root = Node::empty_map();
  const std::vector<std::string> texts = {
      "",       " ",       "null",         "~",        "Null",        "true",
      "1e-3",   "a: b",    "# no comment", "- item",   "[x",          "{y}",
      "*alias", "&anchor", "!tag",         "%dir",     "a\nb\n",      "tab\there",
      "\"q\"",  "it's",    "@at",          "`",        "| ",          "> ",
      "---",    "...",     "x #y",         "\xc3\xa9", "back\\slash", ":",
      "-",      "?",       "<<",           "a,b",      "\r\n",        " lead",
      "trail ", "a:",      "\x01"};
  Node list = Node::list_of();
  for (std::size_t i = 0; i < texts.size(); ++i) {
    root.set(std::string("k").append(std::to_string(i)), Node::scalar_of(texts[i]));
    if (!texts[i].empty()) root.set(texts[i], Node::scalar_of("key"));
    list.items().push_back(Node::scalar_of(texts[i]));
  }
  list.items().push_back(Node::null());
  root.set("list", list);
  EXPECT_EQ(parse(to_yaml(root), "f.yaml"), root) << to_yaml(root);
}

Node random_node(std::mt19937_64& random, int depth) {
  static const std::vector<std::string> kTexts = {"a", "0.5", "", "null", "x y", "{", "a: b", "\n"};
  const auto pick = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  switch (pick(depth > 3 ? 2 : 4)) {
    case 0:
      return Node::null();
    case 1:
      return Node::scalar_of(kTexts[pick(kTexts.size())], {}, pick(2) == 0);
    case 2: {
      Node list = Node::list_of();
      for (std::size_t n = pick(4); n > 0; --n) {
        list.items().push_back(random_node(random, depth + 1));
      }
      return list;
    }
    default: {
      Node map = Node::empty_map();
      for (std::size_t n = pick(4); n > 0; --n) {
        map.set(std::string("k").append(std::to_string(n)), random_node(random, depth + 1));
      }
      return map;
    }
  }
}

TEST(Yaml, ALoneCarriageReturnRoundTrips) {
  const Node node = parse(" 6&\r", "f.yaml");
  ASSERT_TRUE(node.is_scalar());
  EXPECT_EQ(parse(to_yaml(node), "f.yaml"), node) << to_yaml(node);
}

TEST(Yaml, RoundTripsRandomTrees) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 2000; ++i) {
    const Node node = random_node(random, 0);
    const std::string text = to_yaml(node);
    ASSERT_EQ(parse(text, "f.yaml"), node) << text;
  }
}

}  // namespace
}  // namespace viwo::config

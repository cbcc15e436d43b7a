// Command line assignments, variants, placeholders, suggestions, collected errors.
#include <gtest/gtest.h>

#include "message_of.hpp"
#include "viwo/config/overrides.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/config/yaml.hpp"

namespace viwo::config {
namespace {

using testing::error_of;

TEST(Merge, ReplacesASectionByOneThatNamesItsType) {
  Node base = parse("k: {type: a, p: 1}\nother: {type: a, p: 1}", "base.yaml");
  merge(base, parse("k: {type: b, q: 2}\nother.type: b", "v.yaml"));
  EXPECT_EQ(to_yaml(base), to_yaml(parse("k: {type: b, q: 2}\nother: {type: b, p: 1}", "w.yaml")));
}

TEST(Errors, AreSortedByPositionAndThrownTogether) {
  Errors errors;
  EXPECT_NO_THROW(errors.throw_if_any());
  errors.add({"b.yaml", 1, 1}, "fifth");
  errors.add({"a.yaml", 10, 2}, "fourth");
  errors.add({"a.yaml", 9, 7}, "third");
  errors.add({"a.yaml", 9, 3}, "second");
  errors.add({"--set x"}, "first");
  EXPECT_EQ(errors.size(), 5u);
  EXPECT_EQ(error_of([&] { errors.throw_if_any(); }),
            "--set x  first\na.yaml:9:3  second\na.yaml:9:7  third\na.yaml:10:2  fourth\n"
            "b.yaml:1:1  fifth");
}

TEST(Overrides, CreateTheSectionsOfAPath) {
  Node root = parse("a: 1\n", "f.yaml");
  set_path(root, "k.params.r_m", Node::scalar_of("0.1", {"--set k"}));
  EXPECT_EQ(root, parse("a: 1\nk: {params: {r_m: 0.1}}\n", ""));
  EXPECT_EQ(root.find("k")->find_entry("params")->key_mark.text(), "--set k");
}

TEST(Overrides, ReachIntoLists) {
  Node root = parse("wheels: [{r: 1}, {r: 2}]\n", "f.yaml");
  set_path(root, "wheels.1.r", Node::scalar_of("3"));
  EXPECT_EQ(root, parse("wheels: [{r: 1}, {r: 3}]\n", ""));
  EXPECT_EQ(
      error_of([&] { set_path(root, "wheels.2.r", Node::scalar_of("3", {"--set wheels.2.r"})); }),
      "--set wheels.2.r  'wheels' is a list of 2 (counted from 0), it has no element '2'");
  EXPECT_EQ(error_of([&] { set_path(root, "wheels.r", Node::scalar_of("3", {"o"})); }),
            "o  'wheels' is a list of 2 (counted from 0), it has no element 'r'");
}

TEST(Overrides, NameTheSingleValueInTheirWay) {
  Node root = parse("kinematics: {type: x}\n", "f.yaml");
  EXPECT_EQ(
      error_of([&] { set_path(root, "kinematics.type.deep", Node::scalar_of("3", {"--set a"})); }),
      "--set a  'kinematics.type' is a single value: cannot set 'kinematics.type.deep'");
}

TEST(Overrides, RefuseEmptyComponents) {
  Node root;
  for (const char* path : {"", ".", "a..b", "a.", ".a"}) {
    EXPECT_EQ(error_of([&] { set_path(root, path, Node::scalar_of("3", {"o"})); }),
              "o  '" + std::string(path) + "' is not a path (as in kinematics.type)");
  }
}

TEST(Overrides, MergeDottedAndNestedKeys) {
  Node base = parse("k: {type: a, p: {r: 1, s: 2}}\nl: [1, 2]\n", "base.yaml");
  merge(base, parse("k.type: b\nk: {p: {s: 3, t.u: 4}}\nl: [5]\nnew: {x.y: 1}\n", "v.yaml"));
  EXPECT_EQ(base,
            parse("k: {type: b, p: {r: 1, s: 3, t: {u: 4}}}\nl: [5]\nnew: {x: {y: 1}}\n", ""));
  EXPECT_EQ(base.at_path("k.type")->mark().text(), "v.yaml:1:9");
  EXPECT_EQ(base.find("k")->find_entry("type")->key_mark.text(), "v.yaml:1:1");
  EXPECT_EQ(base.at_path("k.p.r")->mark().text(), "base.yaml:1:21");
}

TEST(Overrides, MustBeASection) {
  Node base = parse("a: 1\n", "base.yaml");
  EXPECT_EQ(error_of([&] { merge(base, parse("[1]", "v.yaml")); }),
            "v.yaml:1:1  expected a section of overrides, got a list");
  merge(base, Node::null());
  EXPECT_EQ(base, parse("a: 1\n", ""));
}

TEST(Overrides, ParseAnAssignmentAsYaml) {
  const Assignment list = parse_assignment("a.b=[1, {c: d=e}]");
  EXPECT_EQ(list.path, "a.b");
  EXPECT_EQ(list.value, parse("[1, {c: d=e}]", ""));
  EXPECT_EQ(list.value.at_path("1.c")->mark().text(), "--set a.b");
  EXPECT_TRUE(parse_assignment("a=").value.is_null());
  EXPECT_EQ(error_of([] { parse_assignment("a.b"); }), "--set a.b  expected path.to.key=value");
  EXPECT_EQ(error_of([] { parse_assignment("a=[1"); }).substr(0, 27),
            "--set a  not valid YAML: en");
}

TEST(Overrides, SubstitutePlaceholders) {
  Node root =
      parse("a: \"{data}/x_{n}{n}\"\nb: [\"{ data }\", \"{}\", \"{{n}}\", \"{0}\"]\n", "f.yaml");
  Errors errors;
  substitute(root, {{"data", "/d"}, {"n", "7"}}, errors);
  EXPECT_TRUE(errors.empty());
  EXPECT_EQ(root, parse("a: /d/x_77\nb: [\"{ data }\", \"{}\", \"{7}\", \"{0}\"]\n", ""));
}

TEST(Overrides, PlaceholdersBecomeNoMoreTextThanAConfigurationHas) {
  std::string names;
  for (int i = 0; i < 50; ++i) names += "{long}";
  Node root = parse("a: \"" + names + "\"\nb: [\"" + names + "\"]\n", "f.yaml");
  Errors errors;
  substitute(root, {{"long", std::string(10'000, 'x')}}, errors);
  EXPECT_EQ(root.find("a")->scalar().size(), 500'000U);
  root = parse("a: \"" + names + "\"\nb: [\"" + names + names + "\"]\n", "f.yaml");
  EXPECT_EQ(error_of([&] {
              substitute(root, {{"long", std::string(10'000, 'x')}}, errors);
            }),
            "f.yaml:2:5  placeholders become more than 1 MiB of text, as in no configuration that "
            "viwo reads");
}

TEST(Overrides, ReportUnknownPlaceholders) {
  Node root = parse("a: \"{dta}/x\"\nb: \"{elsewhere}\"\n", "f.yaml");
  Errors errors;
  substitute(root, {{"data", "/d"}, {"run", "7"}}, errors);
  EXPECT_EQ(errors.text(),
            "f.yaml:1:4  unknown placeholder '{dta}' in '{dta}/x' - did you mean 'data'?\n"
            "f.yaml:2:4  unknown placeholder '{elsewhere}' in '{elsewhere}' - known: data, run");
}

TEST(Suggestions, CountSwapsAsOneEdit) {
  const std::vector<std::string> known = {"track_m", "four_wis_wid", "diff_drive", "r"};
  EXPECT_EQ(nearest("tarck_m", known), "track_m");
  EXPECT_EQ(nearest("four_wsi_wdi", known), "four_wis_wid");
  EXPECT_EQ(nearest("dif_driv", known), "diff_drive");
  EXPECT_EQ(nearest("di_driv", known), "");
  EXPECT_EQ(nearest("x", known), "") << "a complete replacement is no misspelling";
  EXPECT_EQ(nearest("base", std::vector<std::string>{"name"}), "") << "half of it replaced";
  EXPECT_EQ(nearest("r_5", std::vector<std::string>{"r_1"}), "") << "another number is no slip";
  EXPECT_EQ(nearest("a_z", std::vector<std::string>{"a_x"}), "") << "nor is another axis";
  EXPECT_EQ(nearest("a_X", std::vector<std::string>{"a_x"}), "a_x");
  EXPECT_EQ(nearest("abd", std::vector<std::string>{"abe", "abc"}), "abe");
}

TEST(Suggestions, ListWhatIsKnownIfNothingIsNear) {
  const std::vector<std::string> known = {"euler", "rk4"};
  EXPECT_EQ(did_you_mean("eulr", known), " - did you mean 'euler'?");
  EXPECT_EQ(did_you_mean("analytic", known), " - known: euler, rk4");
  EXPECT_EQ(did_you_mean("analytic", {}), "");
}

TEST(Assignment, RefusesWhatMakesNoEndOfValues) {
  EXPECT_EQ(error_of([] { parse_assignment("name=,"); }),
            "--set name  not valid YAML: ',' does not belong here");
  // Each value of the list would keep the path.
  EXPECT_EQ(error_of([] { parse_assignment(std::string(1001, 'a') + "=[1, 2]"); }),
            "--set  a path of 1001 characters");
}

}  // namespace
}  // namespace viwo::config

// viwo plugins new: what it refuses, and that it writes whole folders. That they build and run is
// tested in tests/install_consumer.
#include <set>

#include "support.hpp"

namespace viwo {
namespace {

using NewPlugin = CommandLineTest;

std::set<std::string> files_in(const std::filesystem::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    names.insert(entry.path().filename().string());
  }
  return names;
}

TEST_F(NewPlugin, WritesAFolderOfItsNameOrWhereItIsTold) {
  const std::set<std::string> common{".gitignore", "CMakeLists.txt",   "README.md",
                                     "model.md",   "conformance.yaml", "run.yaml"};
  const std::vector<std::pair<std::string, std::string>> kinds{
      {"kinematics", "camera.yaml"}, {"update", "camera.yaml"}, {"sensor", "encoders.csv"}};
  for (const auto& [kind, extra] : kinds) {
    const std::string name = "my_2nd_" + kind;
    const Outcome here = expect_done({"plugins", "new", kind, name});
    EXPECT_EQ(here.out,
              "written: " + name + "; how to build and run it is in " + name + "/README.md\n");
    std::set<std::string> expected = common;
    expected.insert({extra, name + ".cpp"});
    EXPECT_EQ(files_in(at(name)), expected);
    expect_done({"plugins", "new", kind, name, "--out", "deep/" + kind});
    EXPECT_EQ(files_in(at("deep/" + kind)), expected);
    EXPECT_EQ(read(name + "/" + name + ".cpp"), read("deep/" + kind + "/" + name + ".cpp"));
    const std::string source = read(name + "/" + name + ".cpp");
    EXPECT_NE(source.find("class My2nd"), std::string::npos);
    EXPECT_NE(source.find('"' + name + '"'), std::string::npos);
    for (const std::string& file : expected) {
      for (const char* rest : {"@name@", "@Name@", "@kind@", "@version@", "@api@"}) {
        EXPECT_EQ(read(name + "/" + file).find(rest), std::string::npos) << file << " " << rest;
      }
    }
  }
}

TEST_F(NewPlugin, RefusesNamesThatCannotBeOne) {
  for (const std::string& name :
       {std::string(""), std::string("Base"), std::string("2wheels"), std::string("my-base"),
        std::string("../base"), std::string("my__base"), std::string("base_"), std::string("_base"),
        std::string("b\xc3\xa4r"), std::string("a b"), std::string(41, 'a')}) {
    expect_refused({"plugins", "new", "kinematics", name},
                   "viwo plugins new: '" + name +
                       "' is no name for a plugin: lower-case letters, digits and single "
                       "underscores, a letter first, at most 40 of them, e.g. my_tricycle");
  }
  expect_done({"plugins", "new", "kinematics", std::string(40, 'a')});
}

TEST_F(NewPlugin, RefusesUnknownKindsAndNamesThatAreTaken) {
  expect_refused({"plugins", "new", "kinematic", "mine"},
                 "viwo plugins new: unknown kind 'kinematic' - did you mean 'kinematics'?");
  expect_refused({"plugins", "new", "camera", "mine"},
                 "viwo plugins new: unknown kind 'camera' - known: kinematics, sensor, update");
  const std::string taken = VIWO_TEST_PLUGIN_DIR "/libviwo_kinematics_differential.so";
  expect_refused({"plugins", "new", "kinematics", "differential"},
                 "viwo plugins new: there is a kinematics plugin 'differential' already: " + taken +
                     " - choose another name");
  // The same name for another kind is another plugin.
  expect_done({"plugins", "new", "sensor", "differential"});
}

TEST_F(NewPlugin, NeverWritesIntoWhatIsThere) {
  write("mine/notes.txt", "mine\n");
  expect_refused({"plugins", "new", "kinematics", "mine"},
                 "viwo plugins new: mine exists: nothing was written");
  expect_refused({"plugins", "new", "kinematics", "other", "--out", "mine/notes.txt"},
                 "viwo plugins new: mine/notes.txt exists: nothing was written");
  std::filesystem::create_symlink("nowhere", at("link"));
  expect_refused({"plugins", "new", "kinematics", "link"},
                 "viwo plugins new: link exists: nothing was written");
  EXPECT_EQ(files_in(at("mine")), std::set<std::string>{"notes.txt"});
  const Outcome below_a_file =
      viwo({"plugins", "new", "kinematics", "mine_too", "--out", "mine/notes.txt/x"});
  EXPECT_EQ(below_a_file.code, 2);
  EXPECT_EQ(below_a_file.err.find("viwo plugins new: cannot make the folder mine/notes.txt/x: "),
            0U)
      << below_a_file.err;
}

TEST_F(NewPlugin, IsTheOnlyOneThatTakesAFolder) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"plugins", "list", "--out", "x"},
        {"plugins", "describe", "differential", "--out", "x"}}) {
    expect_refused(words, "viwo plugins: --out is for viwo plugins new KIND NAME");
  }
  expect_refused(
      {"plugins", "new", "kinematics"},
      "viwo plugins: usage: viwo plugins list | describe NAME | schema | check FILE | new KIND "
      "NAME [--out DIR]");
}

}  // namespace
}  // namespace viwo

// Sections against parameter tables: one test per message.
#include <array>
#include <filesystem>

#include <gtest/gtest.h>

#include "viwo/api/kinematic_model.hpp"
#include "viwo/config/overrides.hpp"
#include "viwo/config/params.hpp"
#include "viwo/config/yaml.hpp"

namespace viwo::config {
namespace {

// clang-format off
constexpr std::array<ParamSpec, 9> kSpecs = {{
    {.name = "track_m", .type = ParamType::kNumber, .unit = "m", .min = 0., .min_exclusive = true,
     .help = "distance between wheel contact lines"},
    {.name = "sigma_drive_rad_per_s", .type = ParamType::kNumber, .unit = "rad/s",
     .fallback = "0.001", .min = 0., .help = "drive encoder noise"},
    {.name = "sigma_lateral_m_per_s", .type = ParamType::kNumber, .fallback = "0.1"},
    {.name = "wheels", .type = ParamType::kInt, .fallback = "4", .min = 2., .max = 8.},
    {.name = "radii_m", .type = ParamType::kNumbers, .unit = "m", .fallback = "[0.1, 0.2]",
     .min = 0., .max = 1., .min_exclusive = true, .help = "wheel radii"},
    {.name = "solve", .type = ParamType::kString, .fallback = "plain", .choices = "plain|weighted"},
    {.name = "log", .type = ParamType::kPath, .fallback = ""},
    {.name = "channels", .type = ParamType::kStrings, .fallback = "[]", .choices = "drive|steer"},
    {.name = "enabled", .type = ParamType::kBool, .fallback = "true"},
}};
// clang-format on

constexpr std::array<std::string_view, 1> kOther = {"type"};

ParamSet read(std::string_view yaml, Errors& errors, std::span<const ParamSpec> specs = kSpecs) {
  const Node root = parse("kinematics: " + std::string(yaml), "configs/x.yaml");
  const Node& section = *root.find("kinematics");
  return read_params(section, section.mark(), "kinematics (diff_drive)", specs, kOther, {}, errors);
}

/// What is wrong with one more entry of an otherwise right section, without its position.
std::string entry_error(const std::string& entry) {
  const bool has_track = entry.starts_with("track_m:");
  Errors errors;
  read("{" + std::string(has_track ? "" : "track_m: 1, ") + entry + "}", errors);
  const std::string text = errors.text();
  return text.empty() ? "no error" : text.substr(std::min(text.find("  ") + 2, text.size()));
}

TEST(Params, AreReadWithTheirTypes) {
  Errors errors;
  const ParamSet params = read(
      "{type: diff_drive, track_m: +5.5e-1, wheels: 3, radii_m: [0.1, 1], solve: weighted,"
      " channels: steer, enabled: false, log: /a/b/../c/}",
      errors);
  EXPECT_EQ(errors.text(), "");
  EXPECT_EQ(params.number("track_m"), 0.55);
  EXPECT_EQ(params.number("sigma_drive_rad_per_s"), 0.001);
  EXPECT_EQ(params.integer("wheels"), 3);
  EXPECT_EQ(std::vector<double>(params.numbers("radii_m").begin(), params.numbers("radii_m").end()),
            (std::vector<double>{0.1, 1.}));
  EXPECT_EQ(params.text("solve"), "weighted");
  ASSERT_EQ(params.texts("channels").size(), 1u);
  EXPECT_EQ(params.texts("channels")[0], "steer");
  EXPECT_FALSE(params.flag("enabled"));
  EXPECT_EQ(params.text("log"), "/a/c");
}

TEST(Params, HaveDefaults) {
  Errors errors;
  const ParamSet params = read("{track_m: 1}", errors);
  EXPECT_EQ(params.integer("wheels"), 4);
  EXPECT_EQ(params.numbers("radii_m").size(), 2u);
  EXPECT_EQ(params.numbers("radii_m")[1], 0.2);
  EXPECT_EQ(params.text("log"), "");
  EXPECT_TRUE(params.texts("channels").empty());
  EXPECT_TRUE(params.flag("enabled"));
}

TEST(Params, AcceptASingleValueForAList) {
  Errors errors;
  const ParamSet params = read("{track_m: 1, radii_m: 0.3}", errors);
  ASSERT_EQ(params.numbers("radii_m").size(), 1u);
  EXPECT_EQ(params.numbers("radii_m")[0], 0.3);
}

TEST(Params, ReportAllErrorsWithPositions) {
  const Node root = parse(
      "kinematics:\n"
      "  type: diff_drive\n"
      "  sigma_latral_m_per_s: 1\n"
      "  track_m: -0.55\n"
      "  wheels: 9\n",
      "configs/x.yaml");
  Errors errors;
  const Node& section = *root.find("kinematics");
  read_params(section, section.mark(), "kinematics (diff_drive)", kSpecs, kOther, {}, errors);
  EXPECT_EQ(errors.text(),
            "configs/x.yaml:3:3  kinematics (diff_drive): unknown key 'sigma_latral_m_per_s'"
            " - did you mean 'sigma_lateral_m_per_s'?\n"
            "configs/x.yaml:4:12  kinematics.track_m: -0.55 violates track_m > 0"
            " (distance between wheel contact lines, m)\n"
            "configs/x.yaml:5:11  kinematics.wheels: 9 violates 2 <= wheels <= 8");
}

TEST(Params, ReportWhatIsMissing) {
  Errors errors;
  read("", errors);
  EXPECT_EQ(errors.text(),
            "configs/x.yaml:1:1  kinematics (diff_drive): 'track_m' is missing"
            " (distance between wheel contact lines, m)");
}

TEST(Params, ReportASectionThatIsNone) {
  Errors errors;
  read("[1]", errors);
  EXPECT_EQ(errors.text(),
            "configs/x.yaml:1:13  kinematics (diff_drive): expected a section (lines of"
            " 'key: value'), got a list");
}

TEST(Params, ReportUnknownKeys) {
  EXPECT_EQ(entry_error("tpye: x"),
            "kinematics (diff_drive): unknown key 'tpye' - did you mean 'type'?");
  EXPECT_EQ(entry_error("gravity: x"),
            "kinematics (diff_drive): unknown key 'gravity' - known: track_m,"
            " sigma_drive_rad_per_s, sigma_lateral_m_per_s, wheels, radii_m, solve, log, channels,"
            " enabled, type");
}

TEST(Params, ReportAKeyInAnotherUnit) {
  EXPECT_EQ(entry_error("sigma_drive_deg_per_s: 1"),
            "kinematics (diff_drive): unknown key 'sigma_drive_deg_per_s' - sigma_drive is in"
            " rad/s, did you mean 'sigma_drive_rad_per_s'?");
  EXPECT_EQ(entry_error("radii_mm: 1"),
            "kinematics (diff_drive): unknown key 'radii_mm' - radii is in m, did you mean"
            " 'radii_m'?");
  EXPECT_EQ(entry_error("sigma_lateral: 1"),
            "kinematics (diff_drive): unknown key 'sigma_lateral' - sigma_lateral is in m/s, did"
            " you mean 'sigma_lateral_m_per_s'?");
}

TEST(Params, ReportNumbersThatAreNone) {
  EXPECT_EQ(entry_error("track_m: \"0,1\""),
            "kinematics.track_m: '0,1' is not a number - the decimal sign is a point");
  EXPECT_EQ(entry_error("track_m: 0.5 m"),
            "kinematics.track_m: '0.5 m' is not a number - write the number alone, it is in m");
  EXPECT_EQ(entry_error("sigma_lateral_m_per_s: 3cm"),
            "kinematics.sigma_lateral_m_per_s: '3cm' is not a number - write the number alone");
  EXPECT_EQ(entry_error("track_m: wide"), "kinematics.track_m: 'wide' is not a number");
  EXPECT_EQ(entry_error("track_m: \"\""), "kinematics.track_m: '' is not a number");
  EXPECT_EQ(entry_error("track_m: +-1"), "kinematics.track_m: '+-1' is not a number");
  EXPECT_EQ(entry_error("track_m: .nan"), "kinematics.track_m: '.nan' is not a finite number");
  EXPECT_EQ(entry_error("track_m: -.inf"), "kinematics.track_m: '-.inf' is not a finite number");
  EXPECT_EQ(entry_error("track_m: NaN"), "kinematics.track_m: 'NaN' is not a finite number");
  EXPECT_EQ(entry_error("track_m: 1e999"),
            "kinematics.track_m: '1e999' is outside of what a computer number can hold");
}

TEST(Params, ReportAnotherKindOfValue) {
  EXPECT_EQ(entry_error("track_m: [1]"),
            "kinematics.track_m: expected a number, got a list"
            " (distance between wheel contact lines, m)");
  EXPECT_EQ(entry_error("wheels: "), "kinematics.wheels: expected an integer, got nothing");
  EXPECT_EQ(entry_error("radii_m: {a: 1}"),
            "kinematics.radii_m: expected a list of numbers, got a section (wheel radii, m)");
  EXPECT_EQ(entry_error("radii_m: [0.1, [0.2]]"),
            "kinematics.radii_m[1]: expected a single value, got a list");
  EXPECT_EQ(entry_error("solve: [plain]"), "kinematics.solve: expected text, got a list");
}

TEST(Params, ReportIntegersThatAreNone) {
  EXPECT_EQ(entry_error("wheels: 2.5"), "kinematics.wheels: '2.5' is not an integer");
  EXPECT_EQ(entry_error("wheels: 3 wheels"),
            "kinematics.wheels: '3 wheels' is not an integer - write the number alone");
  EXPECT_EQ(entry_error("wheels: 99999999999999999999"),
            "kinematics.wheels: '99999999999999999999' is outside of what a computer number can"
            " hold");
}

TEST(Params, ReportBoundsOfListElements) {
  EXPECT_EQ(entry_error("radii_m: [0.1, 0]"),
            "kinematics.radii_m[1]: 0 violates 0 < radii_m <= 1 (wheel radii, m)");
}

TEST(Params, ReportUnknownChoicesAndFlags) {
  EXPECT_EQ(entry_error("solve: wieghted"),
            "kinematics.solve: unknown value 'wieghted' - did you mean 'weighted'?");
  EXPECT_EQ(entry_error("channels: [drive, yaw]"),
            "kinematics.channels[1]: unknown value 'yaw' - known: drive, steer");
  EXPECT_EQ(entry_error("enabled: yes"), "kinematics.enabled: 'yes' is not true or false");
}

TEST(Params, ResolvePathsAgainstTheFileTheyAreWrittenIn) {
  constexpr std::array<ParamSpec, 2> specs = {
      {{.name = "a", .type = ParamType::kPath}, {.name = "b", .type = ParamType::kPath}}};
  Node root = parse("{a: ../data/x.csv, b: x/}", "/robots/configs/base.yaml");
  Errors errors;
  ParamSet params = read_params(root, root.mark(), "", specs, {}, {}, errors);
  EXPECT_EQ(params.text("a"), "/robots/data/x.csv");
  EXPECT_EQ(params.text("b"), "/robots/configs/x");

  set_path(root, "a", parse_assignment("a=./y.csv").value);
  set_path(root, "b", *parse("b: z", "/variants/v.yaml").find("b"));
  params = read_params(root, root.mark(), "", specs, {}, {}, errors);
  EXPECT_EQ(params.text("a"), (std::filesystem::current_path() / "y.csv").string());
  EXPECT_EQ(params.text("b"), "/variants/z");
  EXPECT_TRUE(errors.empty());
}

TEST(Params, RefuseAnEmptyPathWithoutSuchADefault) {
  constexpr std::array<ParamSpec, 1> specs = {{{.name = "a", .type = ParamType::kPath}}};
  const Node root = parse("a: ''", "x.yaml");
  Errors errors;
  read_params(root, root.mark(), "log", specs, {}, {}, errors);
  EXPECT_EQ(errors.text(), "x.yaml:1:4  log.a: is empty");
}

class NoRows : public KinematicModel {
  void describe(ModelDescription&) const override {}
  Status rows(const EncoderSample&, const Intrinsics&, bool, RowSystem&) const override {
    return Status::kOk;
  }
  void intrinsic_derivatives(const EncoderSample&, const Intrinsics&, const RowSystem&,
                             const RowVector&, const Twist&, const RowVector&,
                             IntrinsicDerivatives&) const override {}
  void noise_derivatives(const EncoderSample&, const Intrinsics&, const RowSystem&,
                         const RowVector&, const Twist&, const RowVector&,
                         NoiseDerivatives&) const override {}
};

constexpr std::array<ParamSpec, 1> kNested = {
    {{.name = "kinematics", .type = ParamType::kKinematics, .fallback = "{type: a}"}}};

TEST(Params, HandANestedModelToTheHost) {
  const NoRows model;
  std::string seen;
  ReadContext context;
  context.make_kinematics = [&](const Node& node, const std::string& path, Errors&) {
    seen += path + "=" + node.find("type")->scalar() + " ";
    return &model;
  };
  Errors errors;
  const Node root = parse("kinematics: {type: b}", "x.yaml");
  const ParamSet given =
      read_params(root, root.mark(), "sensors.log (asl)", kNested, {}, context, errors);
  read_params(Node::null(), root.mark(), "sensors.log (asl)", kNested, {}, context, errors);
  EXPECT_EQ(&given.kinematics("kinematics"), &model);
  EXPECT_EQ(seen, "sensors.log.kinematics=b sensors.log.kinematics=a ");
  const Node written = write_params(kNested, given, [&](const KinematicModel& m) {
    EXPECT_EQ(&m, &model);
    return *root.find("kinematics");
  });
  EXPECT_EQ(written, root);
}

TEST(Params, ReportANestedModelThatIsNoSection) {
  Errors errors;
  const Node root = parse("kinematics: diff_drive", "x.yaml");
  read_params(root, root.mark(), "log", kNested, {}, {}, errors);
  EXPECT_EQ(errors.text(),
            "x.yaml:1:13  log.kinematics: expected a section with a kinematic model, got a single"
            " value");
}

TEST(Params, FailForATableThatRefusesItsOwnDefault) {
  constexpr std::array<ParamSpec, 1> specs = {
      {{.name = "r_m", .type = ParamType::kNumber, .fallback = "-1", .min = 0.}}};
  Errors errors;
  try {
    read_params(Node::null(), {}, "k", specs, {}, {}, errors);
    FAIL();
  } catch (const std::logic_error& error) {
    EXPECT_STREQ(error.what(), "default of 'r_m'  k.r_m: -1 violates r_m >= 0");
  }
  EXPECT_THROW(check_specs(specs), std::logic_error);
}

std::string spec_error(std::vector<ParamSpec> specs) {
  try {
    check_specs(specs);
  } catch (const std::logic_error& error) {
    return error.what();
  }
  return "no error";
}

TEST(Params, TablesAreChecked) {
  EXPECT_EQ(spec_error({kSpecs.begin(), kSpecs.end()}), "no error");
  EXPECT_EQ(spec_error({{.name = nullptr, .type = ParamType::kInt}}), "a parameter without a name");
  EXPECT_EQ(
      spec_error({{.name = "a", .type = ParamType::kInt}, {.name = "a", .type = ParamType::kInt}}),
      "parameter 'a' is in the table twice");
  EXPECT_EQ(spec_error({{.name = "a", .type = ParamType::kInt, .help = nullptr}}),
            "parameter 'a': unit, choices or help is a null pointer");
  EXPECT_EQ(spec_error({{.name = "a", .type = ParamType::kInt, .fallback = "[1"}}).substr(0, 32),
            "default of 'a'  not valid YAML: ");
  EXPECT_EQ(spec_error({{.name = "a", .type = ParamType::kKinematics, .fallback = "b"}}),
            "default of 'a'  is not a section");
  EXPECT_EQ(spec_error({{.name = "a", .type = static_cast<ParamType>(77)}}),
            "parameter 'a': unknown type");
}

TEST(Params, AreWrittenBackToTheSameValues) {
  Errors errors;
  const ParamSet params = read(
      "{track_m: 0.1234567890123456789, wheels: 8, radii_m: [1e-9, 0.3333333333333333],"
      " log: 'data/a: b.csv', channels: [steer, drive]}",
      errors);
  const Node written = write_params(kSpecs, params);
  const Node reread = parse(to_yaml(written), "elsewhere/y.yaml");
  const ParamSet again = read_params(reread, {}, "", kSpecs, {}, {}, errors);
  EXPECT_EQ(errors.text(), "");
  EXPECT_EQ(again.values(), params.values());
  EXPECT_EQ(written.at_path("radii_m.0")->scalar(), "1e-09");
}

TEST(Params, AreDescribedAsATemplate) {
  const std::string text = describe_params(std::span(kSpecs).first(7));
  EXPECT_EQ(
      text,
      "track_m:                      # required number, m, > 0: distance between wheel contact"
      " lines\n"
      "sigma_drive_rad_per_s: 0.001  # number, rad/s, >= 0: drive encoder noise\n"
      "sigma_lateral_m_per_s: 0.1    # number\n"
      "wheels: 4                     # integer, >= 2, <= 8\n"
      "radii_m: [0.1, 0.2]           # list of numbers, m, > 0, <= 1: wheel radii\n"
      "solve: plain                  # text, plain | weighted\n"
      "log: \"\"                       # path\n");
  EXPECT_EQ(parse(text, "t").find("solve")->scalar(), "plain");
}

}  // namespace
}  // namespace viwo::config

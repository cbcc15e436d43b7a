// Sections against parameter tables: one test per message.
#include <array>
#include <filesystem>

#include <gtest/gtest.h>

#include "message_of.hpp"
#include "viwo/api/kinematic_model.hpp"
#include "viwo/config/overrides.hpp"
#include "viwo/config/params.hpp"
#include "viwo/config/yaml.hpp"

namespace viwo::config {
namespace {

enum class Solve { kPlain, kWeighted };

struct Section {
  double track_m = 0.;
  double sigma_drive_rad_per_s = 0.001;
  double sigma_lateral_m_per_s = 0.1;
  int wheels = 4;
  std::vector<double> radii_m{0.1, 0.2};
  Solve solve = Solve::kPlain;
  std::filesystem::path log;
  std::vector<std::string> channels;
  bool enabled = true;
  Eigen::Vector3d mount_m{0., 0., 0.5};

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(track_m),
      {.unit = "m", .above = 0., .required = true, .help = "distance between wheel contact lines"});
    b(VIWO_PARAM(sigma_drive_rad_per_s),
      {.unit = "rad/s", .min = 0., .help = "drive encoder noise"});
    b(VIWO_PARAM(sigma_lateral_m_per_s), {});
    b(VIWO_PARAM(wheels), {.min = 2., .max = 8.});
    b(VIWO_PARAM(radii_m), {.unit = "m", .above = 0., .max = 1., .help = "wheel radii"});
    b(VIWO_PARAM(solve), {{"plain", Solve::kPlain}, {"weighted", Solve::kWeighted}}, {});
    b(VIWO_PARAM(log), {});
    b(VIWO_PARAM(channels), {.choices = "drive|steer"});
    b(VIWO_PARAM(enabled), {});
    b(VIWO_PARAM(mount_m), {.unit = "m"});
  }
};

constexpr std::array<std::string_view, 1> kOther = {"type"};

Section read(std::string_view yaml, Errors& errors) {
  const Node root = parse("kinematics: " + std::string(yaml), "configs/x.yaml");
  const Node& section = *root.find("kinematics");
  return read_section<Section>(section, section.mark(), "kinematics (diff_drive)", errors, kOther);
}

/// One parameter.
ParamSpec spec(const char* name, ParamType type, ParamValue fallback, const ParamInfo& info = {}) {
  ParamSpec out;
  static_cast<ParamInfo&>(out) = info;
  out.name = name;
  out.type = type;
  out.fallback = std::move(fallback);
  return out;
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
  const Section params = read(
      "{type: diff_drive, track_m: +5.5e-1, wheels: 3, radii_m: [0.1, 1], solve: weighted,"
      " channels: steer, enabled: false, log: /a/b/../c/, mount_m: [1, 2, 3]}",
      errors);
  EXPECT_EQ(errors.text(), "");
  EXPECT_EQ(params.track_m, 0.55);
  EXPECT_EQ(params.sigma_drive_rad_per_s, 0.001);
  EXPECT_EQ(params.wheels, 3);
  EXPECT_EQ(params.radii_m, (std::vector<double>{0.1, 1.}));
  EXPECT_EQ(params.solve, Solve::kWeighted);
  EXPECT_EQ(params.channels, std::vector<std::string>{"steer"});
  EXPECT_FALSE(params.enabled);
  EXPECT_EQ(params.log, "/a/c");
  EXPECT_EQ(params.mount_m, Eigen::Vector3d(1., 2., 3.));
}

TEST(Params, HaveDefaults) {
  Errors errors;
  const Section params = read("{track_m: 1}", errors);
  EXPECT_EQ(params.wheels, 4);
  EXPECT_EQ(params.radii_m, (std::vector<double>{0.1, 0.2}));
  EXPECT_EQ(params.solve, Solve::kPlain);
  EXPECT_EQ(params.log, "");
  EXPECT_TRUE(params.channels.empty());
  EXPECT_TRUE(params.enabled);
  EXPECT_EQ(params.mount_m, Eigen::Vector3d(0., 0., 0.5));
}

TEST(Params, AcceptASingleValueForAList) {
  Errors errors;
  EXPECT_EQ(read("{track_m: 1, radii_m: 0.3}", errors).radii_m, std::vector<double>{0.3});
  EXPECT_TRUE(errors.empty());
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
  read_section<Section>(section, section.mark(), "kinematics (diff_drive)", errors, kOther);
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
            " enabled, mount_m, type");
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

TEST(Params, ReportListsOfAnotherLength) {
  EXPECT_EQ(entry_error("mount_m: [1, 2]"), "kinematics.mount_m: needs 3 numbers, not 2 (m)");
  EXPECT_EQ(entry_error("mount_m: 1"), "kinematics.mount_m: needs 3 numbers, not 1 (m)");
  EXPECT_EQ(entry_error("mount_m: {}"),
            "kinematics.mount_m: expected 3 numbers, got a section (m)");
}

TEST(Params, ReportIntegersThatTheMemberDoesNotHold) {
  struct Small {
    std::int16_t n = 0;
    void bind(ParamBinder& b) { b(VIWO_PARAM(n), {}); }
  };
  const Node root = parse("n: 70000", "x.yaml");
  Errors errors;
  read_section<Small>(root, root.mark(), "small", errors);
  EXPECT_EQ(errors.text(), "x.yaml:1:4  small.n: 70000 is too large");
}

TEST(Params, ReportUnknownChoicesAndFlags) {
  EXPECT_EQ(entry_error("solve: wieghted"),
            "kinematics.solve: unknown value 'wieghted' - did you mean 'weighted'?");
  EXPECT_EQ(entry_error("channels: [drive, yaw]"),
            "kinematics.channels[1]: unknown value 'yaw' - known: drive, steer");
  EXPECT_EQ(entry_error("enabled: yes"), "kinematics.enabled: 'yes' is not true or false");
}

TEST(Params, ResolvePathsAgainstTheFileTheyAreWrittenIn) {
  struct Paths {
    std::filesystem::path a, b;
    void bind(ParamBinder& binder) {
      binder(VIWO_PARAM(a), {});
      binder(VIWO_PARAM(b), {});
    }
  };
  Node root = parse("{a: ../data/x.csv, b: x/}", "/robots/configs/base.yaml");
  Errors errors;
  auto params = read_section<Paths>(root, root.mark(), "", errors);
  EXPECT_EQ(params.a, "/robots/data/x.csv");
  EXPECT_EQ(params.b, "/robots/configs/x");

  set_path(root, "a", parse_assignment("a=./y.csv").value);
  set_path(root, "b", *parse("b: z", "/variants/v.yaml").find("b"));
  params = read_section<Paths>(root, root.mark(), "", errors);
  EXPECT_EQ(params.a, (std::filesystem::current_path() / "y.csv").string());
  EXPECT_EQ(params.b, "/variants/z");
  EXPECT_TRUE(errors.empty());
}

TEST(Params, RefuseNothingWhereAnEmptyPathWouldBeNone) {
  EXPECT_EQ(entry_error("log: ''"), "no error");
  EXPECT_EQ(entry_error("log: "), "kinematics.log: expected a file or folder, got nothing");
}

TEST(Params, RefuseAnEmptyPathWithoutSuchADefault) {
  const std::vector<ParamSpec> specs{
      spec("a", ParamType::kPath, std::string(), {.required = true})};
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

struct Nested {
  NestedKinematics kinematics{"{type: a}"};
  void bind(ParamBinder& b) { b(VIWO_PARAM(kinematics), {}); }
};
const std::vector<ParamSpec> kNested = param_specs<Nested>();

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
  EXPECT_EQ(params_from<Nested>(given).kinematics.model, &model);
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

std::string spec_error(const std::vector<ParamSpec>& specs) {
  return testing::error_of<std::logic_error>([&] { check_specs(specs); });
}

TEST(Params, TablesAreChecked) {
  const ParamSpec a = spec("a", ParamType::kInt, std::int64_t{1});
  EXPECT_EQ(spec_error(param_specs<Section>()), "");
  EXPECT_EQ(spec_error({spec("", ParamType::kInt, std::int64_t{1})}), "a parameter without a name");
  EXPECT_EQ(spec_error({a, a}), "parameter 'a' is in the table twice");
  EXPECT_EQ(spec_error({spec("r_m", ParamType::kNumber, -1., {.min = 0.})}),
            "default of 'r_m': -1 violates r_m >= 0");
  EXPECT_EQ(spec_error({spec("r_m", ParamType::kNumbers, std::vector{1., 3.}, {.max = 2.})}),
            "default of 'r_m': 3 violates r_m <= 2");
  EXPECT_EQ(spec_error({spec("a", ParamType::kString, std::string("z"), {.choices = "x|y"})}),
            "default of 'a': 'z' is none of x|y");
  ParamSpec nested = kNested.front();
  nested.fallback_section = "b";
  EXPECT_EQ(spec_error({nested}), "default of 'kinematics': not a section");
  nested.fallback_section = "[1";
  EXPECT_EQ(spec_error({nested}).substr(0, 41), "default of 'kinematics'  not valid YAML: ");
}

TEST(Params, OfATableThatIsNotTheStructuresAreABugOfTheProgram) {
  EXPECT_THROW(params_from<Section>({}), std::logic_error);
  struct Text {
    std::string a;
    void bind(ParamBinder& b) { b(VIWO_PARAM(a), {}); }
  };
  EXPECT_THROW(params_from<Text>({{"a", 1.}}), std::logic_error);
}

TEST(Params, AreWrittenBackToTheSameValues) {
  Errors errors;
  const Section params = read(
      "{track_m: 0.1234567890123456789, wheels: 8, radii_m: [1e-9, 0.3333333333333333],"
      " log: 'data/a: b.csv', channels: [steer, drive]}",
      errors);
  const Node written = write_section(params);
  const Node reread = parse(to_yaml(written), "elsewhere/y.yaml");
  EXPECT_EQ(write_section(read_section<Section>(reread, {}, "", errors)), written);
  EXPECT_EQ(errors.text(), "");
  EXPECT_EQ(written.at_path("track_m")->scalar(), "0.12345678901234568");
  EXPECT_EQ(written.at_path("radii_m.0")->scalar(), "1e-09");
}

TEST(Params, AreDescribedAsATemplate) {
  const std::string text = describe_params(param_specs<Section>());
  EXPECT_EQ(
      text,
      "track_m:                      # required number, m, > 0: distance between wheel contact"
      " lines\n"
      "sigma_drive_rad_per_s: 0.001  # number, rad/s, >= 0: drive encoder noise\n"
      "sigma_lateral_m_per_s: 0.1    # number\n"
      "wheels: 4                     # integer, >= 2, <= 8\n"
      "radii_m: [0.1, 0.2]           # list of numbers, m, > 0, <= 1: wheel radii\n"
      "solve: plain                  # text, plain | weighted\n"
      "log: \"\"                       # path\n"
      "channels: []                  # list of texts, drive | steer\n"
      "enabled: true                 # true or false\n"
      "mount_m: [0, 0, 0.5]          # 3 numbers, m\n");
  EXPECT_EQ(parse(text, "t").find("solve")->scalar(), "plain");
}

TEST(Errors, AreNoMoreThanSomebodyReads) {
  Errors errors;
  for (int line = 1000; line > 0; --line) errors.add({"f.yaml", line, 1}, "wrong");
  const std::string text = errors.text();
  EXPECT_EQ(text.substr(0, 40), "f.yaml:1:1  wrong\nf.yaml:2:1  wrong\nf.ya");
  EXPECT_TRUE(text.ends_with("f.yaml:100:1  wrong\nand 900 more")) << text;
}

}  // namespace
}  // namespace viwo::config

// Reading and writing calibration.yaml.
#include "viwo/calibration_file/calibration_file.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "correlations.hpp"
#include "viwo/config/params.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/log/text.hpp"
#include "viwo/math/number_text.hpp"

namespace viwo {
namespace {

using config::Errors;
using config::Node;
using Entries = CalibrationFile::Entries;
using Trust = CalibrationFile::Status;

struct TopParams {
  std::string model;
  std::string twist;
  Trust status = Trust::kOk;
  std::vector<std::string> reasons;
  std::vector<double> drive_signs;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(model), {.help = "type of the kinematic model; none: nothing of wheels"});
    b(VIWO_PARAM(twist),
      {.choices = "plain|noise_weighted", .help = "odometry.twist that the estimates belong to"});
    b(VIWO_PARAM(status),
      {{"ok", Trust::kOk},
       {"doubtful", Trust::kDoubtful},
       {"diverged", Trust::kDiverged},
       {"failed", Trust::kFailed}},
      {.help = "how it was come by; what has diverged or failed is refused"});
    b(VIWO_PARAM(reasons), {.help = "why it is not ok"});
    b(VIWO_PARAM(drive_signs),
      {.min = -1., .max = 1., .help = "signs of the drives that the estimates belong to"});
  }
};

struct EntryParams {
  double estimate = 0.;
  double sigma = 0.;
  double nominal = 0.;
  std::string unit;

  void bind(ParamBinder& b) {
    constexpr double kMost = 1e9;
    b(VIWO_PARAM(estimate),
      {.min = -kMost, .max = kMost, .required = true, .help = "value to run with"});
    b(VIWO_PARAM(sigma),
      {.min = 0., .max = kMost, .required = true, .help = "standard deviation; 0: held"});
    b(VIWO_PARAM(nominal), {.help = "for the reader; not used"});
    b(VIWO_PARAM(unit), {.help = "must be that of the parameter; may be left out"});
  }
};

struct CameraParams {
  CameraDistortion distortion_model = CameraDistortion::kRadtan;
  Eigen::Vector2d resolution{0., 0.};
  double line_delay_nanoseconds = 0.;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(distortion_model),
      {{"radtan", CameraDistortion::kRadtan}, {"equidistant", CameraDistortion::kEquidistant}},
      {.required = true, .help = "as Kalibr calls it"});
    b(VIWO_PARAM(resolution),
      {.unit = "px", .min = 1., .max = 100'000., .required = true, .help = "width, height"});
    b(VIWO_PARAM(line_delay_nanoseconds),
      {.unit = "ns", .min = 0., .max = 1e7, .help = "from row to row; 0: a global shutter"});
  }
};

/// The sections of entries, with the names in them; those of cameras are behind `camN.`.
struct Section {
  const char* key;
  Entries CalibrationFile::*entries;
  std::vector<std::string> names;  ///< none: those of any kinematic model
};

const std::vector<Section>& sections() {
  static const std::vector<Section> all{
      {"intrinsics", &CalibrationFile::intrinsics, {}},
      {"mount",
       &CalibrationFile::mount,
       {"theta_ItoO_x", "theta_ItoO_y", "theta_ItoO_z", "p_IinO_x", "p_IinO_y", "p_IinO_z"}},
      {"clock", &CalibrationFile::clock, {"t_OtoI"}},
      {"reference", &CalibrationFile::reference, {"x_OinB", "y_OinB", "yaw_OinB", "t_OtoB"}},
      {"cameras",
       &CalibrationFile::cameras,
       {"theta_ItoC_x", "theta_ItoC_y", "theta_ItoC_z", "p_IinC_x", "p_IinC_y", "p_IinC_z", "fx",
        "fy", "cx", "cy", "d1", "d2", "d3", "d4", "t_CtoI"}}};
  return all;
}

/// Behind the name of a wheel set or camera in front of it.
std::string without_owner(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  return dot == std::string::npos ? name : name.substr(dot + 1);
}

/// What is a name where others read it: in Java, XML, YAML, tables.
void check_text(const config::Mark& mark, const std::string& what, const std::string& text,
                Errors& errors, std::string_view more = "") {
  constexpr std::size_t kMost = 100;
  const bool is_plain = std::all_of(text.begin(), text.end(), [&](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("_.+-").find(c) != std::string_view::npos ||
           more.find(c) != std::string_view::npos;
  });
  if (is_plain && text.size() <= kMost) return;
  errors.add(mark, what + ": " + log::quoted(text) + " is no name: letters, digits, _ . + -");
}

void check_name(const Section& section, const Node::Entry& entry, Errors& errors) {
  check_text(entry.key_mark, section.key, entry.key, errors);
  if (section.names.empty()) return;
  const std::string name = without_owner(entry.key);
  if (std::find(section.names.begin(), section.names.end(), name) != section.names.end()) return;
  errors.add(entry.key_mark, std::string(section.key) + ": unknown parameter '" + entry.key + "'" +
                                 config::did_you_mean(name, section.names));
}

void read_entries(const Node& root, const Section& section, Entries& out, Errors& errors) {
  const Node* const node = root.find(section.key);
  if (node == nullptr) return;
  const std::string path = section.key;
  if (!node->is_map()) {
    errors.add(node->mark(), "'" + path + "' must be a section with one entry per parameter");
    return;
  }
  for (const Node::Entry& entry : node->entries()) {
    check_name(section, entry, errors);
    const std::size_t before = errors.size();
    const auto values = config::read_section<EntryParams>(entry.value, entry.key_mark,
                                                          path + "." + entry.key, errors);
    if (errors.size() > before) continue;
    check_text(entry.key_mark, path + "." + entry.key + ".unit", values.unit, errors, "/^*%() ");
    const Node* const at = entry.value.find("estimate");
    out.push_back({entry.key, values.estimate, values.sigma, values.nominal, values.unit,
                   at->mark(), entry.key_mark});
  }
}

void read_wheel_sets(const Node& root, CalibrationFile& file, Errors& errors) {
  const Node* const sets = root.find("wheel_sets");
  if (sets == nullptr) return;
  for (const Node::Entry& entry : sets->entries()) {
    check_text(entry.key_mark, "wheel_sets", entry.key, errors);
    if (!entry.value.is_scalar()) continue;
    check_text(entry.value.mark(), "wheel_sets", entry.value.scalar(), errors);
    file.wheel_sets[entry.key] = entry.value.scalar();
  }
  if (!sets->is_map() || file.wheel_sets.size() != sets->entries().size()) {
    errors.add(sets->mark(), "'wheel_sets' is a section NAME: type of its kinematic model");
  }
}

void read_camera_models(const Node& root, CalibrationFile& file, Errors& errors) {
  const Node* const cameras = root.find("camera_models");
  if (cameras == nullptr) return;
  if (!cameras->is_map()) {
    errors.add(cameras->mark(), "'camera_models' is a section cam0: {...}, cam1: {...}, ...");
    return;
  }
  for (const Node::Entry& entry : cameras->entries()) {
    const std::string name = "cam" + std::to_string(file.camera_models.size());
    if (entry.key != name) {
      errors.add(entry.key_mark, "camera_models: '" + entry.key + "' stands where " + name +
                                     " should; cameras are counted from cam0 without gaps");
      return;
    }
    const auto values = config::read_section<CameraParams>(entry.value, entry.key_mark,
                                                           "camera_models." + name, errors);
    file.camera_models.push_back({values.distortion_model,
                                  static_cast<int>(std::lround(values.resolution[0])),
                                  static_cast<int>(std::lround(values.resolution[1])),
                                  1e-9 * values.line_delay_nanoseconds, entry.key_mark});
  }
}

void read_correlations(const Node& root, CalibrationFile& file, Errors& errors) {
  const Node* const rows = root.find("correlations");
  if (rows == nullptr) return;
  const auto has_sigma = [&](const std::string& name) {
    return std::ranges::any_of(sections(), [&](const Section& section) {
      const CalibrationEntry* const entry = find(file.*section.entries, name);
      return entry != nullptr && entry->sigma > 0.;
    });
  };
  file.correlations = correlations_in(*rows, has_sigma, errors);
}

std::string joined(const std::vector<std::string>& reasons) {
  std::string text;
  for (const std::string& reason : reasons) text += (text.empty() ? "" : "; ") + reason;
  return text;
}

void check_status(const CalibrationFile& file, const config::Mark& mark, Errors& errors) {
  if (file.status != Trust::kDiverged && file.status != Trust::kFailed) return;
  const std::string why = joined(file.reasons);
  const std::string how = file.status == Trust::kDiverged ? "diverged" : "failed";
  errors.add(mark, "this calibration is not to be used: what it is from has " + how +
                       (why.empty() ? "" : " (" + why + ")") +
                       " - calibrate again, or, if you know it to be right, write status: "
                       "doubtful");
}

const char* text_of(Trust status) {
  switch (status) {
    case Trust::kDoubtful:
      return "doubtful";
    case Trust::kDiverged:
      return "diverged";
    case Trust::kFailed:
      return "failed";
    default:
      return "ok";
  }
}

Node number(double value) { return Node::scalar_of(number_text(value)); }

Node entries_node(const Entries& entries) {
  Node section = Node::empty_map();
  for (const CalibrationEntry& entry : entries) {
    Node node = Node::empty_map();
    node.set("estimate", number(entry.estimate));
    node.set("sigma", number(entry.sigma));
    node.set("nominal", number(entry.nominal));
    node.set("unit", Node::scalar_of(entry.unit));
    section.set(entry.name, node);
  }
  return section;
}

Node cameras_node(const std::vector<CalibratedCamera>& cameras) {
  Node section = Node::empty_map();
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    Node node = Node::empty_map();
    const bool is_radtan = cameras[i].distortion == CameraDistortion::kRadtan;
    node.set("distortion_model", Node::scalar_of(is_radtan ? "radtan" : "equidistant"));
    node.set("resolution",
             Node::list_of({number(cameras[i].width_px), number(cameras[i].height_px)}));
    if (const double delay_s = cameras[i].line_delay_s; delay_s > 0.) {
      node.set("line_delay_nanoseconds", number(1e9 * delay_s));
    }
    section.set("cam" + std::to_string(i), node);
  }
  return section;
}

}  // namespace

const CalibrationEntry* find(const Entries& entries, std::string_view name) {
  const auto found = std::find_if(entries.begin(), entries.end(),
                                  [&](const auto& entry) { return entry.name == name; });
  return found != entries.end() ? &*found : nullptr;
}

CalibrationFile read_calibration(const std::filesystem::path& path) {
  const Node root = config::load_file(path);
  Errors errors;
  std::vector<std::string_view> keys{"wheel_sets", "camera_models", "correlations"};
  for (const Section& section : sections()) keys.emplace_back(section.key);
  const auto top = config::read_section<TopParams>(root, root.mark(), "calibration", errors, keys);
  errors.throw_if_any();
  CalibrationFile file;
  file.path = path;
  file.model = top.model;
  file.twist = top.twist;
  for (const double sign : top.drive_signs) {
    if (std::abs(sign) != 1.) {
      errors.add(root.find("drive_signs")->mark(), "drive_signs: 1 or -1 each");
    }
    file.drive_signs.push_back(sign < 0. ? -1 : 1);
  }
  file.status = top.status;
  file.reasons = top.reasons;
  const Node* const model = root.find("model");
  file.model_mark = model != nullptr ? model->mark() : root.mark();
  check_text(file.model_mark, "model", file.model, errors);
  if (const Node* const section = root.find("intrinsics")) file.intrinsics_mark = section->mark();
  const Node* const status = root.find("status");
  check_status(file, status != nullptr ? status->mark() : root.mark(), errors);
  errors.throw_if_any();
  for (const char* key : {"model", "twist", "intrinsics"}) {
    const bool has_wheels = model != nullptr || root.find("intrinsics") != nullptr;
    if (!has_wheels || root.find(key) != nullptr) continue;
    errors.add(root.mark(), std::string("'") + key +
                                "' is missing: model, twist and intrinsics belong together");
  }
  for (const Section& section : sections()) {
    read_entries(root, section, file.*section.entries, errors);
  }
  read_wheel_sets(root, file, errors);
  read_camera_models(root, file, errors);
  if (errors.empty() && model == nullptr &&
      std::all_of(sections().begin(), sections().end(),
                  [&](const Section& section) { return (file.*section.entries).empty(); })) {
    errors.add(root.mark(), "there is nothing of a calibration in this file");
  }
  if (errors.empty()) read_correlations(root, file, errors);
  errors.throw_if_any();
  return file;
}

std::string doubts_of(const CalibrationFile& calibration) {
  if (calibration.status == Trust::kOk) return "";
  const std::string why = joined(calibration.reasons);
  return calibration.path.string() + " is " + text_of(calibration.status) +
         (why.empty() ? "" : ": " + why);
}

std::string calibration_text(const CalibrationFile& calibration, const std::string& written_by) {
  Node root = Node::empty_map();
  if (!calibration.model.empty()) {
    root.set("model", Node::scalar_of(calibration.model));
    root.set("twist", Node::scalar_of(calibration.twist));
  }
  root.set("status", Node::scalar_of(text_of(calibration.status)));
  if (!calibration.reasons.empty()) {
    Node reasons = Node::list_of();
    for (const std::string& reason : calibration.reasons) {
      reasons.items().push_back(Node::scalar_of(reason, {}, true));
    }
    root.set("reasons", reasons);
  }
  if (!calibration.drive_signs.empty()) {
    Node signs = Node::list_of();
    for (const int sign : calibration.drive_signs) {
      signs.items().push_back(Node::scalar_of(std::to_string(sign)));
    }
    root.set("drive_signs", signs);
  }
  for (const auto& [name, model] : calibration.wheel_sets) {
    root.set("wheel_sets",
             root.find("wheel_sets") != nullptr ? *root.find("wheel_sets") : Node::empty_map())
        .set(name, Node::scalar_of(model));
  }
  for (const Section& section : sections()) {
    const Entries& entries = calibration.*section.entries;
    if (!entries.empty()) root.set(section.key, entries_node(entries));
  }
  if (!calibration.camera_models.empty()) {
    root.set("camera_models", cameras_node(calibration.camera_models));
  }
  if (!calibration.correlations.entries.empty()) {
    root.set("correlations", correlations_node(calibration.correlations));
  }
  return "# Written by " + written_by + "; a run starts from it with calibration: FILE.\n" +
         config::to_yaml(root);
}

}  // namespace viwo

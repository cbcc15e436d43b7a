#include "viwo/setup/calibration_file.hpp"

#include <array>
#include <charconv>
#include <vector>

#include "viwo/config/params.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/config/yaml.hpp"

namespace viwo {
namespace {

using config::Node;

struct TopParams {
  std::string model;
  std::string twist;
  Eigen::Vector3d extrinsics_x_m_y_m_yaw_rad{0., 0., 0.};

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(model), {.required = true, .help = "type of the kinematic model"});
    b(VIWO_PARAM(twist), {.choices = "plain|noise_weighted",
                          .required = true,
                          .help = "odometry.twist of the fit: the estimates belong to it"});
    b(VIWO_PARAM(extrinsics_x_m_y_m_yaw_rad), {.help = "pose of O in the reference body"});
  }
};

struct IntrinsicParams {
  double estimate = 0.;
  double sigma = 0.;
  double nominal = 0.;
  std::string unit;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(estimate), {.required = true, .help = "value to run with"});
    b(VIWO_PARAM(sigma), {.min = 0., .required = true, .help = "standard deviation; 0: held"});
    b(VIWO_PARAM(nominal), {.help = "for the reader; not used"});
    b(VIWO_PARAM(unit), {.help = "for the reader; not used"});
  }
};

/// Shortest text that reads back to the same number.
Node number(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return Node::scalar_of(std::string(text.data(), end));
}

}  // namespace

CalibrationFile read_calibration(const std::filesystem::path& file, const WheelModel& model,
                                 const std::string& model_name) {
  const Node root = config::load_file(file);
  config::Errors errors;
  constexpr std::string_view kSections[] = {"intrinsics"};
  const auto top =
      config::read_section<TopParams>(root, root.mark(), "calibration", errors, kSections);
  const Node* intrinsics = root.find("intrinsics");
  if (intrinsics == nullptr || !intrinsics->is_map()) {
    errors.add(root.mark(), "'intrinsics' must be a section with one entry per intrinsic");
  }
  errors.throw_if_any();
  if (top.model != model_name) {
    config::fail(root.find("model")->mark(), "this calibration is for the model '" + top.model +
                                                 "', the run has '" + model_name + "'");
  }
  CalibrationFile calibration;
  calibration.x_WI = model.nominal();
  calibration.sigma = model.prior_sigma();
  calibration.twist = top.twist;
  calibration.extrinsics = top.extrinsics_x_m_y_m_yaw_rad;
  std::vector<std::string> names;
  for (const auto& spec : model.description().intrinsics) names.push_back(spec.name);
  for (const auto& entry : intrinsics->entries()) {
    const int index = model.find(entry.key);
    if (index < 0) {
      errors.add(entry.key_mark, "the model '" + model_name + "' has no intrinsic '" + entry.key +
                                     "'" + config::did_you_mean(entry.key, names));
      continue;
    }
    const std::size_t before = errors.size();
    const auto values = config::read_section<IntrinsicParams>(entry.value, entry.key_mark,
                                                              "intrinsics." + entry.key, errors);
    if (errors.size() > before) continue;
    calibration.x_WI[index] = values.estimate;
    calibration.sigma[index] = values.sigma;
  }
  for (const std::string& name : names) {
    if (intrinsics->find(name) == nullptr) {
      errors.add(intrinsics->mark(), "intrinsic '" + name + "' is missing");
    }
  }
  errors.throw_if_any();
  return calibration;
}

std::string calibration_text(const CalibrationFile& calibration, const WheelModel& model,
                             const std::string& model_name) {
  Node root = Node::empty_map();
  root.set("model", Node::scalar_of(model_name));
  root.set("twist", Node::scalar_of(calibration.twist));
  Node intrinsics = Node::empty_map();
  for (int i = 0; i < model.n_intrinsics(); ++i) {
    const IntrinsicSpec& spec = model.description().intrinsics[static_cast<std::size_t>(i)];
    Node entry = Node::empty_map();
    entry.set("estimate", number(calibration.x_WI[i]));
    entry.set("sigma", number(calibration.sigma[i]));
    entry.set("nominal", number(spec.nominal));
    entry.set("unit", Node::scalar_of(spec.unit));
    intrinsics.set(spec.name, entry);
  }
  root.set("intrinsics", intrinsics);
  Node extrinsics = Node::list_of();
  for (const double value : calibration.extrinsics) extrinsics.items().push_back(number(value));
  root.set("extrinsics_x_m_y_m_yaw_rad", extrinsics);
  return config::to_yaml(root);
}

}  // namespace viwo

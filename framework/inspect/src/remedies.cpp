#include "remedies.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "viwo/config/yaml.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/plausibility/channel_change.hpp"

namespace viwo::inspect {
namespace {

/// "sensors.wheels0.drive" of "sensors.wheels0.drive_scale".
std::string joint_of(const Remedy& remedy) {
  return remedy.key.substr(0, remedy.key.find('_', remedy.key.rfind('.')));
}

std::vector<double> numbers(const config::Node* list) {
  std::vector<double> found;
  if (list == nullptr || !list->is_list()) return found;
  for (const config::Node& item : list->items()) found.push_back(std::stod(item.scalar()));
  return found;
}

std::vector<double> numbers(const Remedy& remedy) {
  const config::Node list = config::parse(remedy.value, "remedy");
  return numbers(&list);
}

std::string text_of(const std::vector<double>& list) {
  return yaml_list(list.size(), [&](std::size_t i) { return significant(list[i], 10); });
}

bool is_scale(const Remedy& remedy) { return remedy.key.ends_with("_scale"); }
bool is_shift(const Remedy& remedy) { return remedy.key.ends_with("_shift_rad"); }
bool is_turn(const Remedy& remedy) { return remedy.key.ends_with("_turn"); }
bool is_order(const Remedy& remedy) { return remedy.key.ends_with("_channel"); }

/// What is found is the place of each joint of the model; the configuration has that of each
/// channel of the log, in which one may be left out, or given several.
void order_channels(const config::Node& configuration, Remedy& remedy) {
  const std::vector<double> places = numbers(remedy);
  std::vector<double> list = channels_of(configuration, remedy);
  if (list.empty()) return;
  for (double& channel : list) {
    const auto i = static_cast<std::size_t>(channel);
    if (i > places.size()) return;
    if (i > 0) channel = places[i - 1];
  }
  remedy.value = text_of(list);
}

/// Scales and shifts are found of the joints of a model; the configuration has them of the channels
/// of the log, of which several may make a joint, or none.
void give_to_channels(const config::Node& configuration, Remedy& remedy) {
  if (!is_scale(remedy) && !is_shift(remedy) && !is_turn(remedy)) return;
  const std::vector<double> channels = channels_of(configuration, remedy);
  if (channels.empty()) return;
  const std::vector<double> of_joints = numbers(remedy);
  std::vector<double> list;
  for (const double channel : channels) {
    const auto i = static_cast<std::size_t>(channel);
    if (i > of_joints.size()) return;
    list.push_back(i == 0 ? (is_scale(remedy) ? 1. : 0.) : of_joints[i - 1]);
  }
  remedy.value = text_of(list);
}

/// What is found is found behind what the configuration does to the channels already: scales
/// multiply, shifts add, turns are those of a reading before its scale (J-1).
void add_to_present(const config::Node& configuration, Remedy& remedy) {
  if (!is_scale(remedy) && !is_shift(remedy) && !is_turn(remedy)) return;
  const std::string key = is_turn(remedy) ? joint_of(remedy) + "_scale" : remedy.key;
  const std::vector<double> there = numbers(configuration.at_path(key));
  std::vector<double> list = numbers(remedy);
  if (there.empty() || list.size() != there.size()) return;
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (is_turn(remedy)) {
      list[i] /= std::abs(there[i]);
      // Degrees, counts and revolutions are whole.
      const double whole = std::round(list[i]);
      if (std::abs(list[i] - whole) < 1e-4 * whole) list[i] = whole;
    } else {
      list[i] = is_scale(remedy) ? list[i] * there[i] : list[i] + there[i];
    }
  }
  remedy.value = text_of(list);
}

bool is_sign(double factor) { return factor == -1.; }

/// What is added to a joint whose sign was found wrong, or taken off a drive for its steering, is
/// of the other sign, too: `list` times the factors of `remedy`.
void scale_with(const Remedy& remedy, const std::string& key, const config::Node& configuration,
                bool signs_alone, std::vector<Remedy>& out) {
  std::vector<double> list = numbers(configuration.at_path(key));
  const std::vector<double> factors = numbers(remedy);
  const auto is_this = [&](const Remedy& other) { return other.key == key; };
  if (list.size() != factors.size() || std::any_of(out.begin(), out.end(), is_this)) return;
  bool changes = false;
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (list[i] == 0. || factors[i] == 1. || (signs_alone && !is_sign(factors[i]))) continue;
    list[i] *= factors[i];
    changes = true;
  }
  if (changes) out.push_back({key, text_of(list)});
}

/// A sensor that knows of units takes what it reads for the other one of two; for those that do
/// not the texts say what to multiply by.
bool is_other_unit(const config::Node& configuration, const Remedy& remedy) {
  const config::Node* const there = configuration.at_path(remedy.key);
  const std::string other = remedy.value == "deg"                          ? "rad"
                            : remedy.value == "g"                          ? "m_per_s2"
                            : remedy.value == "mm" || remedy.value == "cm" ? "m"
                                                                           : "g";
  return there != nullptr && there->is_scalar() && there->scalar() == other;
}

}  // namespace

std::vector<double> channels_of(const config::Node& configuration, const Remedy& remedy) {
  return numbers(configuration.at_path(joint_of(remedy) + "_channel"));
}

void put_into(const config::Node& configuration, std::vector<Remedy>& remedies) {
  std::vector<Remedy> with_them;
  for (Remedy& remedy : remedies) {
    const std::string section = remedy.key.substr(0, remedy.key.rfind('.') + 1);
    const bool is_drive = remedy.key.ends_with(".drive_scale");
    const bool is_steer = remedy.key.ends_with(".steer_scale");
    if (is_drive || is_steer) {  // by joint of the model, as its key is
      scale_with(remedy, section + "drive_per_steer", configuration, is_steer, with_them);
    }
    if (is_order(remedy)) order_channels(configuration, remedy);
    give_to_channels(configuration, remedy);
    if (is_steer) {
      scale_with(remedy, section + "steer_shift_rad", configuration, true, with_them);
    }
    add_to_present(configuration, remedy);
  }
  for (Remedy& one : with_them) {
    const bool is_told = std::any_of(remedies.begin(), remedies.end(),
                                     [&](const Remedy& other) { return other.key == one.key; });
    if (!is_told) remedies.push_back(std::move(one));
  }
  std::erase_if(remedies, [&](const Remedy& remedy) {
    return remedy.key.ends_with("_unit") && !is_other_unit(configuration, remedy);
  });
}

}  // namespace viwo::inspect

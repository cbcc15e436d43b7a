// Objects from plugins: parameters are read and checked here, construction runs in the plugin.
#include <cstring>
#include <type_traits>
#include <utility>

#include "checked_update.hpp"
#include "guarded_model.hpp"
#include "library.hpp"
#include "viwo/api/plugin.hpp"
#include "viwo/config/params.hpp"
#include "viwo/plugin_host/registry.hpp"

namespace viwo {
namespace {

using config::Errors;
using config::Node;

/// All that an object of a plugin refers to. Members are destroyed in reverse order, after the
/// object itself: the models it was given, then its parameters, the library last.
struct Instance {
  std::shared_ptr<const Library> library;
  PluginLog log;
  ParamSet params;
  HostServices services;
  std::vector<std::shared_ptr<KinematicModel>> models;
  void* object = nullptr;

  Instance() = default;
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;
  ~Instance() {
    if (object != nullptr) library->descriptor().destroy(object);
  }

  static void log_text(void* host, LogLevel level, const char* text, std::uint64_t size) {
    const auto& instance = *static_cast<const Instance*>(host);
    try {
      instance.log(instance.library->info(), level, std::string_view(text, size));
    } catch (...) {
      // A message that cannot be written must not unwind through the plugin.
    }
  }
};

template <std::size_t N>
std::string text_of(const std::array<char, N>& text) {
  return {text.data(), strnlen(text.data(), N)};
}

/// The name in `type:`; null after an error. Says what exists if it is missing.
const Node* find_type(const Node& section, const std::string& path, const std::string& known,
                      Errors& errors) {
  if (!section.is_map()) {
    errors.add(section.mark(),
               path + ": expected a section with 'type', got " + std::string(section.kind_text()));
    return nullptr;
  }
  const Node* type = section.find("type");
  if (type == nullptr) {
    errors.add(section.mark(), path + ": 'type' is missing" + known);
    return nullptr;
  }
  if (!type->is_scalar()) {
    errors.add(type->mark(), path + ".type: expected the name of a plugin, got " +
                                 std::string(type->kind_text()));
    return nullptr;
  }
  return type;
}

/// SplitMix64's output function: neighbouring values give unrelated ones.
std::uint64_t mixed(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// Runs the plugin's constructor; false with an entry in `errors` if the user has to mend
/// something.
bool construct(Instance& instance, const Node& section, const std::string& path, Errors& errors) {
  const PluginInfo& info = instance.library->info();
  ErrorText error;
  instance.object =
      instance.library->descriptor().create(&instance.params, &instance.services, &error);
  if (instance.object != nullptr) return true;
  const std::string text = text_of(error.text);
  if (error.cause == ErrorText::kParam) {
    const std::string key = text_of(error.key);
    const Node* value = section.find(key);
    errors.add(value != nullptr ? value->mark() : section.mark(), path + "." + key + ": " + text);
    return false;
  }
  if (error.cause == ErrorText::kInput) {
    errors.add(section.mark(), path + " (" + info.name + "): " + text);
    return false;
  }
  throw PluginFailure(info, "construction",
                      text.empty() ? "create() gave neither an object nor a reason" : text);
}

/// False with an entry in `errors` when a sensor gives samples that others know otherwise.
bool kinds_fit(const Sensor& sensor, const PluginInfo& info, SampleKinds& kinds,
               const Node& section, const std::string& path, Errors& errors) {
  const SampleTypes yields = guarded(info, "yields", [&] { return sensor.yields(); });
  for (const SampleType* type : yields) {
    if (type == nullptr) throw PluginFailure(info, "yields", "gave a null pointer");
    try {
      kinds.require(*type, info);
    } catch (const InputError& error) {
      errors.add(section.mark(), path + ": " + error.what());
      return false;
    }
  }
  return true;
}

}  // namespace

std::uint64_t instance_seed(std::uint64_t run_seed, std::string_view kind, std::string_view path) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  const auto add = [&hash](char c) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  };
  for (const char c : kind) add(c);
  add('\0');  // ("ab", "c") is not ("a", "bc")
  for (const char c : path) add(c);
  return mixed(mixed(run_seed) + hash);
}

template <class Interface>
Loaded<Interface> PluginRegistry::make(const Node& section, const std::string& path,
                                       std::uint64_t seed,
                                       std::span<const std::string_view> other_keys, bool exact,
                                       Errors& errors) {
  constexpr const char* kind = detail::PluginKind<Interface>::kName;
  std::string known;
  for (const std::string& name : names(kind)) known += (known.empty() ? " - known: " : ", ") + name;
  const Node* type = find_type(section, path, known, errors);
  if (type == nullptr) return {};

  const auto instance = std::make_shared<Instance>();
  try {
    instance->library = load(kind, type->scalar());
  } catch (const InputError& error) {
    errors.add(type->mark(), path + ".type: " + error.what());
    return {};
  }
  const PluginInfo& info = instance->library->info();

  std::vector<Loaded<KinematicModel>> models;
  config::ReadContext context;
  context.make_kinematics = [&](const Node& node, const std::string& node_path, Errors& all) {
    models.push_back(
        make_kinematics(node, node_path, instance_seed(seed, "kinematics", node_path), all));
    return static_cast<const KinematicModel*>(models.back().object.get());
  };
  std::vector<std::string_view> keys(other_keys.begin(), other_keys.end());
  keys.emplace_back("type");
  const std::size_t errors_before = errors.size();
  instance->params = config::read_params(section, section.mark(), path + " (" + info.name + ")",
                                         info.params, keys, context, errors);
  if (errors.size() != errors_before) return {};

  instance->log = log_;
  instance->services = {instance.get(), &Instance::log_text, seed, exact};
  for (const auto& model : models) instance->models.push_back(model.object);
  if (!construct(*instance, section, path, errors)) return {};
  if constexpr (std::is_same_v<Interface, Sensor>) {
    const auto& sensor = *static_cast<const Sensor*>(instance->object);
    if (!kinds_fit(sensor, info, *sample_kinds_, section, path, errors)) return {};
  }

  Node resolved = Node::empty_map();
  resolved.set("type", Node::scalar_of(info.name));
  const Node written =
      config::write_params(info.params, instance->params, [&](const KinematicModel& used) {
        for (const auto& model : models) {
          if (model.object.get() == &used) return model.resolved;
        }
        return Node();
      });
  for (const Node::Entry& entry : written.entries()) resolved.set(entry.key, entry.value);
  std::shared_ptr<Interface> object(instance, static_cast<Interface*>(instance->object));
  if constexpr (std::is_same_v<Interface, KinematicModel>) {
    object = std::make_shared<GuardedModel>(std::move(object), info);
  }
  if constexpr (std::is_same_v<Interface, Update>) {
    object = std::make_shared<CheckedUpdate>(std::move(object), info, sample_kinds_);
  }
  return {std::move(object), info, std::move(resolved)};
}

Loaded<KinematicModel> PluginRegistry::make_kinematics(
    const Node& section, const std::string& path, std::uint64_t seed, Errors& errors,
    std::span<const std::string_view> other_keys) {
  return make<KinematicModel>(section, path, seed, other_keys, false, errors);
}

Loaded<Sensor> PluginRegistry::make_sensor(const Node& section, const std::string& path,
                                           std::uint64_t seed, Errors& errors,
                                           std::span<const std::string_view> other_keys,
                                           bool exact) {
  return make<Sensor>(section, path, seed, other_keys, exact, errors);
}

Loaded<Update> PluginRegistry::make_update(const Node& section, const std::string& path,
                                           std::uint64_t seed, Errors& errors,
                                           std::span<const std::string_view> other_keys,
                                           bool exact) {
  return make<Update>(section, path, seed, other_keys, exact, errors);
}

}  // namespace viwo

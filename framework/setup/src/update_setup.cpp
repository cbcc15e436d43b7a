#include "update_setup.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "section.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/setup/start_streams.hpp"

namespace viwo {
namespace {

using config::Errors;
using config::Node;

/// What `call`, into an update, finds wrong is an error of its section; false then.
template <class Call>
bool tell_errors(const FilterSetup::Entry& entry, const std::string& path, Errors& errors,
                 Call&& call) {
  try {
    guarded(entry.update.info, "declare or start", call);
    return true;
  } catch (const InputError& error) {
    errors.add(entry.mark, path + ": " + error.what());
    return false;
  }
}

UpdateEntry as_entry(const FilterSetup::Entry& entry) {
  return {entry.name, entry.update.object, entry.rig, entry.sensor};
}

/// Whether the estimator can work with the updates as they are configured: tried with instances of
/// their own, because an update declares and starts once. Finds out what streams there will be.
void try_updates(FilterSetup& setup, const std::vector<FilterSetup::Entry>& trial,
                 const config::Mark& mark, Errors& errors) {
  DeclarationTable declared;
  bool all_well = true;
  for (const FilterSetup::Entry& entry : trial) {
    const bool well = tell_errors(entry, "updates." + entry.name, errors,
                                  [&] { declared.declare(as_entry(entry)); });
    all_well = all_well && well;
  }
  if (!all_well) return;
  try {
    for (const ExtraStream& stream : start_streams(setup, declared.streams())) {
      declared.add_stream(stream.spec, stream.taker);
    }
    declared.finish();
    const Filter filter(setup.options.filter, declared.blocks(), declared.rooms());
    for (const FilterSetup::Entry& entry : trial) {
      tell_errors(entry, "updates." + entry.name, errors, [&] {
        entry.update.object->start({setup.options.filter.clones + 1, filter.size()});
      });
    }
  } catch (const InputError& error) {
    errors.add(mark, std::string("updates: ") + error.what());
  }
  setup.streams = declared.streams();
}

/// The key `sensor` of an update's section, a sensor of the run; "" without one.
std::string read_sensor(const Node& run, const Node& section, const std::string& path,
                        Errors& errors) {
  const Node* sensor = section.find("sensor");
  if (sensor == nullptr) return "";
  const Node* sensors = run.find("sensors");
  std::vector<std::string> names;
  if (sensors != nullptr && sensors->is_map()) {
    for (const auto& entry : sensors->entries()) names.push_back(entry.key);
  }
  std::string name = sensor->is_scalar() ? sensor->scalar() : "";
  if (std::find(names.begin(), names.end(), name) != names.end()) return name;
  errors.add(sensor->mark(),
             path + ".sensor: no sensor '" + name + "'" + config::did_you_mean(name, names));
  return "";
}

/// The key `enabled` of an update's section.
bool read_enabled(const Node& section, const std::string& path, Errors& errors) {
  const Node* flag = section.find("enabled");
  if (flag == nullptr) return true;
  if (flag->is_scalar() && flag->scalar() == "true") return true;
  if (!flag->is_scalar() || flag->scalar() != "false") {
    errors.add(flag->mark(), path + ".enabled must be true or false");
    return true;
  }
  return false;
}

constexpr std::string_view kUpdateHostKeys[] = {"enabled", "sensor"};

/// Makes updates from their sections.
class UpdateReader {
 public:
  UpdateReader(const Node& run, const ReadContext& context, FilterSetup& setup, Errors& errors)
      : run_(run),
        context_(context),
        setup_(setup),
        errors_(errors),
        rig_is_read_(errors.empty()) {}

  void read(const Node& updates, Node& resolved) {
    for (const auto& entry : updates.entries()) {
      Node section = entry.value.is_null() ? Node::empty_map(entry.value.mark()) : entry.value;
      if (!section.is_map()) {
        errors_.add(section.mark(),
                    "updates." + entry.key + " must be a section of parameters ({} for none)");
        continue;
      }
      if (!is_name(entry, "updates", errors_)) continue;
      // The name says which update it is unless it says so itself.
      if (section.find("type") == nullptr) {
        section.set("type", Node::scalar_of(entry.key, entry.key_mark));
      }
      read_one(entry.key, entry.key_mark, section, resolved);
    }
  }

  /// All of them together.
  void try_all(const config::Mark& mark) {
    if (errors_.empty()) try_updates(setup_, trial_, mark, errors_);
  }

 private:
  /// `name`: of the instance, which has a seed of its own.
  Loaded<Update> make(const Node& section, const std::string& path, const std::string& name) {
    const std::uint64_t seed = instance_seed(context_.seed, "update", "updates." + name);
    return context_.plugins.make_update(section, path, seed, errors_, kUpdateHostKeys,
                                        context_.exact);
  }

  /// make(), for when the section has been read.
  std::function<Loaded<Update>()> maker(const Node& section, const std::string& path,
                                        const std::string& name) {
    return [plugins = &context_.plugins, exact = context_.exact, section, path,
            seed = instance_seed(context_.seed, "update", "updates." + name)] {
      Errors errors;
      Loaded<Update> loaded =
          plugins->make_update(section, path, seed, errors, kUpdateHostKeys, exact);
      errors.throw_if_any();
      return loaded;
    };
  }

  void read_one(const std::string& name, const config::Mark& mark, const Node& section,
                Node& resolved) {
    const std::string path = "updates." + name;
    const std::size_t before = errors_.size();
    const bool enabled = read_enabled(section, path, errors_);
    const std::string sensor = read_sensor(run_, section, path, errors_);
    Loaded<Update> loaded = make(section, path, name);
    if (!loaded.object) return;
    Node resolved_update = loaded.resolved;
    resolved_update.set("enabled", Node::scalar_of(enabled ? "true" : "false"));
    if (!sensor.empty()) resolved_update.set("sensor", Node::scalar_of(sensor));
    resolved.set(name, resolved_update, mark);
    // Without cameras and wheels that could be read, what it lacks says nothing.
    if (errors_.size() > before || !rig_is_read_) return;
    if (!enabled) {
      note_measured({name, std::move(loaded), nullptr, sensor, mark}, path);
      return;
    }
    add_instances({name, std::move(loaded), nullptr, sensor, mark}, section, path);
  }

  /// The sensors of which an update takes poses: those are measurements and not the reference.
  void note_measured(const DeclarationTable& declared) {
    for (const SharedStream& stream : declared.streams()) {
      if (!(*stream.spec.type == sample_type<PoseSample>())) continue;
      setup_.measuring.push_back(stream.spec.sensor);
    }
  }

  /// The same for one that is turned off, as far as it could work.
  void note_measured(FilterSetup::Entry entry, const std::string& path) {
    if (entry.sensor.empty()) return;
    const auto& sets = setup_.wheels;
    entry.rig = rig_with(sets.empty() ? nullptr : &sets.front());
    DeclarationTable alone;
    Errors nobody_minds;
    tell_errors(entry, path, nobody_minds, [&] { alone.declare(as_entry(entry)); });
    note_measured(alone);
  }

  /// A name of a sensor that nothing is taken from.
  void refuse_idle_sensor(const FilterSetup::Entry& entry, const std::string& path,
                          const DeclarationTable& declared) {
    const auto& streams = declared.streams();
    const bool is_taken = std::any_of(streams.begin(), streams.end(), [&](const auto& stream) {
      return stream.spec.sensor == entry.sensor;
    });
    if (is_taken || entry.sensor.empty()) return;
    errors_.add(entry.mark, path + ".sensor: it takes nothing from a sensor that is named here");
  }

  /// One instance, or one for each wheel set if it asks for one.
  void add_instances(const FilterSetup::Entry& entry, const Node& section,
                     const std::string& path) {
    FilterSetup::Entry first = entry;
    first.update = make(section, path, entry.name);
    const auto& sets = setup_.wheels;
    first.rig = rig_with(sets.empty() ? nullptr : &sets.front());
    DeclarationTable alone;  // what contradicts others comes later
    const bool well = tell_errors(first, path, errors_, [&] { alone.declare(as_entry(first)); });
    if (!well) return;
    note_measured(alone);
    refuse_idle_sensor(first, path, alone);
    const bool for_wheels = first.rig->was_asked_for_wheels();
    const std::size_t n = for_wheels ? sets.size() : 1;
    for (std::size_t i = 0; i < n; ++i) {
      FilterSetup::Entry instance = entry;
      instance.rig = rig_with(for_wheels ? &sets[i] : nullptr);
      if (for_wheels && !sets[i].prior.name.empty()) {
        instance.name = sets[i].prior.name + "." + entry.name;
      }
      if (instance.name != entry.name) instance.update = make(section, path, instance.name);
      FilterSetup::Entry trial = instance;
      trial.update = make(section, path, instance.name);
      trial.rig = rig_with(for_wheels ? &sets[i] : nullptr);
      instance.make_again = maker(section, path, instance.name);
      trial_.push_back(std::move(trial));
      setup_.updates.push_back(std::move(instance));
    }
  }

  std::shared_ptr<Rig> rig_with(const WheelSet* set) const {
    return std::make_shared<Rig>(setup_.cameras,
                                 set != nullptr ? std::optional(set->prior) : std::nullopt);
  }

  const Node& run_;
  const ReadContext& context_;
  FilterSetup& setup_;
  Errors& errors_;
  bool rig_is_read_;
  std::vector<FilterSetup::Entry> trial_;
};

}  // namespace

void read_updates(const Node& run, const ReadContext& context, FilterSetup& setup, Node& resolved,
                  Errors& errors) {
  UpdateReader reader(run, context, setup, errors);
  const Node* updates = run.find("updates");
  if (updates != nullptr && !updates->is_map()) {
    errors.add(updates->mark(), "'updates' is a section NAME: {its parameters}");
    return;
  }
  if (updates != nullptr) {
    Node resolved_updates = Node::empty_map(updates->mark());
    reader.read(*updates, resolved_updates);
    resolved.set("updates", resolved_updates);
  }
  reader.try_all(updates != nullptr ? updates->mark() : run.mark());
}

Estimator make_estimator(const FilterSetup& setup, bool live) {
  EstimatorOptions options = setup.options;
  // What a tracker finds in the images of two cameras at one instant comes one after the other.
  if (live) options.schedule.max_instant_wait_s = 0.05;
  std::vector<UpdateEntry> updates;
  for (const FilterSetup::Entry& entry : setup.updates) updates.push_back(as_entry(entry));
  return {options, std::move(updates), start_streams(setup, setup.streams)};
}

}  // namespace viwo

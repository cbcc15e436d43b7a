#include "update_declarations.hpp"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "viwo/estimator/declarations.hpp"
#include "viwo/plugin_host/sample_kinds.hpp"
#include "viwo/robot/robot.hpp"

namespace viwo::conformance {

using namespace robot;

namespace {

/// One call of Declarations, as text.
struct Declared {
  std::string what;  ///< "the block 'wheels.clock'"
  std::vector<std::string> details;
};

std::vector<std::string> details_of(const BlockSpec& spec) {
  constexpr const char* kProcesses[] = {"constant", "random walk", "Gauss-Markov"};
  constexpr const char* kExcitations[] = {"planar", "clock", "tilt"};
  std::vector<std::string> details{std::to_string(spec.rotations) + " rotations",
                                   "group '" + spec.group + "'",
                                   kProcesses[static_cast<std::size_t>(spec.process)] +
                                       std::string(" of ") + number(spec.time_constant_s) + " s"};
  for (const BlockEntry& entry : spec.entries) {
    details.push_back("'" + entry.name + "' in '" + entry.unit + "', sigma " + number(entry.sigma) +
                      ", process sigma " + number(entry.process_sigma) + ", needs " +
                      kExcitations[static_cast<std::size_t>(entry.needs)]);
  }
  for (const double value : spec.value) details.push_back("value " + number(value));
  return details;
}

std::vector<std::string> details_of(const StreamSpec& spec) {
  std::vector<std::string> details{
      "sensor '" + spec.sensor + "'",
      spec.given == Given::kOnce ? "given once" : "given since the oldest clone",
      std::string(spec.ends_epochs ? "ends" : "does not end") + " epochs",
      spec.awaited ? "awaited" : "not awaited",
      spec.optional ? "optional" : "needed",
      std::to_string(spec.per_instant) + " per instant"};
  for (const StreamSpec::Clock& clock : spec.clocks) {
    details.push_back("clock of block " + std::to_string(clock.block.index) + " and " +
                      number(clock.constant_s) + " s");
  }
  return details;
}

/// Hands declarations on and writes them down.
class Recorder final : public Update, public Declarations {
 public:
  explicit Recorder(const Subject& subject) : plugin_(subject.make<Update>()) {}

  void declare(Declarations& host) override {
    host_ = &host;
    plugin_.object->declare(*this);
  }
  void update(const FilterView&, const EpochData&, FactorSink&) override {}

  Rig& rig() override { return host_->rig(); }
  BlockId block(const BlockSpec& spec) override {
    declared.push_back({"the block '" + spec.name + "'", details_of(spec)});
    return host_->block(spec);
  }
  BlockId block(std::string_view name) override {
    declared.push_back({"the block '" + std::string(name) + "' of somebody else", {}});
    return host_->block(name);
  }
  RoomId room(const RoomSpec& spec) override {
    declared.push_back({"the room '" + spec.name + "'",
                        {std::to_string(spec.blocks) + " blocks of " +
                         std::to_string(spec.entries) + " entries"}});
    return host_->room(spec);
  }
  StreamId stream(const StreamSpec& spec) override {
    if (spec.type != nullptr) types.push_back(spec.type);
    declared.push_back(
        {"a stream of '" + std::string(spec.type ? spec.type->name : "") + "'", details_of(spec)});
    return host_->stream(spec);
  }

  std::vector<Declared> declared;
  SampleTypes types;

 private:
  Loaded<Update> plugin_;
  Declarations* host_ = nullptr;
};

/// A table beside the neighbour's declarations; what declare() throws passes.
void declare(const std::shared_ptr<Recorder>& update, const std::string& name,
             DeclarationTable& table) {
  table.declare({kNeighbour, make_neighbour(), robot_rig(Calibration::kEstimated), ""});
  table.declare({name, update, robot_rig(Calibration::kEstimated), ""});
}

/// "" when both are the same.
std::string difference(const std::vector<Declared>& a, const std::vector<Declared>& b) {
  for (std::size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
    const std::string left = i < a.size() ? a[i].what : "nothing more";
    const std::string right = i < b.size() ? b[i].what : "nothing more";
    if (left != right) return left + " in one, " + right + " in the other";
    for (std::size_t k = 0; k < std::max(a[i].details.size(), b[i].details.size()); ++k) {
      const std::string one = k < a[i].details.size() ? a[i].details[k] : "nothing more";
      const std::string other = k < b[i].details.size() ? b[i].details[k] : "nothing more";
      if (one != other) return left + ": " + one + " in one, " + other + " in the other";
    }
  }
  return "";
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "'" : ", '") + name + "'";
  return text;
}

}  // namespace

void check_declarations(const Subject& subject, Findings& findings) {
  std::vector<std::shared_ptr<Recorder>> instances;
  for (int k = 0; k < 2; ++k) {
    instances.push_back(std::make_shared<Recorder>(subject));
    DeclarationTable table;
    try {
      declare(instances.back(), subject.info().name, table);
    } catch (const InputError& error) {
      findings.warn(kRobot);
      return findings.fail("declare(): " + std::string(error.what()));
    } catch (const std::exception& error) {
      return findings.fail("declare() threw '" + std::string(error.what()) +
                           "' - throw InputError for what the configuration lacks");
    }
  }
  const std::string differs = difference(instances[0]->declared, instances[1]->declared);
  if (!differs.empty()) {
    findings.fail("two instances declare differently: " + differs +
                  " - what is declared may depend on parameters and configuration alone");
  }
  for (const Declared& one : instances[0]->declared) findings.note("declares " + one.what);
}

Unmet unmet_needs(const Subject& subject) {
  const auto instance = std::make_shared<Recorder>(subject);
  DeclarationTable table;
  declare(instance, subject.info().name, table);
  std::vector<std::string> blocks, kinds;
  for (const BlockSpec& spec : table.blocks()) {
    if (spec.entries.empty()) blocks.push_back(spec.name);
  }
  const SampleTypes known = built_in_sample_types();
  for (const SampleType* type : instance->types) {
    const bool is_known = std::any_of(known.begin(), known.end(),
                                      [&](const SampleType* one) { return *one == *type; });
    if (!is_known) kinds.emplace_back(type->name);
  }
  Unmet unmet;
  if (!blocks.empty()) {
    unmet.blocks = "needs " + listed(blocks) + ", blocks of other updates, which these checks lack";
  }
  if (!kinds.empty()) {
    unmet.samples =
        "takes samples of kinds that the robot of these checks does not give: " + listed(kinds) +
        " - try it in a run with the sensor that does";
  }
  return unmet;
}

}  // namespace viwo::conformance

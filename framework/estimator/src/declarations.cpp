#include "viwo/estimator/declarations.hpp"

#include <algorithm>

#include "viwo/api/status.hpp"
#include "viwo/estimator/information_window.hpp"
#include "viwo/filter/state_blocks.hpp"

namespace viwo {
namespace {

std::string in_quotes(std::string_view text) { return "'" + std::string(text) + "'"; }

/// Where two specs of one name differ: "sigmas of 'x'".
std::string difference(const BlockSpec& a, const BlockSpec& b) {
  if (a.entries.size() != b.entries.size()) {
    return std::to_string(a.entries.size()) + " and " + std::to_string(b.entries.size()) +
           " entries";
  }
  for (std::size_t i = 0; i < a.entries.size(); ++i) {
    const BlockEntry &left = a.entries[i], &right = b.entries[i];
    if (left == right) continue;
    if (left.name != right.name) {
      return "entries " + in_quotes(left.name) + " and " + in_quotes(right.name);
    }
    if (left.unit != right.unit) {
      return in_quotes(left.name) + " in " + in_quotes(left.unit) + " and " + in_quotes(right.unit);
    }
    return (left.needs != right.needs ? "what is needed to learn " : "sigmas of ") +
           in_quotes(left.name);
  }
  if (a.rotations != b.rotations) return "retractions";
  if (a.value != b.value) return "values";
  return a.group != b.group ? "groups" : "processes";
}

}  // namespace

/// The host as one update sees it while it declares.
class UpdateDeclarations final : public Declarations {
 public:
  UpdateDeclarations(DeclarationTable& table, const UpdateEntry& entry, std::size_t index)
      : table_(&table), name_(entry.name), sensor_(entry.sensor), rig_(entry.rig), index_(index) {
    if (rig_ == nullptr) rig_ = std::make_shared<Rig>();
  }
  void close() { table_ = nullptr; }

  Rig& rig() override {
    table();
    return *rig_;
  }
  BlockId block(const BlockSpec& spec) override { return table().block(spec, name_); }
  BlockId block(std::string_view name) override { return table().named(name, name_); }
  RoomId room(const RoomSpec& spec) override {
    if (const std::string fault = fault_of(spec); !fault.empty()) {
      throw InputError("room " + in_quotes(spec.name) + ": " + fault);
    }
    DeclarationTable& all = table();
    all.rooms_.push_back(spec);
    all.room_owners_.push_back(index_);
    return {static_cast<int>(all.rooms_.size()) - 1};
  }
  StreamId stream(const StreamSpec& spec) override {
    StreamSpec own = spec;
    if (own.sensor.empty()) own.sensor = sensor_;
    return table().add_stream(own, name_, index_);
  }

 private:
  DeclarationTable& table() {
    if (table_ == nullptr) throw ContractError("declares something after the start");
    return *table_;
  }

  DeclarationTable* table_;
  std::string name_, sensor_;
  std::shared_ptr<Rig> rig_;
  std::size_t index_;
};

DeclarationTable::DeclarationTable() = default;
DeclarationTable::~DeclarationTable() = default;
DeclarationTable::DeclarationTable(DeclarationTable&&) noexcept = default;
DeclarationTable& DeclarationTable::operator=(DeclarationTable&&) noexcept = default;

void DeclarationTable::declare(const UpdateEntry& entry) {
  updates_.push_back(std::make_unique<UpdateDeclarations>(*this, entry, updates_.size()));
  try {
    entry.update->declare(*updates_.back());
  } catch (...) {
    updates_.back()->close();
    throw;
  }
  updates_.back()->close();
}

DeclarationTable::Block& DeclarationTable::find_or_add(std::string_view name,
                                                       const std::string& who) {
  const auto known = std::find_if(blocks_.begin(), blocks_.end(),
                                  [&](const Block& block) { return block.spec.name == name; });
  if (known != blocks_.end()) return *known;
  Block& block = blocks_.emplace_back();
  block.spec.name = name;
  block.wanted = who;
  return block;
}

void DeclarationTable::require_new_entries(const BlockSpec& spec, const std::string& owner) const {
  for (const Block& other : blocks_) {
    for (const BlockEntry& entry : spec.entries) {
      const auto same = [&](const BlockEntry& known) { return known.name == entry.name; };
      if (std::none_of(other.spec.entries.begin(), other.spec.entries.end(), same)) continue;
      throw InputError("update " + in_quotes(owner) + ": the entry " + in_quotes(entry.name) +
                       " of its block " + in_quotes(spec.name) + " is also one of the block " +
                       in_quotes(other.spec.name) + " of update " + in_quotes(other.owner));
    }
  }
}

BlockId DeclarationTable::block(const BlockSpec& spec, const std::string& owner) {
  if (const std::string fault = fault_of(spec); !fault.empty()) {
    throw InputError("block " + in_quotes(spec.name) + ": " + fault);
  }
  Block& block = find_or_add(spec.name, owner);
  if (block.owner.empty()) {
    require_new_entries(spec, owner);
    block.spec = spec;
    block.owner = owner;
  } else if (!(block.spec == spec)) {
    throw InputError("updates " + in_quotes(block.owner) + " and " + in_quotes(owner) +
                     " declare the block " + in_quotes(spec.name) +
                     " differently: " + difference(block.spec, spec));
  }
  return {static_cast<int>(&block - blocks_.data())};
}

BlockId DeclarationTable::named(std::string_view name, const std::string& who) {
  return {static_cast<int>(&find_or_add(name, who) - blocks_.data())};
}

StreamId DeclarationTable::add_stream(const StreamSpec& spec, const std::string& taker,
                                      std::size_t update) {
  if (spec.type == nullptr) throw InputError("a stream without a kind of samples");
  const auto same = [&](const SharedStream& known) {
    return known.spec.type->has_name_of(*spec.type) && known.spec.sensor == spec.sensor;
  };
  auto known = std::find_if(streams_.begin(), streams_.end(), same);
  if (known == streams_.end()) {
    known = streams_.insert(known, {spec, taker});
  } else {
    StreamSpec& shared = known->spec;
    if (!(*shared.type == *spec.type)) {
      throw InputError(in_quotes(known->takers) + " and " + in_quotes(taker) + " were built with " +
                       spec.type->name + " of different versions or layouts (" +
                       std::to_string(shared.type->version) + " and " +
                       std::to_string(spec.type->version) + ")");
    }
    if (shared.clocks.empty()) shared.clocks = spec.clocks;
    if (!spec.clocks.empty() && shared.clocks != spec.clocks) {
      throw InputError(in_quotes(known->takers) + " and " + in_quotes(taker) +
                       " take the clock of the " + spec.type->name + " from different blocks");
    }
    shared.ends_epochs = shared.ends_epochs || spec.ends_epochs;
    shared.awaited = shared.awaited || spec.awaited;
    shared.optional = shared.optional && spec.optional;
    shared.per_instant = std::max(shared.per_instant, spec.per_instant);
    known->takers += ", " + taker;
  }
  known->keeps = known->keeps || spec.given == Given::kSinceOldestClone;
  taken_.push_back({static_cast<std::size_t>(known - streams_.begin()), spec.given, update});
  return {static_cast<int>(taken_.size()) - 1};
}

void DeclarationTable::finish() const {
  require_owners();
  require_clocks();
  require_groups();
}

void DeclarationTable::require_owners() const {
  for (const Block& block : blocks_) {
    if (!block.owner.empty()) continue;
    std::string declared;
    for (const Block& other : blocks_) {
      if (!other.owner.empty()) declared += (declared.empty() ? "" : ", ") + other.spec.name;
    }
    throw InputError(
        "update " + in_quotes(block.wanted) + " needs the block " + in_quotes(block.spec.name) +
        ", which nobody declares - declared are: " + (declared.empty() ? "none" : declared));
  }
}

void DeclarationTable::require_clocks() const {
  for (const SharedStream& stream : streams_) {
    for (const StreamSpec::Clock& clock : stream.spec.clocks) {
      if (clock.block.index < 0) continue;
      const BlockSpec& spec = blocks_.at(static_cast<std::size_t>(clock.block.index)).spec;
      if (spec.entries.size() == 1) continue;
      throw InputError("the block " + in_quotes(spec.name) + " is no clock for the " +
                       stream.spec.type->name + " of " + in_quotes(stream.takers) + ": it has " +
                       std::to_string(spec.entries.size()) + " entries, not one");
    }
  }
}

void DeclarationTable::require_groups() const {
  for (const Block& block : blocks_) {
    const std::string& group = block.spec.group;
    if (group.empty()) continue;
    bool has_pose = false;
    std::size_t entries = 0;
    for (const Block& other : blocks_) {
      if (other.spec.group != group) continue;
      has_pose = has_pose || is_pose(other.spec);
      entries += static_cast<std::size_t>(
          std::count_if(other.spec.entries.begin(), other.spec.entries.end(),
                        [](const BlockEntry& entry) { return entry.sigma > 0.; }));
    }
    if (!has_pose)
      throw InputError("the group " + in_quotes(group) + " has no block that is a pose");
    if (entries <= InformationWindow::kMaxParameters) continue;
    throw InputError("the group " + in_quotes(group) + " has " + std::to_string(entries) +
                     " entries to be estimated, at most " +
                     std::to_string(InformationWindow::kMaxParameters) + " can be watched");
  }
}

std::vector<BlockSpec> DeclarationTable::blocks() const {
  std::vector<BlockSpec> specs;
  for (const Block& block : blocks_) specs.push_back(block.spec);
  return specs;
}

}  // namespace viwo

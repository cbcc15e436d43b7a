#include "update_watch.hpp"

#include <algorithm>

#include "update_faults.hpp"

namespace viwo::conformance {
namespace {

constexpr int kMaxFactors = 16;  // that the estimator has room for in an epoch

void add(const AddedBlock& block, Digest& out) {
  out.add(block.id.index);
  for (const double value : block.value) out.add(value);
}

/// Hands edits on.
class WatchedEdits final : public BlockEdits {
 public:
  explicit WatchedEdits(BlockEdits& host) : host_(host) {}
  void drop(BlockId id) override {
    digest_.add(id.index);
    host_.drop(id);
  }
  void rewrite(const BlockRewrite& block) override {
    digest_.add(block.id.index);
    digest_.add(block.columns);
    digest_.add(block.J);
    host_.rewrite(block);
  }
  std::uint64_t digest() const { return digest_.value(); }

 private:
  BlockEdits& host_;
  Digest digest_;
};

}  // namespace

void Watch::start(const UpdateSetup& setup) {
  plugin_.object->start(setup);
  sink_ = FactorSink(kMaxFactors, setup.max_state_size);
}

/// The first finding of its kind.
void Watch::fail_once(const std::string& what, const std::string& text) {
  if (findings_ != nullptr && reported_.insert(what).second) findings_->fail(text);
}

/// False when `call`, the function `name` of the plugin, has thrown.
template <class Call>
bool Watch::returns(const std::string& name, const Remedies& remedies, Call&& call) {
  std::string what = name + " threw something that is not a std::exception";
  const char* remedy = remedies.of_exception;
  try {
    call();
    return true;
  } catch (const ContractError& error) {
    what = name + " " + error.what();
    remedy = remedies.of_breach;
  } catch (const std::exception& error) {
    what = name + " threw '" + error.what() + "'";
  } catch (...) {
  }
  fail_once(what, what + " in " + where() + remedy);
  return false;
}

void Watch::update(const FilterView& filter, const EpochData& given, FactorSink& sink) {
  static const std::vector<BlockId> kNone;
  EpochData data = given;
  if (options_.spoil) options_.spoil(static_cast<int>(digests_.size()), data);
  digests_.push_back(0);
  sink_.rooms() = sink.rooms();
  for (FactorSink::FreeBlocks& room : sink_.rooms()) {
    if (options_.full_rooms && room.free != nullptr) room.free = &kNone;
  }
  clear_and_mark(sink_, kMaxFactors);
  const Remedies remedies{" - leave out what cannot be used, and count it in rejections()", ""};
  if (!returns("update()", remedies, [&] { plugin_.object->update(filter, data, sink_); })) return;
  Digest digest;
  digest.add(digest_of(sink_));
  for (const AddedBlock& block : sink_.added()) add(block, digest);
  digests_.back() = digest.value();
  if (check(filter) && !options_.spoil) pass_on(sink);
}

void Watch::settle(const FilterView& filter, BlockEdits& edits) {
  WatchedEdits watched(edits);
  const Remedies remedies{"", " - only blocks that it has added itself, as long as they exist"};
  returns("settle()", remedies, [&] { plugin_.object->settle(filter, watched); });
  digests_.back() ^= watched.digest();
}

/// Whether what was emitted can be given to the filter.
bool Watch::check(const FilterView& filter) {
  const bool numbers_matter = !options_.spoil;
  bool good = true;
  int i = 0;
  for (const ResidualFactor& factor : sink_.residuals()) {
    const std::string what = "residual factor " + std::to_string(i++);
    good = report(what, overrun_of(factor)) &&
           report(what, fault_of(factor, filter.size, numbers_matter)) && good;
  }
  if (const InformationFactor* factor = sink_.information();
      factor != nullptr && factor->columns.size() > 0) {
    good = report("information factor", fault_of(*factor, filter.size, numbers_matter)) && good;
    ++i;
  }
  for (const AddedBlock& block : sink_.added()) {
    good = report("added block", fault_of(block, filter, sink_, numbers_matter)) && good;
  }
  if (sink_.applied() < 0 || sink_.rejected() < 0) report("count()", "is below zero");
  factors_ += i;
  added_blocks_ += static_cast<std::int64_t>(sink_.added().size());
  return good;
}

bool Watch::report(const std::string& what, const std::string& fault) {
  if (fault.empty()) return true;
  fail_once(what, what + " of " + where() + ": " + fault);
  return false;
}

void Watch::pass_on(FactorSink& sink) {
  for (const ResidualFactor& factor : sink_.residuals()) sink.add_residual() = factor;
  if (const InformationFactor* factor = sink_.information()) sink.add_information() = *factor;
  for (const AddedBlock& block : sink_.added()) {
    const auto& rooms = sink_.rooms();
    const auto room = std::find_if(rooms.begin(), rooms.end(), [&](const auto& one) {
      return one.free != nullptr &&
             std::find(one.free->begin(), one.free->end(), block.id) != one.free->end();
    });
    // In the same order they get the same ids.
    sink.add_block({static_cast<int>(room - rooms.begin())},
                   std::span(block.value.data(), static_cast<std::size_t>(room->entries)));
  }
  sink.count(sink_.applied(), sink_.rejected());
}

}  // namespace viwo::conformance

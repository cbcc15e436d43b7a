#include "viwo/estimator/update_runner.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <type_traits>
#include <utility>

#include "viwo/api/status.hpp"
#include "viwo/estimator/factor_fit.hpp"
#include "viwo/plugin_host/plugin_info.hpp"

namespace viwo {
namespace {

constexpr int kMaxFactorsPerUpdate = 16;
constexpr const char* kNoFactor =
    "residual factor that is not finite, or whose noise is not positive definite";
constexpr const char* kUndetermined = "new blocks that no information determines";

struct Thrown {
  std::string text;
  bool in_breach = false;  ///< of the contract
};

/// What `call`, into an update, threw; nothing if it returned. What a model threw, and input that
/// the user has to mend, passes.
template <class Call>
std::optional<Thrown> thrown_by(Call&& call) {
  try {
    call();
    return std::nullopt;
  } catch (const PluginFailure&) {
    throw;
  } catch (const InputError&) {
    throw;
  } catch (const ContractError& error) {
    return Thrown{error.what(), true};
  } catch (const std::exception& error) {
    return Thrown{error.what()};
  } catch (...) {
    return Thrown{"threw something that is not a std::exception"};
  }
}

/// residual -= H dx: the factor as it would be at an estimate that has moved by dx since.
void take_off(const Eigen::VectorXd& dx, ResidualFactor& factor) {
  int start = 0;
  for (const ColumnRange& block : factor.columns.blocks()) {
    factor.residual.noalias() -=
        factor.H.middleCols(start, block.count).lazyProduct(dx.segment(block.first, block.count));
    start += block.count;
  }
}

/// eta -= Lambda dx, likewise.
void take_off(const Eigen::VectorXd& dx, InformationFactor& factor) {
  int col = 0;
  for (const ColumnRange& block : factor.columns.blocks()) {
    for (int i = 0; i < block.count; ++i, ++col) {
      const double step = dx[block.first + i];
      for (int row = 0; row < factor.columns.size(); ++row) {
        factor.eta[row] -= step * factor.Lambda(std::max(row, col), std::min(row, col));
      }
    }
  }
}

/// ContractError for a factor that does not fit the state, or itself.
void require_fitting(const FactorSink& sink, const Filter& filter) {
  const auto require = [&](const char* what, const auto& factor) {
    const std::string misfit = misfit_of(factor, filter.size());
    if (!misfit.empty()) throw ContractError(std::string(what) + ": " + misfit);
  };
  for (const ResidualFactor& factor : sink.residuals()) require("a residual factor", factor);
  if (sink.information() != nullptr) require("an information factor", *sink.information());
}

/// Blocks of the rooms of one update; nobody else's.
class OwnBlocks final : public BlockEdits {
 public:
  OwnBlocks(Filter& filter, const std::vector<std::size_t>& room_owners, std::size_t update,
            EstimatorObserver* observer)
      : filter_(filter), room_owners_(room_owners), update_(update), observer_(observer) {}

  void drop(BlockId id) override {
    require_own(id, "drops");
    if (observer_ != nullptr) observer_->on_drop(filter_, id);
    filter_.drop(id);
  }
  void rewrite(const BlockRewrite& block) override {
    require_own(block.id, "rewrites");
    const int entries = filter_.blocks().view(block.id).size();
    if (block.J.rows() != entries || block.J.cols() != block.columns.size()) {
      throw ContractError("rewrites a block with a Jacobian of another size");
    }
    if (const std::string misfit = misfit_of(block.columns, filter_.size()); !misfit.empty()) {
      throw ContractError("rewrites a block: " + misfit);
    }
    const auto is_finite = [entries](const std::array<double, kMaxRoomEntries>& values) {
      return std::all_of(values.begin(), values.begin() + entries,
                         [](double value) { return std::isfinite(value); });
    };
    if (!block.J.allFinite() || !is_finite(block.value) || !is_finite(block.first_estimate)) {
      throw ContractError("rewrites a block with what is not finite");
    }
    filter_.rewrite(block);
  }

 private:
  void require_own(BlockId id, const char* does) const {
    const int room = filter_.blocks().room_of(id);
    if (room < 0 || room_owners_[static_cast<std::size_t>(room)] != update_) {
      throw ContractError(std::string(does) + " a block that is not its own");
    }
    if (!filter_.blocks().exists(id)) {
      throw ContractError(std::string(does) + " a block that does not exist (any more)");
    }
  }

  Filter& filter_;
  const std::vector<std::size_t>& room_owners_;
  std::size_t update_;
  EstimatorObserver* observer_;
};

}  // namespace

/// What one update's turn is about.
struct UpdateRunner::Context {
  std::size_t index;
  Filter& filter;
  std::vector<ExcitationMonitor>& monitors;
};

UpdateRunner::UpdateRunner(const RunnerOptions& options, std::vector<UpdateEntry> updates,
                           const DeclarationTable& declared, const Filter& filter)
    : options_(options),
      updates_(std::move(updates)),
      counts_(updates_.size()),
      failures_(updates_.size()),
      gated_(updates_.size()),
      weakened_(updates_.size()),
      rejected_(updates_.size()),
      sink_(kMaxFactorsPerUpdate, filter.size()),
      moved_(Eigen::VectorXd::Zero(filter.size())),
      information_factor_{{},
                          Eigen::MatrixXd::Zero(filter.size(), filter.size()),
                          Eigen::VectorXd::Zero(filter.size())} {
  for (std::size_t room = 0; room < declared.rooms().size(); ++room) {
    room_owners_.push_back(declared.owner_of(room));
  }
  sink_.rooms().resize(room_owners_.size());
  for (const DeclarationTable::Taken& taken : declared.taken()) {
    stream_takers_.push_back(taken.update);
  }
  own_streams_.resize(stream_takers_.size());
  UpdateSetup setup;
  setup.max_clones = filter.options().clones + 1;
  setup.max_state_size = filter.size();
  for (const UpdateEntry& entry : updates_) {
    if (const auto thrown = thrown_by([&] { entry.update->start(setup); })) {
      throw UpdateFailure(entry.name, thrown->text);
    }
  }
}

void UpdateRunner::rejections(std::vector<RejectionCount>& out) const {
  for (std::size_t k = 0; k < updates_.size(); ++k) {
    const std::size_t before = out.size();
    updates_[k].update->rejections(out);
    gated_[k].append_to("measurement dropped by the chi-square gate", out);
    weakened_[k].append_to("measurement beyond the chi-square gate, weighed down", out);
    rejected_[k].append_to(out);
    for (std::size_t i = before; i < out.size(); ++i) {
      out[i].reason = updates_[k].name + ": " + out[i].reason;
    }
  }
}

void UpdateRunner::noises(std::vector<NoiseFound>& out) const {
  for (const UpdateEntry& entry : updates_) {
    const std::size_t before = out.size();
    entry.update->noises(out);
    for (std::size_t i = before; i < out.size(); ++i) out[i].name = entry.name + "." + out[i].name;
  }
}

/// False when `work`, a call of the update, has failed.
template <class Work>
bool UpdateRunner::call(std::size_t index, Work&& work) {
  std::optional<Thrown> thrown;
  try {
    thrown = thrown_by(work);
  } catch (const InputError& error) {
    thrown = Thrown{error.what()};
  }
  if (!thrown) return true;
  if (options_.frozen) throw UpdateFailure(updates_[index].name, thrown->text);
  UpdateFailures& failures = failures_[index];
  if (++failures.count == 1) failures.cause = thrown->text;
  failures.disabled = thrown->in_breach || failures.count >= options_.max_update_failures;
  return false;
}

/// Gives the sink the rooms of an update; false when it has none.
bool UpdateRunner::open_rooms(std::size_t index, const StateBlocks& blocks) {
  bool has_room = false;
  for (std::size_t room = 0; room < room_owners_.size(); ++room) {
    static const std::vector<BlockId> kNone;
    const bool own = room_owners_[room] == index;
    has_room = has_room || own;
    const bool is_closed = options_.no_crowds && blocks.rooms()[room].blocks > 1;
    const auto* free = is_closed ? &kNone : &blocks.free_blocks({static_cast<int>(room)});
    if (!own) free = nullptr;
    sink_.rooms()[room] = {free, blocks.rooms()[room].entries, 0};
  }
  return has_room;
}

/// `data` with the streams of one update, and nothing of those of others.
EpochData UpdateRunner::data_of(std::size_t index, const EpochData& data) {
  for (std::size_t i = 0; i < own_streams_.size(); ++i) {
    const SampleSpan& samples = data.streams[i];
    own_streams_[i] = stream_takers_[i] == index ? samples : SampleSpan{samples.type, nullptr, 0};
  }
  EpochData own = data;
  own.streams = own_streams_;
  return own;
}

void UpdateRunner::run(std::size_t index, const EpochData& data, Filter& filter,
                       std::vector<ExcitationMonitor>& monitors) {
  if (failures_[index].disabled) return;
  const Context context{index, filter, monitors};
  const bool has_room = open_rooms(index, filter.blocks());
  const EpochData own = data_of(index, data);
  sink_.clear();
  Update& update = *updates_[index].update;
  const bool has_run = call(index, [&] {
    update.update(filter.view(), own, sink_);
    require_fitting(sink_, filter);
  });
  if (!has_run) return;
  counts_[index].applied += sink_.applied();
  counts_[index].rejected += sink_.rejected();
  has_moved_ = false;
  apply_residuals(context);
  apply_information(context);
  filter.rebase();
  if (has_room) settle(context);
}

void UpdateRunner::settle(const Context& context) {
  OwnBlocks edits(context.filter, room_owners_, context.index, observer_);
  Update& update = *updates_[context.index].update;
  call(context.index, [&] { update.settle(context.filter.view(), edits); });
}

template <class Factor>
void UpdateRunner::tell(const Context& context, const Factor& factor) {
  if (observer_ == nullptr) return;
  observer_->on_factor(context.filter, updates_[context.index], factor);
}

template <class Factor>
FactorResult UpdateRunner::apply(const Context& context, Factor& factor) {
  for (ExcitationMonitor& monitor : context.monitors) monitor.before(context.filter, factor);
  FactorResult result{};
  if constexpr (std::is_same_v<Factor, InformationFactor>) {
    result = context.filter.apply(factor, sink_.added());
  } else {
    result = context.filter.apply(factor);
  }
  if (is_applied(result)) {
    for (ExcitationMonitor& monitor : context.monitors) monitor.applied();
  }
  return result;
}

void UpdateRunner::apply_residuals(const Context& context) {
  UpdateCounts& counts = counts_[context.index];
  for (const ResidualFactor& factor : sink_.residuals()) {
    const ResidualFactor* next = &factor;
    if (has_moved_ || options_.frozen) {
      residual_factor_ = factor;
      if (has_moved_) take_off(moved_, residual_factor_);
      next = &residual_factor_;
    }
    tell(context, *next);
    if (options_.frozen) {
      residual_factor_.residual.setZero();
      residual_factor_.noise = nullptr;  // zeros tell nothing about it
    }
    const FactorResult result = apply(context, *next);
    const std::int64_t t_ns = context.filter.t_ns();
    if (result == FactorResult::kGated) gated_[context.index].add(t_ns);
    if (result == FactorResult::kWeakened) weakened_[context.index].add(t_ns);
    if (result == FactorResult::kRejected) rejected_[context.index].add(kNoFactor, t_ns);
    ++(result == FactorResult::kApplied ? counts.applied : counts.rejected);
    if (!is_applied(result)) continue;
    if (!has_moved_) moved_.setZero();
    has_moved_ = true;
    moved_ += context.filter.correction();
  }
}

void UpdateRunner::apply_information(const Context& context) {
  Rejections& rejected = rejected_[context.index];
  const std::int64_t t_ns = context.filter.t_ns();
  const bool adds = !sink_.added().empty();
  const InformationFactor* information = sink_.information();
  if (information == nullptr) {
    if (adds) rejected.add(kUndetermined, t_ns);
    return;
  }
  const bool changes = has_moved_ || options_.frozen || adds;
  if (changes) {
    const int size = information->columns.size();
    information_factor_.columns = information->columns;
    information_factor_.Lambda.topLeftCorner(size, size) =
        information->Lambda.topLeftCorner(size, size);
    information_factor_.eta.head(size) = information->eta.head(size);
    if (has_moved_) take_off(moved_, information_factor_);
  }
  tell(context, changes ? information_factor_ : *information);
  if (options_.frozen) information_factor_.eta.head(information->columns.size()).setZero();
  const FactorResult result =
      changes ? apply(context, information_factor_) : apply(context, std::as_const(*information));
  if (result == FactorResult::kRejected) {
    rejected.add(adds ? kUndetermined : "information that is not finite or empty", t_ns);
  }
}

}  // namespace viwo

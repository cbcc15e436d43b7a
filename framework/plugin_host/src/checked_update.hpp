// An update as the framework holds it: the kinds of samples that it takes must be those of all
// others.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "viwo/api/update.hpp"
#include "viwo/plugin_host/plugin_info.hpp"
#include "viwo/plugin_host/sample_kinds.hpp"

namespace viwo {

/// Hands every call on to `update`. declare(): InputError for a kind of samples that another
/// library knows in another version or layout.
class CheckedUpdate final : public Update {
 public:
  CheckedUpdate(std::shared_ptr<Update> update, PluginInfo info, std::shared_ptr<SampleKinds> kinds)
      : update_(std::move(update)), info_(std::move(info)), kinds_(std::move(kinds)) {}

  void declare(Declarations& host) override;
  void start(const UpdateSetup& setup) override { update_->start(setup); }
  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override {
    update_->update(filter, data, sink);
  }
  void settle(const FilterView& filter, BlockEdits& edits) override {
    update_->settle(filter, edits);
  }
  void rejections(std::vector<RejectionCount>& out) const override { update_->rejections(out); }
  void noises(std::vector<NoiseFound>& out) const override { update_->noises(out); }

 private:
  std::shared_ptr<Update> update_;
  PluginInfo info_;
  std::shared_ptr<SampleKinds> kinds_;
  /// They live on, for a plugin that has kept the reference.
  std::vector<std::unique_ptr<Declarations>> declarations_;
};

}  // namespace viwo

// Stands in for the plugin in a filter, and looks at what goes through.
#pragma once

#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "digest.hpp"
#include "findings.hpp"
#include "viwo/plugin_host/registry.hpp"

namespace viwo::conformance {

/// Makes measurements of an epoch what broken logs have; what it points them to lives until the
/// next call.
using Spoil = std::function<void(int epoch, EpochData& data)>;

struct WatchOptions {
  Spoil spoil;              ///< then nothing that the plugin emits reaches the filter
  bool full_rooms = false;  ///< no block is added
};

/// Hands every call on to the plugin. What it throws once it runs is a finding; of what it emits
/// all that is right reaches the filter.
class Watch final : public Update {
 public:
  /// `findings`: null for a second instance, of which only the digests count.
  Watch(Loaded<Update> plugin, Findings* findings, WatchOptions options)
      : plugin_(std::move(plugin)), findings_(findings), options_(std::move(options)) {}

  void declare(Declarations& host) override { plugin_.object->declare(host); }
  void start(const UpdateSetup& setup) override;
  void update(const FilterView& filter, const EpochData& given, FactorSink& sink) override;
  void settle(const FilterView& filter, BlockEdits& edits) override;
  void noises(std::vector<NoiseFound>& out) const override { plugin_.object->noises(out); }
  void rejections(std::vector<RejectionCount>& out) const override {
    plugin_.object->rejections(out);
  }

  std::int64_t factors() const { return factors_; }
  std::int64_t added_blocks() const { return added_blocks_; }
  /// Of all that it emitted in an epoch.
  const std::vector<std::uint64_t>& digests() const { return digests_; }

 private:
  std::string where() const { return "epoch " + std::to_string(digests_.size()); }
  /// What to do about it, behind the finding.
  struct Remedies {
    const char *of_exception, *of_breach;
  };
  template <class Call>
  bool returns(const std::string& name, const Remedies& remedies, Call&& call);
  void fail_once(const std::string& what, const std::string& text);
  bool check(const FilterView& filter);
  bool report(const std::string& what, const std::string& fault);
  void pass_on(FactorSink& sink);

  Loaded<Update> plugin_;
  Findings* findings_;
  WatchOptions options_;
  FactorSink sink_{0, 0};
  std::vector<std::uint64_t> digests_;
  std::int64_t factors_ = 0, added_blocks_ = 0;
  std::set<std::string> reported_;
};

}  // namespace viwo::conformance

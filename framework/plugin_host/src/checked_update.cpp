#include "checked_update.hpp"

namespace viwo {
namespace {

class CheckedDeclarations final : public Declarations {
 public:
  CheckedDeclarations(Declarations& host, const PluginInfo& info, SampleKinds& kinds)
      : host_(host), info_(info), kinds_(kinds) {}

  Rig& rig() override { return host_.rig(); }
  BlockId block(const BlockSpec& spec) override { return host_.block(spec); }
  BlockId block(std::string_view name) override { return host_.block(name); }
  RoomId room(const RoomSpec& spec) override { return host_.room(spec); }
  StreamId stream(const StreamSpec& spec) override {
    if (spec.type != nullptr) kinds_.require(*spec.type, info_);
    return host_.stream(spec);
  }

 private:
  Declarations& host_;
  const PluginInfo& info_;
  SampleKinds& kinds_;
};

}  // namespace

void CheckedUpdate::declare(Declarations& host) {
  declarations_.push_back(std::make_unique<CheckedDeclarations>(host, info_, *kinds_));
  update_->declare(*declarations_.back());
}

}  // namespace viwo

// An update that throws in every second epoch, and says otherwise that the base stands still.
#include <array>
#include <stdexcept>
#include <string>

#include "viwo/api/plugin.hpp"

namespace {

using namespace viwo;

constexpr std::array<ParamSpec, 1> kParams = {{
    {.name = "what",
     .type = ParamType::kString,
     .fallback = "std",
     .choices = "std|int|start",
     .help = "what is thrown"},
}};

class Failing final : public Update {
 public:
  Failing(const ParamSet& params, const HostServices&) : what_(params.text("what")) {}

  UpdateKind kind() const override { return UpdateKind::kBody; }

  void start(const UpdateSetup&) override {
    if (what_ == "start") throw std::logic_error("cannot start");
  }

  void update(const FilterView&, const EpochData&, FactorSink& sink) override {
    sink.count(1, 0);
    if (++calls_ % 2 == 1) return;
    if (what_ == "int") throw 42;
    throw std::runtime_error("lost in call " + std::to_string(calls_));
  }

 private:
  std::string what_;
  int calls_ = 0;
};

}  // namespace

VIWO_REGISTER(Update, Failing, "failing", "0.1.0", "throws", "Apache-2.0", kParams);

// An update that throws in every second epoch. With `what: seed` it is one of wheels that logs its
// seed.
#include <stdexcept>
#include <string>

#include "viwo/api/plugin.hpp"

namespace {

using namespace viwo;

struct Params {
  std::string what = "std";

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(what), {.choices = "std|int|bytes|contract|declare|input|start|seed",
                         .help = "seed: that is logged; else what is thrown, bytes: of a caf\xe9"});
  }
};

class Failing final : public Update {
 public:
  Failing(const Params& params, const HostServices& services) : what_(params.what) {
    if (what_ == "seed") services.log(LogLevel::kInfo, std::to_string(services.seed));
  }

  void declare(Declarations& host) override {
    if (what_ == "seed") host.rig().wheels();  // an instance for each wheel set
    if (what_ == "declare") throw std::logic_error("cannot say");
    if (what_ == "input") throw InputError("needs a barometer");
    // An epoch for each image.
    host.stream({.type = &sample_type<FeatureSample>(), .ends_epochs = true, .optional = true});
  }

  void start(const UpdateSetup&) override {
    if (what_ == "start") throw std::logic_error("cannot start");
  }

  void update(const FilterView&, const EpochData&, FactorSink& sink) override {
    sink.count(1, 0);
    if (++calls_ % 2 == 1) return;
    if (what_ == "int") throw 42;
    if (what_ == "bytes") throw std::runtime_error("lost in a caf\xe9");
    if (what_ == "contract") throw ContractError("takes what it may not");
    throw std::runtime_error("lost in call " + std::to_string(calls_));
  }

 private:
  std::string what_;
  int calls_ = 0;
};

}  // namespace

VIWO_REGISTER(Update, Failing, "failing", "0.1.0", "throws", "Apache-2.0", Params);

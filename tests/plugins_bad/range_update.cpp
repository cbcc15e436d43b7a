// An update that takes ranges, and makes nothing of them.
#include "range.hpp"
#include "viwo/api/plugin.hpp"

namespace {

using namespace viwo;

class Ranging final : public Update {
 public:
  Ranging(const NoParams&, const HostServices&) {}
  void declare(Declarations& host) override {
    ranges_ = host.stream({.type = &sample_type<bad::RangeSample>()});
  }
  void update(const FilterView&, const EpochData& data, FactorSink& sink) override {
    sink.count(0, static_cast<std::int64_t>(data.samples<bad::RangeSample>(ranges_).size()));
  }

 private:
  StreamId ranges_;
};

}  // namespace

VIWO_REGISTER(Update, Ranging, BAD_NAME, "0.1.0", "takes ranges", "Apache-2.0", NoParams);

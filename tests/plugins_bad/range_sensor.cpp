// A sensor of ranges.
#include "range.hpp"
#include "viwo/api/plugin.hpp"

namespace {

using namespace viwo;

class Ranges final : public Sensor {
 public:
  Ranges(const NoParams&, const HostServices&) {}
  SampleTypes yields() const override { return sample_types<bad::RangeSample>(); }
  Status next(Measurement& out) override {
    if (++given_ > 2) return Status::kEnd;
    out = bad::RangeSample{.t_ns = given_};
    return Status::kOk;
  }

 private:
  std::int64_t given_ = 0;
};

}  // namespace

VIWO_REGISTER(Sensor, Ranges, BAD_NAME, "0.1.0", "ranges", "Apache-2.0", NoParams);

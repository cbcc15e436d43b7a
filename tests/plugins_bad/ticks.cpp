// A good sensor: a few samples at the radius of its kinematic model times the seed.
#include <array>
#include <cstdint>
#include <string>

#include "viwo/api/plugin.hpp"

namespace {

using namespace viwo;

constexpr std::array<ParamSpec, 3> kParams = {{
    {.name = "count", .type = ParamType::kInt, .fallback = "2", .min = 0.},
    {.name = "kinematics", .type = ParamType::kKinematics, .fallback = "{type: moody}"},
    {.name = "file", .type = ParamType::kPath, .fallback = ""},
}};

class Ticks final : public Sensor {
 public:
  Ticks(const ParamSet& params, const HostServices& services)
      : params_(params), services_(services), model_(params.kinematics("kinematics")) {
    services.log(LogLevel::kWarning, "file " + params.text("file"));
  }

  // Everything the host gave must still be there.
  ~Ticks() override {
    ModelDescription description;
    model_.describe(description);
    services_.log(LogLevel::kInfo, "goodbye " + description.intrinsics.at(0).name);
  }

  SampleTypes yields() const override { return sample_types<EncoderSample>(); }

  Status next(Measurement& out) override {
    if (given_ == params_.integer("count")) return Status::kEnd;
    ModelDescription description;
    model_.describe(description);
    EncoderSample sample;
    sample.t_ns = ++given_;
    sample.n_drive = 1;
    sample.drive_rad_per_s[0] =
        description.intrinsics.at(0).nominal * static_cast<double>(services_.seed);
    out = sample;
    return Status::kOk;
  }

 private:
  const ParamSet& params_;
  const HostServices& services_;
  const KinematicModel& model_;
  std::int64_t given_ = 0;
};

}  // namespace

VIWO_REGISTER(Sensor, Ticks, "ticks", "0.1.0", "counts", "Apache-2.0", kParams);

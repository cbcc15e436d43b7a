// A good sensor: a few samples at the radius of its kinematic model times the seed.
#include <cstdint>
#include <filesystem>
#include <string>

#include "viwo/api/plugin.hpp"

namespace {

using namespace viwo;

struct Params {
  std::int64_t count = 2;
  NestedKinematics kinematics{"{type: moody}"};
  std::filesystem::path file;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(count), {.min = 0.});
    b(VIWO_PARAM(kinematics), {});
    b(VIWO_PARAM(file), {});
  }
};

class Ticks final : public Sensor {
 public:
  Ticks(const Params& params, const HostServices& services)
      : count_(params.count), services_(services), model_(*params.kinematics.model) {
    services.log(LogLevel::kWarning, "file " + params.file.string());
  }

  // Everything the host gave must still be there.
  ~Ticks() override {
    ModelDescription description;
    model_.describe(description);
    services_.log(LogLevel::kInfo, "goodbye " + description.intrinsics.at(0).name);
  }

  SampleTypes yields() const override { return sample_types<EncoderSample>(); }

  Status next(Measurement& out) override {
    if (given_ == count_) return Status::kEnd;
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
  std::int64_t count_;
  const HostServices& services_;
  const KinematicModel& model_;
  std::int64_t given_ = 0;
};

}  // namespace

VIWO_REGISTER(Sensor, Ticks, "ticks", "0.1.0", "counts", "Apache-2.0", Params);

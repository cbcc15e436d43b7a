// A sensor with one mistake, which its name says; without it it is right.
#include <cmath>
#include <fstream>
#include <stdexcept>

#include "viwo/api/plugin.hpp"

/// "broken_<defect>": of the library that this is linked into.
extern const char kPluginName[];

namespace viwo {
namespace {

bool is(std::string_view defect) {
  return std::string_view(kPluginName).substr(std::string_view("broken_").size()) == defect;
}

struct Params {
  int count = 20;
  std::filesystem::path path;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(count), {.min = 0., .max = 1e6, .help = "how many samples"});
    b(VIWO_PARAM(path), {.help = "a file"});
  }
};

int shared_count = 0;

class Broken final : public Sensor {
 public:
  Broken(const Params& params, const HostServices& services)
      : left_(params.count), seed_(services.seed) {
    const std::string& path = params.path;
    if (path.empty() || is("ignores_files")) return;
    std::string word;
    std::ifstream file(path);
    if (!(file >> word) || word != "samples") {
      if (is("throws_on_files")) throw std::runtime_error("bad file");
      throw InputError(path + ":1: not a file of samples");
    }
  }

  SampleTypes yields() const override {
    if (is("yields_nothing")) return {};
    return is("yields") ? sample_types<PoseSample, EncoderSample>() : sample_types<ImuSample>();
  }

  Status next(Measurement& out) override {
    if (left_-- <= 0) {
      left_ = is("goes_on") ? 5 : 0;
      return Status::kEnd;
    }
    ++shared_count;
    ImuSample sample;
    time_ns_ += is("order") && left_ == 7 ? -1'000'000 : 5'000'000;
    sample.t_ns = time_ns_;
    sample.gyro_rad_per_s[0] = 1e-3 * static_cast<double>(seed_);
    if (is("clock")) sample.gyro_rad_per_s[1] = 1e-3 * shared_count;
    if (is("nan") && left_ == 3) sample.accel_m_per_s2[2] = std::nan("");
    out = sample;
    return Status::kOk;
  }

 private:
  std::int64_t left_;
  std::uint64_t seed_;
  std::int64_t time_ns_ = 0;
};

VIWO_REGISTER(Sensor, Broken, kPluginName, "1.0.0", "a sensor with one mistake", "Apache-2.0",
              Params);

}  // namespace
}  // namespace viwo

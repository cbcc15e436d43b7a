// Sensor kaist_urban: IMU, wheel encoders, stereo images and reference poses of a sequence of the
// KAIST Complex Urban dataset (model.md).
#include <filesystem>
#include <system_error>

#include "sequence.hpp"
#include "viwo/api/plugin.hpp"
#include "viwo/log/recording.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo {
namespace {

struct Params : log::JointParams, log::PieceParams, log::LimitParams {
  std::filesystem::path path;
  bool imu = true;
  bool wheels = true;
  bool images = true;
  bool reference = true;
  int encoder_resolution = 0;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(path),
      {.required = true,
       .help = "folder of a sequence (urban28-pankyo): sensor_data, calibration, image, "
               "global_pose.csv"});
    b(VIWO_PARAM(imu), {.help = "read sensor_data/xsens_imu.csv"});
    b(VIWO_PARAM(wheels), {.help = "read sensor_data/encoder.csv: drives 1 (left) and 2 (right)"});
    b(VIWO_PARAM(images), {.help = "read image/stereo_left and stereo_right: cameras 0 and 1"});
    b(VIWO_PARAM(reference), {.help = "read global_pose.csv"});
    b(VIWO_PARAM(encoder_resolution),
      {.min = 0.,
       .max = 1e9,
       .help = "counts of a turn of a wheel; 0: from calibration/EncoderParameter.txt"});
    log::PieceParams::bind(b);
    log::JointParams::bind(b);
    log::LimitParams::bind(b);
  }
};

log::Recording<Measurement> read(const Params& params) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(params.path, ignored)) {
    throw ParamError("path", params.path.string() + " is no folder");
  }
  const kaist::Sequence sequence(params.path, params.limits());
  log::Recording<Measurement> out;  // reasons of rejection are of one kind each
  if (params.reference) log::append(out, sequence.reference(), "");
  if (params.imu) log::append(out, sequence.imu(), "");
  if (params.wheels) {
    log::append(out, sequence.wheels(params.encoder_resolution, params.joints()), "");
  }
  if (params.images) {
    log::append(out, sequence.images(0), "");
    log::append(out, sequence.images(1), "");
  }
  if (out.samples.empty()) {
    throw ParamError("path", "nothing to read: imu, wheels, images and reference are all false");
  }
  log::sort_by_time(out);
  log::cut(params, out);
  return out;
}

SampleTypes kinds_of(const Params& params) {
  SampleTypes out;
  if (params.reference) out.push_back(&sample_type<PoseSample>());
  if (params.imu) out.push_back(&sample_type<ImuSample>());
  if (params.wheels) out.push_back(&sample_type<EncoderSample>());
  if (params.images) out.push_back(&sample_type<ImageSample>());
  return out;
}

class KaistUrban final : public log::RecordingSensor<Measurement> {
 public:
  KaistUrban(const Params& params, const HostServices& /*services*/)
      : RecordingSensor(read(params), kinds_of(params)) {}
};

VIWO_REGISTER(Sensor, KaistUrban, "kaist_urban", "1.0.0",
              "stereo images, IMU, wheel encoders and reference of a KAIST Complex Urban sequence",
              "Apache-2.0", Params);

}  // namespace
}  // namespace viwo

// Sensor asl_images: the images of a log folder (model.md).
#include "viwo/asl/asl_images.hpp"

#include <filesystem>
#include <string>
#include <vector>

#include "viwo/api/plugin.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo {
namespace {

struct Params : log::LimitParams {
  std::filesystem::path path;
  std::vector<std::string> cameras{"cam0"};

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(path),
      {.required = true,
       .help = "the folder of the recording, which holds the folders of its cameras"});
    b(VIWO_PARAM(cameras),
      {.help = "folders of the cameras, in the order of the configuration's cameras"});
    log::LimitParams::bind(b);
  }
};

log::ImageRecording read(const Params& params) {
  const std::filesystem::path recording = params.path;
  std::vector<std::filesystem::path> folders;
  for (const std::string& camera : params.cameras) {
    if (camera.empty()) throw ParamError("cameras", "a folder's name is empty");
    folders.push_back(recording / camera);
  }
  if (folders.empty()) throw ParamError("cameras", "at least one camera is needed");
  return log::read_asl_images(folders, params.limits());
}

class AslImages final : public log::RecordingSensor<ImageSample> {
 public:
  AslImages(const Params& params, const HostServices& /*services*/)
      : RecordingSensor(read(params)) {}
};

VIWO_REGISTER(Sensor, AslImages, "asl_images", "1.0.0",
              "images of a log folder (cam0/data.csv, cam0/data/*.png)", "Apache-2.0", Params);

}  // namespace
}  // namespace viwo

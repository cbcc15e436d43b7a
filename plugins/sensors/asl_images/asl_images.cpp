// Sensor asl_images: the images of a log folder (model.md).
#include "viwo/log/asl_images.hpp"

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "viwo/api/plugin.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo {
namespace {

constexpr std::array kParams{
    ParamSpec{.name = "path",
              .type = ParamType::kPath,
              .help = "the folder of the recording, which holds the folders of its cameras"},
    ParamSpec{.name = "cameras",
              .type = ParamType::kStrings,
              .fallback = "[cam0]",
              .help = "folders of the cameras, in the order of the configuration's cameras"},
    log::kMaxGapParam, log::kMaxRejectedFractionParam};

log::ImageRecording read(const ParamSet& params) {
  const std::filesystem::path recording = params.text("path");
  std::vector<std::filesystem::path> folders;
  for (const std::string& camera : params.texts("cameras")) {
    if (camera.empty()) throw ParamError("cameras", "a folder's name is empty");
    folders.push_back(recording / camera);
  }
  if (folders.empty()) throw ParamError("cameras", "at least one camera is needed");
  return log::read_asl_images(folders, log::limits_from(params));
}

class AslImages final : public log::RecordingSensor<ImageSample> {
 public:
  AslImages(const ParamSet& params, const HostServices& /*services*/)
      : RecordingSensor(read(params)) {}
};

VIWO_REGISTER(Sensor, AslImages, "asl_images", "1.0.0",
              "images of a log folder (cam0/data.csv, cam0/data/*.png)", "Apache-2.0", kParams);

}  // namespace
}  // namespace viwo

// Sensor video: images out of video files (model.md).
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "video_frames.hpp"
#include "viwo/api/plugin.hpp"
#include "viwo/api/stamp_order.hpp"
#include "viwo/log/recording.hpp"
#include "viwo/log/sensor_params.hpp"
#include "viwo/log/stamp_filter.hpp"
#include "viwo/log/table_reader.hpp"

namespace viwo::video {
namespace {

struct Params : log::LimitParams {
  std::filesystem::path path;
  std::vector<std::string> videos{"cam0.mp4"};
  std::vector<std::string> stamps;
  std::string time_column = "timestamp_ns";
  log::TimeUnit time_unit = log::TimeUnit::kNanosecond;
  std::int64_t start_ns = 0;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(path), {.required = true, .help = "the folder of the videos"});
    b(VIWO_PARAM(videos),
      {.help = "files of the cameras, in the order of the configuration's cameras"});
    b(VIWO_PARAM(stamps),
      {.help = "tables with a row for each frame, one for each video; empty: as the containers "
               "have them, which are decoded once for that"});
    b(VIWO_PARAM(time_column),
      {.help = "name or number (from 1) of the column of the tables that has the stamps"});
    b(VIWO_PARAM(time_unit),
      {{"s", log::TimeUnit::kSecond},
       {"ms", log::TimeUnit::kMillisecond},
       {"us", log::TimeUnit::kMicrosecond},
       {"ns", log::TimeUnit::kNanosecond}},
      {.help = "of that column"});
    b(VIWO_PARAM(start_ns), {.unit = "ns",
                             .min = -static_cast<double>(kMaxStampNs),
                             .max = static_cast<double>(kMaxStampNs),
                             .help = "without tables: stamp of the first frame of each video"});
    log::LimitParams::bind(b);
  }
};

using Images = log::Recording<ImageSample>;

std::filesystem::path file_in(const Params& params, const std::string& key,
                              const std::string& name) {
  if (name.empty()) throw ParamError(key, "a file's name is empty");
  return params.path / name;
}

/// The frames of one camera, with the stamps of a table.
void add_by_table(const Params& params, const std::filesystem::path& file, int camera,
                  const std::shared_ptr<Frames>& frames, Images& out) {
  log::TableReader table(file, log::TableLayout{});
  const std::size_t column = table.column(params.time_column);
  log::StampFilter filter(params.limits());
  std::int64_t frame = 0;
  table.for_each_row(
      [&] {
        const std::int64_t t_ns = table.time_ns(column, params.time_unit);
        if (filter.accept(t_ns, table.reader())) {
          out.samples.push_back({t_ns, camera, std::make_shared<const Frame>(frames, frame)});
        }
        ++frame;
      },
      [&](const log::BadRow& bad) {
        filter.reject_row(bad, table.reader());
        ++frame;  // its frame is there
      });
  filter.finish(table.reader());
  for (RejectionCount count : filter.counts()) out.rejections.push_back(std::move(count));
}

void add_by_container(const Params& params, int camera, const std::shared_ptr<Frames>& frames,
                      Images& out) {
  StampOrder order(params.limits());
  std::int64_t frame = 0;
  for (const std::int64_t t_ns : frames->times_ns()) {
    const std::int64_t stamp_ns = params.start_ns + t_ns;
    const auto place = [&] {
      return frames->file().filename().string() + ": frame " + std::to_string(frame);
    };
    if (order.accept(stamp_ns, place)) {
      out.samples.push_back({stamp_ns, camera, std::make_shared<const Frame>(frames, frame)});
    }
    ++frame;
  }
  if (frame == 0) throw InputError(frames->file().string() + "  has no frame");
  for (RejectionCount count : order.counts()) out.rejections.push_back(std::move(count));
}

Images read(const Params& params) {
  if (params.videos.empty()) throw ParamError("videos", "at least one video is needed");
  if (!params.stamps.empty() && params.stamps.size() != params.videos.size()) {
    throw ParamError("stamps", "needs as many names as videos, " +
                                   std::to_string(params.videos.size()) + ", or none");
  }
  Images out;
  for (std::size_t i = 0; i < params.videos.size(); ++i) {
    const auto frames = std::make_shared<Frames>(file_in(params, "videos", params.videos[i]));
    const int camera = static_cast<int>(i);
    if (params.stamps.empty()) {
      add_by_container(params, camera, frames, out);
    } else {
      add_by_table(params, file_in(params, "stamps", params.stamps[i]), camera, frames, out);
    }
  }
  std::stable_sort(out.samples.begin(), out.samples.end(),
                   [](const ImageSample& a, const ImageSample& b) { return a.t_ns < b.t_ns; });
  return out;
}

class Video final : public log::RecordingSensor<ImageSample> {
 public:
  Video(const Params& params, const HostServices& /*services*/) : RecordingSensor(read(params)) {}
};

VIWO_REGISTER(Sensor, Video, "video", "1.0.0", "images out of video files", "Apache-2.0", Params);

}  // namespace
}  // namespace viwo::video

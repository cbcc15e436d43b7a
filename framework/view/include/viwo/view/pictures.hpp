// Pictures of a run of the filter while it goes on: in a window, in a video file, and a few for its
// page. They look on only: a run has the same results with and without them.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "viwo/run/run.hpp"
#include "viwo/view/scene.hpp"
#include "viwo/view/show.hpp"
#include "viwo/view/tracks.hpp"

namespace viwo::view {

/// Where pictures go besides the page; null: nowhere.
struct PictureSinks {
  std::unique_ptr<Screen> window;
  std::unique_ptr<Film> video;
};

/// Opens what is asked for (an empty path: no video), so that what cannot work shows before the
/// run. Throws InputError: for a run without the filter, without a screen, and for a video that
/// cannot be written.
PictureSinks open_sinks(const RunSetup& setup, bool window, const std::filesystem::path& video);

/// Watches one run. Outlives it; setup and data outlive this.
class RunPictures final : public EstimatorObserver {
 public:
  RunPictures(const RunSetup& setup, const RunData& data, PictureSinks sinks);

  /// Adds what this has to know of a run.
  void watch(RunHooks& hooks);
  /// After the run: gives it up to three pictures (none for a run that has seen no image) and ends
  /// the video. Returns what went wrong with the pictures; "" if nothing did.
  std::string finish(RunResult& result);

  void on_epoch(const Filter& filter, const EpochData& data) override;

 private:
  /// What one camera saw last.
  struct Camera {
    std::optional<std::int64_t> t_ns;  ///< in its clock; nothing: no image yet
    RecentImages seen;
    Image pixels;
    std::vector<ImageSample> images;  ///< of a recorded run, in time order
  };

  void after_epoch(const RunResult& result);
  void make_pictures(const RunResult& result);
  bool snapshot_due(double t_s);
  view::Picture picture_of(const RunResult& result);
  view::CameraImage camera_image(std::size_t index);
  std::shared_ptr<const ImageSource> source_of(std::size_t index);
  std::vector<view::Path> paths_of(const RunResult& result) const;
  std::vector<view::Curve> curves_of(const RunResult& result) const;
  std::string status_of(const RunResult& result) const;

  const RunSetup& setup_;
  PictureSinks sinks_;
  std::string failure_;  ///< then there are no more pictures
  std::vector<Camera> cameras_;
  Trajectory reference_;
  double sigma_position_m_ = 0.;
  bool seen_ = false;  ///< any image

  bool live_;
  double duration_s_ = 0.;  ///< of what was recorded
  double next_snapshot_s_ = 0.;
  std::vector<RunPicture> snapshots_;

  std::mutex mutex_;  ///< of `arrived_`
  std::deque<ImageSample> arrived_;
};

}  // namespace viwo::view

// The images of one instant, one of each camera, out of a stream of measurements.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "viwo/api/measurement.hpp"
#include "viwo/api/rejections.hpp"
#include "viwo/api/sensor.hpp"
#include "viwo/math/set_back_clock.hpp"

namespace viwo::klt {

inline constexpr int kMaxCameras = 4;

/// "camera 0 at 1.050000000 s".
std::string place(int camera, std::int64_t t_ns);

struct ImageGroup {
  struct Slot {
    std::int64_t t_ns = 0;                      ///< in the clock of the camera
    std::shared_ptr<const ImageSource> source;  ///< null: no image
  };
  std::array<Slot, kMaxCameras> images;  ///< by camera
};

/// Reads a sensor and gathers its images, in time order. A group is complete when it has an image
/// of every camera, or when the next image is of another instant. A camera that is silent for long
/// is not waited for: live, that would make each group late by one instant.
class ImageGroups {
 public:
  ImageGroups(int n_cameras, std::int64_t tolerance_ns)
      : n_cameras_(n_cameras), tolerance_ns_(tolerance_ns) {
    begin_again();
  }

  /// False at the end.
  bool next(Sensor& input, Rejections& rejections, ImageGroup& out);
  std::int64_t images() const { return images_; }  ///< that were taken so far
  std::int64_t others() const { return others_; }  ///< measurements that were not
  /// Least distance of the stamps of two cameras so far; nothing while only one gives images.
  std::optional<std::int64_t> nearest_ns() const { return nearest_ns_; }

 private:
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();
  static constexpr std::int64_t kSilentNs = 2'000'000'000;
  /// Images of a camera that say that its clock was set back.
  static constexpr int kMostBehind = 3;

  void begin_again();

  /// The next image of one of the cameras whose stamp can be.
  std::optional<ImageSample> next_image(Sensor& input, Rejections& rejections);
  void note_distance(const ImageSample& image);
  /// Whether the camera is silent for long before an instant.
  bool is_silent(std::size_t camera, std::int64_t t_ns) const;
  bool is_complete(const ImageGroup& group, std::int64_t t_ns) const;

  int n_cameras_;
  std::int64_t tolerance_ns_;
  std::optional<ImageSample> ahead_;  ///< the first image of the next group
  std::array<std::int64_t, kMaxCameras> last_ns_{};
  std::array<SetBackClock, kMaxCameras> clocks_{
      SetBackClock(kMostBehind), SetBackClock(kMostBehind), SetBackClock(kMostBehind),
      SetBackClock(kMostBehind)};
  std::optional<std::int64_t> first_ns_, newest_ns_;
  std::optional<std::int64_t> group_ns_;  ///< newest of the last group
  int n_begun_ = 0;                       ///< times that a clock was set back
  std::optional<std::int64_t> nearest_ns_;
  std::int64_t images_ = 0;
  std::int64_t others_ = 0;
  bool ended_ = false;
};

}  // namespace viwo::klt

// The frames of a video file, by their number.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>

#include "viwo/api/measurement.hpp"

namespace viwo::video {

/// What a container says of a frame. InputError for what is no time, or beyond kMaxStampNs.
std::int64_t frame_time_ns(double t_ms, const std::filesystem::path& file, std::size_t frame);

/// One after the other they are decoded once; going back begins at the first frame again, as no
/// container says reliably where another one begins.
class Frames {
 public:
  /// InputError when the file is missing, no video that can be decoded, or has more than 2^25
  /// pixels in a frame.
  explicit Frames(std::filesystem::path file);

  /// Times of all frames after the first, as the container has them: decodes the whole video. A
  /// video that is damaged somewhere ends there.
  std::vector<std::int64_t> times_ns();

  /// Grey, rows and columns as they are stored. From any thread. InputError when there is no such
  /// frame.
  void read(std::int64_t frame, Image& out);

  const std::filesystem::path& file() const { return file_; }

 private:
  void open();

  std::filesystem::path file_;
  std::mutex mutex_;
  cv::VideoCapture capture_;
  std::int64_t next_ = 0;  ///< frame that is decoded next
  cv::Mat colours_, grey_;
};

/// One of them.
class Frame final : public ImageSource {
 public:
  Frame(std::shared_ptr<Frames> frames, std::int64_t number)
      : frames_(std::move(frames)), number_(number) {}
  void read(Image& out) const override { frames_->read(number_, out); }

 private:
  std::shared_ptr<Frames> frames_;
  std::int64_t number_;
};

}  // namespace viwo::video

// A video file of pictures.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "viwo/view/picture.hpp"

namespace viwo::view {

/// Written under another name beside the file and moved there by close(), so that a video that is
/// there is whole.
class VideoFile {
 public:
  /// `file` ends in .mp4 (MPEG-4) or .avi (Motion JPEG); its folder is made if need be. Throws
  /// InputError for other endings, and when a video cannot be written there.
  explicit VideoFile(std::filesystem::path file);
  /// Without close() nothing is left behind.
  ~VideoFile();
  VideoFile(const VideoFile&) = delete;
  VideoFile& operator=(const VideoFile&) = delete;

  /// The next picture, taken at `t_s`; all are of one size (std::invalid_argument). The pictures of
  /// a second follow from the first eleven: the median of the times between them. Never fails
  /// because of the disk: close() tells.
  void add(const Picture& picture, double t_s);
  /// Ends the video; without any picture there is none. std::runtime_error when not all of it could
  /// be written; then there is no file.
  void close();

 private:
  class Writer;  // hides OpenCV
  void start();

  std::filesystem::path file_;
  std::filesystem::path part_;    // what it is called until it is whole
  std::vector<Picture> waiting_;  // for the rate to be known
  std::vector<double> waiting_t_s_;
  std::int64_t pictures_ = 0;
  int width_px_ = 0, height_px_ = 0;
  std::unique_ptr<Writer> writer_;
  std::string failure_;
};

}  // namespace viwo::view

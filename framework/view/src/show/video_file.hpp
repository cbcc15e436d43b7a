// A video file by OpenCV's codecs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "viwo/view/show.hpp"

namespace viwo::view {

/// Written under another name beside the file and moved there by close(), so that a video that is
/// there is whole.
class VideoFile final : public Film {
 public:
  explicit VideoFile(std::filesystem::path file);
  ~VideoFile() override;
  VideoFile(const VideoFile&) = delete;
  VideoFile& operator=(const VideoFile&) = delete;

  void add(const Picture& picture, double t_s) override;
  void close() override;

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

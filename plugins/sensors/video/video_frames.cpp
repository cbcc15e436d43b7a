#include "video_frames.hpp"

#include <cmath>
#include <string>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "viwo/api/stamp_order.hpp"
#include "viwo/api/status.hpp"
#include "viwo/files/files.hpp"
#include "viwo/image/silent_opencv.hpp"

namespace viwo::video {
namespace {

constexpr double kMostPixels = 1 << 25;

}  // namespace

std::int64_t frame_time_ns(double t_ms, const std::filesystem::path& file, std::size_t frame) {
  const double t_ns = 1e6 * t_ms;
  if (!(std::abs(t_ns) <= static_cast<double>(kMaxStampNs))) {
    throw InputError(file.string() + "  frame " + std::to_string(frame) +
                     " has a time of another century, or none");
  }
  return std::llround(t_ns);
}

Frames::Frames(std::filesystem::path file) : file_(std::move(file)) {
  if (!std::filesystem::exists(file_)) {
    throw InputError(file_.string() + "  cannot be read: No such file or directory");
  }
  files::require_regular_file(file_);
  open();
}

void Frames::open() {
  const SilentOpenCv silence;
  capture_ = cv::VideoCapture();
  try {
    // The name is one of a file, not of a numbered series or of a stream.
    capture_.open("file:" + std::filesystem::absolute(file_).string(), cv::CAP_FFMPEG);
    // A frame as it is stored, whatever the container says of how the device was held.
    capture_.set(cv::CAP_PROP_ORIENTATION_AUTO, 0.);
  } catch (const cv::Exception&) {
  }
  if (!capture_.isOpened()) {
    throw InputError(file_.string() + "  is no video that can be decoded");
  }
  const double pixels =
      capture_.get(cv::CAP_PROP_FRAME_WIDTH) * capture_.get(cv::CAP_PROP_FRAME_HEIGHT);
  if (!(pixels >= 1. && pixels <= kMostPixels)) {
    throw InputError(file_.string() + "  says to have frames of " + std::to_string(pixels) +
                     " pixels; at most 2^25 are read");
  }
  next_ = 0;
}

std::vector<std::int64_t> Frames::times_ns() {
  const std::scoped_lock lock(mutex_);
  open();
  std::vector<std::int64_t> times;
  double first_ms = 0.;
  try {
    while (capture_.grab()) {
      const double t_ms = capture_.get(cv::CAP_PROP_POS_MSEC);
      if (times.empty()) first_ms = t_ms;
      times.push_back(frame_time_ns(t_ms - first_ms, file_, times.size()));
    }
  } catch (const cv::Exception&) {  // damaged: it ends there
  }
  open();
  return times;
}

void Frames::read(std::int64_t frame, Image& out) {
  const std::scoped_lock lock(mutex_);
  if (frame < next_) open();
  bool is_there = true;
  try {
    for (; is_there && next_ < frame; ++next_) is_there = capture_.grab();
    is_there = is_there && capture_.read(colours_);
    if (is_there && colours_.channels() == 3) cv::cvtColor(colours_, grey_, cv::COLOR_BGR2GRAY);
    if (is_there && colours_.channels() == 1) grey_ = colours_;
  } catch (const cv::Exception& error) {
    throw InputError(file_.string() + ": frame " + std::to_string(frame) + ": " + error.err);
  }
  if (!is_there || grey_.type() != CV_8UC1) {
    next_ = 0;
    open();
    throw InputError(file_.string() + ": there is no frame " + std::to_string(frame) +
                     " that can be decoded");
  }
  ++next_;
  out.width_px = grey_.cols;
  out.height_px = grey_.rows;
  out.pixels.resize(grey_.total());
  grey_.copyTo(cv::Mat(grey_.rows, grey_.cols, CV_8UC1, out.pixels.data()));
}

}  // namespace viwo::video

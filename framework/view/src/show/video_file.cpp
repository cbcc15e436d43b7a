#include "video_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <opencv2/videoio.hpp>
#include <unistd.h>

#include "canvas.hpp"
#include "viwo/api/status.hpp"
#include "viwo/files/files.hpp"
#include "viwo/image/silent_opencv.hpp"
#include "viwo/math/median.hpp"

namespace viwo::view {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPicturesForRate = 11;
constexpr double kDefaultRate_hz = 10.;

int codec_of(const fs::path& file) {
  if (file.extension() == ".mp4") return cv::VideoWriter::fourcc('m', 'p', '4', 'v');
  if (file.extension() == ".avi") return cv::VideoWriter::fourcc('M', 'J', 'P', 'G');
  throw InputError("video " + file.string() + ": the name of a video ends in .mp4 or .avi");
}

[[noreturn]] void refuse(const fs::path& file, const std::string& why) {
  throw InputError("video " + file.string() + ": " + why);
}

/// Pictures of a second: from the median of the times between pictures, to a tenth, which both
/// formats can hold.
double rate_of(const std::vector<double>& t_s) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < t_s.size(); ++i) steps.push_back(t_s[i] - t_s[i - 1]);
  if (steps.empty()) return kDefaultRate_hz;
  const double usual_s = upper_median(steps);
  if (!(usual_s > 0.)) return kDefaultRate_hz;
  return std::clamp(std::round(10. / usual_s) / 10., 1., 240.);
}

/// Whether all pictures can be read again. Libraries do not tell when the disk was full.
bool is_whole(const fs::path& file, std::int64_t pictures) {
  const SilentOpenCv silence;
  cv::VideoCapture video(file.string());
  const auto count = static_cast<std::int64_t>(video.get(cv::CAP_PROP_FRAME_COUNT));
  if (!video.isOpened() || count != pictures) return false;
  video.set(cv::CAP_PROP_POS_FRAMES, static_cast<double>(pictures - 1));
  cv::Mat last;
  return video.read(last) && !last.empty();
}

/// Ends a video that was written here, in a part of the file that its readers pass over.
std::string mark_of(const fs::path& file) {
  const std::string text = "viwo run --video";
  const auto size = static_cast<char>(text.size());
  if (file.extension() == ".avi") return std::string("JUNK") + size + std::string(3, '\0') + text;
  const auto with_head = static_cast<char>(size + 8);
  return std::string(3, '\0') + with_head + "free" + text;
}

bool append_mark(const fs::path& file) {
  std::ofstream out(file, std::ios::binary | std::ios::app);
  out << mark_of(file) << std::flush;
  return out.good();
}

/// Nothing, or a video that a run has written.
bool may_be_replaced(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) return true;
  if (!fs::is_regular_file(file, error)) return false;
  const std::string mark = mark_of(file);
  const auto size = static_cast<std::streamoff>(fs::file_size(file, error));
  std::string end(mark.size(), ' ');
  std::ifstream in(file, std::ios::binary);
  in.seekg(size - static_cast<std::streamoff>(mark.size()));
  in.read(end.data(), static_cast<std::streamsize>(end.size()));
  return size == 0 || (in && end == mark);
}

/// What is under the name of a video must be there after a loss of power, too.
bool sync_to_disk(const fs::path& file) {
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  const bool is_synced = fd >= 0 && (::fsync(fd) == 0 || errno == EINVAL);
  if (fd >= 0) ::close(fd);
  return is_synced;
}

}  // namespace

class VideoFile::Writer {
 public:
  Writer(const fs::path& file, double rate_hz, const cv::Size& size) {
    const SilentOpenCv silence;
    // What is there is not written into: it may be a link, or a pipe that nobody reads.
    std::error_code ignored;
    fs::remove(file, ignored);
    video_.open(file.string(), codec_of(file), rate_hz, size);
  }
  bool opened() const { return video_.isOpened(); }
  void write(const Picture& picture) { video_.write(as_mat(picture)); }
  void close() {
    const SilentOpenCv silence;
    video_.release();
  }

 private:
  cv::VideoWriter video_;
};

VideoFile::VideoFile(fs::path file) : file_(std::move(file)) {
  codec_of(file_);
  std::error_code error, ignored;
  if (fs::is_directory(file_, ignored)) refuse(file_, "this is a folder");
  if (!may_be_replaced(file_)) {
    refuse(file_,
           "is there already and was not written by --video (of this version): choose another "
           "name, or remove it");
  }
  part_ = file_;
  part_.replace_filename(file_.stem().string() + files::this_process() +
                         file_.extension().string());
  const fs::path folder = file_.parent_path();
  if (!folder.empty()) fs::create_directories(folder, error);
  if (error) refuse(file_, "cannot create the folder: " + error.message());
  Writer probe(part_, kDefaultRate_hz, {320, 240});
  const bool opened = probe.opened();
  probe.close();
  fs::remove(part_, ignored);
  if (!opened) {
    refuse(file_, "cannot be written (is the folder writable, and does this OpenCV write " +
                      file_.extension().string() + "?)");
  }
}

VideoFile::~VideoFile() {
  if (writer_ == nullptr) return;
  writer_->close();
  std::error_code ignored;
  fs::remove(part_, ignored);
}

void VideoFile::start() {
  writer_ = std::make_unique<Writer>(part_, rate_of(waiting_t_s_), cv::Size(width_px_, height_px_));
  if (!writer_->opened()) failure_ = "cannot be opened";
  for (const Picture& picture : waiting_) {
    if (failure_.empty()) writer_->write(picture);
  }
  waiting_.clear();
}

void VideoFile::add(const Picture& picture, double t_s) {
  if (pictures_ == 0) {
    width_px_ = picture.width_px;
    height_px_ = picture.height_px;
  }
  if (picture.width_px != width_px_ || picture.height_px != height_px_) {
    throw std::invalid_argument("view: the pictures of a video have one size");
  }
  ++pictures_;
  try {
    if (writer_ != nullptr) {
      if (failure_.empty()) writer_->write(picture);
      return;
    }
    waiting_.push_back(picture);
    waiting_t_s_.push_back(t_s);
    if (waiting_.size() == kPicturesForRate) start();
  } catch (const cv::Exception& error) {
    failure_ = error.what();
  }
}

void VideoFile::close() {
  if (pictures_ == 0) return;
  if (writer_ == nullptr) start();
  writer_->close();
  if (failure_.empty() &&
      !(append_mark(part_) && is_whole(part_, pictures_) && sync_to_disk(part_))) {
    failure_ = "it cannot be read back whole, or not all of it was written";
  }
  writer_.reset();
  const std::int64_t pictures = std::exchange(pictures_, 0);
  std::error_code error;
  if (failure_.empty()) {
    fs::rename(part_, file_, error);
    if (!error) return;
    failure_ = error.message();
  }
  fs::remove(part_, error);
  throw std::runtime_error("video " + file_.string() + ": " + failure_ + " (" +
                           std::to_string(pictures) + " pictures; is the disk full?)");
}

}  // namespace viwo::view

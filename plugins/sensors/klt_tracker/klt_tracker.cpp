#include "klt_tracker.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <utility>

#include "parallel_for.hpp"
#include "params.hpp"
#include "viwo/image/image_file.hpp"
#include "viwo/log/kalibr.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo::klt {
namespace {

/// A pair with fewer matches says nothing about the extrinsics.
constexpr std::size_t kMinMatches = 20;
constexpr double kContradictingShare = 0.7;
constexpr const char* kContradicts = "stereo pair that contradicts the extrinsics";
constexpr const char* kBlank = "image without contrast: dark, overexposed or covered";
constexpr const char* kRepeats = "image that repeats the one before to the last bit";
constexpr const char* kUnreadable = "image that cannot be read";
constexpr const char* kAlone = "right image without its left one";
constexpr const char* kShowsNothing = "stereo pair whose second image shows nothing of the first";
/// Pairs in a row that contradict the extrinsics before it is said.
constexpr int kContradictingPairs = 10;
constexpr double kMinBaseline = 1e-3;  // m
/// Cameras that share less of what they see are no pair.
constexpr double kLeastShared = 0.5;
/// Images of two cameras that come without a pair before it is said.
constexpr int kGroupsWithoutPair = 10;
/// Images of another size in a row that are not a slip of the log any more.
constexpr int kOtherSizes = 10;

std::string size_text(int width_px, int height_px) {
  return std::to_string(width_px) + " x " + std::to_string(height_px) + " pixels";
}

/// Whether the camera is the right one of a pair.
bool is_right(const Params& params, const std::vector<CameraView>& cameras, std::size_t camera) {
  return params.stereo && camera % 2 == 1 &&
         shared_view(cameras[camera - 1], cameras[camera]) >= kLeastShared;
}

std::vector<CameraView> read_cameras(const Params& params) {
  const std::string& file = params.cameras;
  std::vector<CameraView> cameras = log::read_kalibr_cameras(file);
  const auto asked = static_cast<std::size_t>(params.n_cameras);
  if (asked > cameras.size()) {
    throw ParamError("n_cameras",
                     "there are only " + std::to_string(cameras.size()) + " cameras in " + file);
  }
  cameras.resize(asked > 0 ? asked : std::min<std::size_t>(cameras.size(), kMaxCameras));
  for (std::size_t i = 1; i < cameras.size(); i += 2) {
    if (!is_right(params, cameras, i)) continue;
    const std::string names = "cam" + std::to_string(i - 1) + " and cam" + std::to_string(i);
    const CameraView &left = cameras[i - 1], &right = cameras[i];
    // Of the first rows and of the last ones.
    const double first_s = right.t_CtoI_s - left.t_CtoI_s;
    const double last_s = first_s + 2. * (right.middle_s() - left.middle_s());
    const double shift_s = std::max(std::abs(first_s), std::abs(last_s));
    if (shift_s > params.max_camera_dt_s) {
      throw ParamError("max_camera_dt_s", "timeshift_cam_imu of " + names + " differ by " +
                                              std::to_string(shift_s) + " s in " + file +
                                              " (line_delay_nanoseconds counted): " +
                                              "images of a pair must be taken at the same time");
    }
    const Eigen::Vector3d p_LinR =
        right.p_IinC - right.R_ItoC * left.R_ItoC.transpose() * left.p_IinC;
    if (p_LinR.norm() < kMinBaseline) {
      throw ParamError("stereo", names + " are at the same place in " + file);
    }
  }
  return cameras;
}

/// Not 0 where no point may be; empty without a mask.
cv::Mat read_mask(const Params& params, std::size_t camera, const CameraView& view) {
  const std::string name = "mask" + std::to_string(camera);
  const std::filesystem::path& file = params.mask(camera);
  if (file.empty()) return {};
  Image image;
  read_image(file, image);
  if (image.width_px != view.width_px || image.height_px != view.height_px) {
    throw ParamError(name, file.string() + " has " + size_text(image.width_px, image.height_px) +
                               ", camera " + std::to_string(camera) + " has " +
                               size_text(view.width_px, view.height_px));
  }
  const cv::Mat grey(image.height_px, image.width_px, CV_8UC1, image.pixels.data());
  return cv::Mat(grey > 127);
}

}  // namespace

KltTracker::KltTracker(const Params& params, const HostServices& services)
    : services_(services),
      options_(params),
      chain_file_(params.cameras),
      max_gap_s_(params.max_gap_s),
      max_camera_dt_s_(params.max_camera_dt_s),
      cameras_(read_cameras(params)) {
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    Eye& eye = eyes_.emplace_back(options_);
    const cv::Mat mask = read_mask(params, i, cameras_[i]);
    if (is_right(params, cameras_, i)) {
      eye.matcher.emplace(cameras_[i - 1], cameras_[i], options_, mask);
    } else {
      eye.tracker.emplace(cameras_[i], options_, mask, camera_seed(services.seed, i));
      followed_.push_back(i);
      if (params.stereo && i % 2 == 1) {
        services_.log(LogLevel::kInfo, "cameras " + std::to_string(i - 1) + " and " +
                                           std::to_string(i) + " see too little of the same by " +
                                           chain_file_ + ": each has points of its own");
      }
    }
  }
  groups_.emplace(static_cast<int>(cameras_.size()), to_ns(max_camera_dt_s_));
}

void KltTracker::read_one(const ImageSource* source, std::size_t camera, Eye& eye) const {
  eye.is_read = eye.repeats = false;
  eye.unreadable.clear();
  eye.other_size.clear();
  eye.failure = nullptr;
  if (source == nullptr) return;
  try {
    Image& image = eye.now.pixels;
    const CameraView& view = cameras_[camera];
    source->read_of_size(view.width_px, view.height_px, image);
    if (image.width_px <= 0 || image.height_px <= 0) throw InputError("no pixels");
    if (image.width_px != view.width_px || image.height_px != view.height_px) {
      eye.other_size = size_text(image.width_px, image.height_px);
      return;
    }
    const auto pixels =
        static_cast<std::size_t>(image.width_px) * static_cast<std::size_t>(image.height_px);
    if (image.pixels.size() != pixels) throw InputError("no pixels");
    // Sensors have noise: it was sent more than once. After so many the camera may hang, or stand
    // still and have none (rendered, a video): then it is taken for what it shows.
    constexpr int kMostRepeats = 3;
    const bool is_same = !eye.before.blank && image.pixels == eye.before.pixels.pixels;
    eye.repeats_in_a_row = is_same ? eye.repeats_in_a_row + 1 : 0;
    eye.repeats = is_same && eye.repeats_in_a_row <= kMostRepeats;
    if (eye.repeats) return;
    eye.maker.make(eye.now);
    eye.is_read = true;
  } catch (const InputError& error) {
    eye.unreadable = error.what();
  } catch (...) {  // nothing may leave a thread of OpenCV
    eye.failure = std::current_exception();
  }
}

void KltTracker::read(const ImageGroup& group) {
  parallel_for(eyes_.size(), [&](std::size_t camera) {
    read_one(group.images[camera].source.get(), camera, eyes_[camera]);
  });
}

void KltTracker::check(const ImageGroup& group) {
  for (std::size_t i = 0; i < eyes_.size(); ++i) {
    Eye& eye = eyes_[i];
    if (eye.failure) std::rethrow_exception(eye.failure);
    const std::string where = place(static_cast<int>(i), group.images[i].t_ns);
    if (!eye.unreadable.empty()) {
      rejections_.add(kUnreadable, [&] { return where + ": " + eye.unreadable; });
    }
    check_size(i, where);
    const auto refuse = [&](const char* why) { rejections_.add(why, [&where] { return where; }); };
    if (eye.repeats) refuse(kRepeats);
    if (eye.is_read || eye.repeats || !eye.unreadable.empty()) ++images_;
    if (eye.is_read && eye.now.blank) refuse(kBlank);
    if (!eye.matcher || !eye.is_read) continue;
    ++right_images_;
    if (eyes_[i - 1].is_read) continue;
    if (!eyes_[i - 1].repeats) refuse(kAlone);
    eye.is_read = false;
  }
}

void KltTracker::check_size(std::size_t camera, const std::string& where) {
  Eye& eye = eyes_[camera];
  if (eye.is_read) {
    eye.has_fitted = true;
    eye.other_sizes = 0;
  }
  if (eye.other_size.empty()) return;
  rejections_.add("image of another size than the camera's",
                  [&] { return where + ": " + eye.other_size; });
  if (++eye.other_sizes == 1) {
    const CameraView& view = cameras_[camera];
    eye.first_other_size = "the image of " + where + " has " + eye.other_size + ", but cam" +
                           std::to_string(camera) + " of " + chain_file_ + " has " +
                           size_text(view.width_px, view.height_px) +
                           ": is the calibration that of another camera?";
  }
  if (eye.other_sizes >= kOtherSizes) throw InputError(eye.first_other_size);
}

void KltTracker::advance(std::size_t camera, std::int64_t t_ns) {
  Eye& eye = eyes_[camera];
  CameraTracker& tracker = *eye.tracker;
  if (!eye.is_read) return;
  const double dt_s = eye.before_ns ? seconds_between(*eye.before_ns, t_ns) : 0.;
  if (eye.now.blank || !eye.before_ns || dt_s > max_gap_s_ || dt_s <= 0.) {
    tracker.drop_all();
  } else {
    tracker.follow(eye.before, eye.now, dt_s);
  }
  eye.before_ns.reset();
  if (eye.now.blank) return;
  tracker.refill(eye.now);
  eye.before_ns = t_ns;
}

void KltTracker::give_ids(std::vector<Track>& tracks) {
  for (Track& track : tracks) {
    if (track.id < 0) track.id = next_id_++;
  }
}

void KltTracker::watch_matches(const StereoCounts& counts, std::size_t right, std::int64_t t_ns) {
  Eye& eye = eyes_[right];
  const std::size_t points = eyes_[right - 1].tracker->tracks().size();
  if (points >= 2 * kMinMatches) ++pairs_with_points_;
  const bool are_few = points >= 2 * kMinMatches && counts.found < kMinMatches;
  eye.pairs_without_matches = are_few ? eye.pairs_without_matches + 1 : 0;
  if (are_few) rejections_.add(kShowsNothing, t_ns);
  if (eye.pairs_without_matches != kContradictingPairs || eye.told_no_matches) return;
  eye.told_no_matches = true;
  services_.log(LogLevel::kWarning,
                std::to_string(counts.found) + " of the " + std::to_string(points) +
                    " points of camera " + std::to_string(right - 1) + " are found in camera " +
                    std::to_string(right) + ", which by " + chain_file_ +
                    " sees the same: is the calibration that of other cameras, or the second "
                    "covered? With stereo=false each follows points of its own");
}

void KltTracker::watch_stereo(const StereoCounts& counts, std::size_t right, std::int64_t t_ns) {
  watch_matches(counts, right, t_ns);
  if (counts.found < kMinMatches) return;
  ++pairs_with_matches_;
  Eye& eye = eyes_[right];
  const double share =
      static_cast<double>(counts.contradicting) / static_cast<double>(counts.found);
  if (share < kContradictingShare) {
    eye.contradicting_pairs = 0;
    return;
  }
  const std::string where = place(static_cast<int>(right) - 1, t_ns);
  rejections_.add(kContradicts, [&where] { return where; });
  if (++eye.contradicting_pairs < kContradictingPairs || eye.told_contradiction) return;
  eye.told_contradiction = true;
  services_.log(LogLevel::kWarning,
                std::to_string(std::lround(100. * share)) + " % of the " +
                    std::to_string(counts.found) + " stereo matches of " + where +
                    ", and most of those of the " + std::to_string(kContradictingPairs - 1) +
                    " pairs before, contradict the extrinsics in " + chain_file_ +
                    ": the two cameras are probably swapped, or the calibration is of others. "
                    "Such matches are not used");
}

void KltTracker::watch_pair(const ImageGroup& group, std::size_t right) {
  Eye& eye = eyes_[right];
  if (!eye.matcher || eye.pair_seen) return;
  const bool has_left = group.images[right - 1].source != nullptr;
  const bool has_right = group.images[right].source != nullptr;
  eye.pair_seen = has_left && has_right;
  if (eye.pair_seen || ++eye.groups_without_pair != kGroupsWithoutPair) return;
  std::string why = "only camera " + std::to_string(has_left ? right - 1 : right) + " gives images";
  if (!has_left && !has_right) {
    why = "cameras " + std::to_string(right - 1) + " and " + std::to_string(right) +
          " give no images";
  } else if (const auto nearest_ns = groups_->nearest_ns()) {
    std::array<char, 96> text{};
    std::snprintf(text.data(), text.size(),
                  "the nearest stamps differ by %.1f ms, max_camera_dt_s is %g",
                  1e-6 * static_cast<double>(*nearest_ns), max_camera_dt_s_);
    why = text.data();
  }
  services_.log(LogLevel::kWarning, "no pair of images yet: " + why);
}

FeatureSample KltTracker::points_of(std::size_t camera, const ImageGroup& group) {
  FeatureSample sample{group.images[camera].t_ns, static_cast<int>(camera), {}};
  Eye& eye = eyes_[camera];
  if (eye.tracker) {
    for (const Track& track : eye.tracker->tracks()) {
      sample.points.push_back({track.id, track.uv.x, track.uv.y});
    }
    return sample;
  }
  Eye& left = eyes_[camera - 1];
  if (left.now.blank || eye.now.blank) return sample;
  const StereoCounts counts =
      eye.matcher->match(left.now, eye.now, left.tracker->tracks(), sample.points);
  watch_stereo(counts, camera, group.images[camera - 1].t_ns);
  return sample;
}

void KltTracker::process(const ImageGroup& group) {
  for (std::size_t i = 0; i < eyes_.size(); ++i) watch_pair(group, i);
  read(group);
  check(group);
  const auto follow = [&](std::size_t camera) { advance(camera, group.images[camera].t_ns); };
  if (followed_.size() == 1) {
    follow(followed_.front());  // parallel inside
  } else {
    parallel_for(followed_.size(), [&](std::size_t i) { follow(followed_[i]); });
  }
  for (const std::size_t camera : followed_) give_ids(eyes_[camera].tracker->tracks());
  for (std::size_t i = 0; i < eyes_.size(); ++i) {
    if (eyes_[i].is_read) ready_.push_back(points_of(i, group));
  }
  std::stable_sort(ready_.begin(), ready_.end(),
                   [](const auto& a, const auto& b) { return a.t_ns < b.t_ns; });
  for (Eye& eye : eyes_) {
    if (eye.is_read) std::swap(eye.now, eye.before);
  }
}

void KltTracker::check_end() const {
  const std::size_t n = cameras_.size();
  if (groups_->images() == 0 && groups_->others() > 0) {
    throw InputError("klt_tracker: its input gives no image of " +
                     (n == 1   ? "camera 0"
                      : n == 2 ? "camera 0 or 1"
                               : "cameras 0 to " + std::to_string(n - 1)) +
                     ", only " + std::to_string(groups_->others()) + " other measurements");
  }
  for (const Eye& eye : eyes_) {
    if (!eye.has_fitted && eye.other_sizes > 0) throw InputError(eye.first_other_size);
  }
}

Status KltTracker::next(Measurement& out) {
  if (input_ == nullptr) throw InputError("klt_tracker: it has no input to take images from");
  while (ready_.empty()) {
    ImageGroup group;
    if (!groups_->next(*input_, rejections_, group)) {
      check_end();
      return Status::kEnd;
    }
    process(group);
  }
  out = std::move(ready_.front());
  ready_.pop_front();
  return Status::kOk;
}

void KltTracker::rejections(std::vector<RejectionCount>& out) const {
  for (const RejectionCount& one : rejections_.counts()) {
    out.push_back(one);
    const bool is_of_all =
        one.reason == kBlank || one.reason == kRepeats || one.reason == kUnreadable;
    if (is_of_all) out.back().of = images_;
    if (one.reason == kAlone) out.back().of = right_images_;
    if (one.reason == kContradicts) out.back().of = pairs_with_matches_;
    if (one.reason == kShowsNothing) out.back().of = pairs_with_points_;
  }
}

}  // namespace viwo::klt

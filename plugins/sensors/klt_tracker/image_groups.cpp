#include "image_groups.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <utility>

namespace viwo::klt {

std::string place(int camera, std::int64_t t_ns) {
  std::array<char, 64> text{};
  const std::lldiv_t t = std::lldiv(t_ns, 1'000'000'000);
  std::snprintf(text.data(), text.size(), "camera %d at %s%lld.%09lld s", camera,
                t_ns < 0 ? "-" : "", std::llabs(t.quot), std::llabs(t.rem));
  return text.data();
}

void ImageGroups::note_distance(const ImageSample& image) {
  for (int other = 0; other < n_cameras_; ++other) {
    const std::int64_t last_ns = last_ns_[static_cast<std::size_t>(other)];
    if (other == image.camera || last_ns == kNever) continue;
    const std::int64_t distance_ns = std::abs(image.t_ns - last_ns);
    nearest_ns_ = std::min(nearest_ns_.value_or(distance_ns), distance_ns);
  }
}

/// Forgets which images there were.
void ImageGroups::begin_again() {
  last_ns_.fill(kNever);
  clocks_.fill(SetBackClock(kMostBehind));
  first_ns_.reset();
  newest_ns_.reset();
  group_ns_.reset();
  ++n_begun_;
}

bool ImageGroups::is_silent(std::size_t camera, std::int64_t t_ns) const {
  const std::int64_t last_ns = last_ns_[camera] != kNever ? last_ns_[camera] : *first_ns_;
  return t_ns - last_ns > kSilentNs;
}

bool ImageGroups::is_complete(const ImageGroup& group, std::int64_t t_ns) const {
  for (std::size_t i = 0; i < static_cast<std::size_t>(n_cameras_); ++i) {
    if (group.images[i].source == nullptr && !is_silent(i, t_ns)) return false;
  }
  return true;
}

std::optional<ImageSample> ImageGroups::next_image(Sensor& input, Rejections& rejections) {
  Measurement measurement;
  while (!ended_) {
    const Status status = input.next(measurement);
    if (status == Status::kEnd) {
      ended_ = true;
      break;
    }
    const auto* image = measurement.get_if<ImageSample>();
    if (status != Status::kOk || image == nullptr || image->camera < 0 ||
        image->camera >= n_cameras_) {
      ++others_;
      continue;
    }
    const auto where = [image] { return place(image->camera, image->t_ns); };
    if (image->source == nullptr) {
      rejections.add("image without pixels", where);
      continue;
    }
    note_distance(*image);
    const auto camera = static_cast<std::size_t>(image->camera);
    if (last_ns_[camera] != kNever && clocks_[camera].see(image->t_ns, last_ns_[camera])) {
      rejections.add("clock of the images set back: they are taken from here on", where);
      begin_again();
    }
    if (!first_ns_) first_ns_ = image->t_ns;
    std::int64_t& last_ns = last_ns_[camera];
    if (group_ns_ && image->t_ns > last_ns && image->t_ns <= *group_ns_ &&
        is_silent(camera, image->t_ns)) {
      rejections.add("image of a camera that was silent: from here on it is waited for", where);
      last_ns = image->t_ns;
      continue;
    }
    if (image->t_ns <= last_ns || (group_ns_ && image->t_ns <= *group_ns_) ||
        (newest_ns_ && image->t_ns < *newest_ns_ - tolerance_ns_)) {
      rejections.add("image whose stamp is not after the previous one", where);
      continue;
    }
    last_ns = image->t_ns;
    newest_ns_ = std::max(newest_ns_.value_or(image->t_ns), image->t_ns);
    ++images_;
    return *image;
  }
  return std::nullopt;
}

bool ImageGroups::next(Sensor& input, Rejections& rejections, ImageGroup& out) {
  out = {};
  std::optional<ImageSample> image =
      ahead_ ? std::exchange(ahead_, std::nullopt) : next_image(input, rejections);
  if (!image) return false;
  const std::int64_t begin_ns = image->t_ns;
  const int n_begun = n_begun_;
  std::int64_t newest_ns = begin_ns;
  for (; image; image = next_image(input, rejections)) {
    auto& slot = out.images[static_cast<std::size_t>(image->camera)];
    if (slot.source != nullptr || std::abs(image->t_ns - begin_ns) > tolerance_ns_) {
      ahead_ = std::move(image);
      break;
    }
    slot = {image->t_ns, std::move(image->source)};
    newest_ns = std::max(newest_ns, slot.t_ns);
    if (is_complete(out, begin_ns)) break;
  }
  // Behind a clock that is set back meanwhile the stamps of this group are of another time.
  if (n_begun == n_begun_) group_ns_ = newest_ns;
  return true;
}

}  // namespace viwo::klt

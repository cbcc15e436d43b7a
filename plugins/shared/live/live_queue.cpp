#include "live_queue.hpp"

#include <algorithm>
#include <utility>

namespace viwo::live {

ImageOrder::ImageOrder(std::size_t n_cameras) : cameras_(n_cameras) {}

bool ImageOrder::is_final(std::int64_t t_ns) const {
  return std::all_of(cameras_.begin(), cameras_.end(), [t_ns](const Camera& camera) {
    return !camera.waited_for || (camera.newest_ns && *camera.newest_ns >= t_ns - kSameInstantNs);
  });
}

void ImageOrder::release_first(std::vector<ImageSample>& out) {
  const auto first = waiting_.begin();
  for (auto& [camera, image] : first->second) out.push_back(std::move(image));
  released_ns_ = first->first;
  waiting_.erase(first);
}

bool ImageOrder::add(const ImageSample& image, std::vector<ImageSample>& out) {
  Camera& camera = cameras_.at(static_cast<std::size_t>(image.camera));
  camera.newest_ns = image.t_ns;
  camera.waited_for = true;
  if (released_ns_ && image.t_ns <= *released_ns_) return false;
  waiting_[image.t_ns][image.camera] = image;
  while (!waiting_.empty()) {
    const std::int64_t first_ns = waiting_.begin()->first;
    if (!is_final(first_ns)) {
      if (waiting_.size() <= kMaxWaiting) break;
      for (Camera& silent : cameras_) {
        if (!silent.newest_ns || *silent.newest_ns < first_ns - kSameInstantNs)
          silent.waited_for = false;
      }
    }
    release_first(out);
  }
  return true;
}

void LiveQueue::push(Measurement measurement, std::size_t /*topic*/) {
  {
    const std::scoped_lock lock(mutex_);
    if (ended_) return;
    if (measurement.get_if<ImageSample>() != nullptr) {
      if (n_images_ == max_images_) drop_oldest_images();
      ++n_images_;
    } else if (queue_.size() - n_images_ == max_others_) {
      drop_oldest_other();
    }
    queue_.push_back(std::move(measurement));
  }
  changed_.notify_one();
}

void LiveQueue::drop_oldest_images() {
  const auto oldest = std::find_if(queue_.begin(), queue_.end(), [](const Measurement& m) {
    return m.get_if<ImageSample>() != nullptr;
  });
  const std::int64_t oldest_ns = stamp_ns(*oldest);
  const auto kept = std::remove_if(oldest, queue_.end(), [oldest_ns](const Measurement& m) {
    return m.get_if<ImageSample>() != nullptr && stamp_ns(m) <= oldest_ns + kSameInstantNs;
  });
  const auto n = queue_.end() - kept;
  rejections_.add(
      "image dropped: images come faster than they are taken",
      [oldest_ns] { return stamp_text(oldest_ns); }, n);
  n_images_ -= static_cast<std::size_t>(n);
  queue_.erase(kept, queue_.end());
}

void LiveQueue::drop_oldest_other() {
  const auto oldest = std::find_if(queue_.begin(), queue_.end(), [](const Measurement& m) {
    return m.get_if<ImageSample>() == nullptr;
  });
  rejections_.add("measurement dropped: they come faster than they are taken", stamp_ns(*oldest));
  queue_.erase(oldest);
}

LiveQueue::Taken LiveQueue::pop(Measurement& out, std::chrono::milliseconds wait) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, wait, [this] { return ended_ || !queue_.empty(); });
  if (queue_.empty()) return ended_ ? Taken::kEnded : Taken::kNothing;
  out = std::move(queue_.front());
  queue_.pop_front();
  if (out.get_if<ImageSample>() != nullptr) --n_images_;
  return Taken::kMeasurement;
}

void LiveQueue::end() {
  {
    const std::scoped_lock lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
}

bool LiveQueue::ended() const {
  const std::scoped_lock lock(mutex_);
  return ended_;
}

void LiveQueue::rejections(std::vector<RejectionCount>& out) const {
  const std::scoped_lock lock(mutex_);
  rejections_.append_to(out);
}

}  // namespace viwo::live

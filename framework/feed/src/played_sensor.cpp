#include "played_sensor.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "has_next.hpp"

namespace viwo {
namespace {

constexpr std::chrono::milliseconds kPlayedPollPeriod(50);
/// What is read ahead of the run, and of who works on images.
constexpr std::size_t kMeasurementsAhead = 256, kImagesAhead = 8;

}  // namespace

PlayedSensor::PlayedSensor(const RunSetup& setup, const SensorStream& played,
                           const std::vector<SensorStream>& streams, const FeedHooks& hooks)
    : setup_(setup), played_(played), hooks_(hooks) {
  for (const SensorStream& stream : streams) {
    if (stream.input_name != played.name) continue;
    images_.push_back(std::make_unique<Images>(*this));
    guarded(stream.info, "connect", [&] { stream.sensor->connect(*images_.back()); });
  }
  thread_ = std::thread([this] { read(); });
}

void PlayedSensor::stop() {
  if (!thread_.joinable()) return;
  {
    const std::scoped_lock lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  try {
    guarded(played_.info, "stop", [&] { played_.sensor->stop(); });
  } catch (const std::exception& error) {
    not_stopped_ = not_stopped_text(error);
  }
  thread_.join();
}

template <class Condition>
bool PlayedSensor::wait(std::unique_lock<std::mutex>& lock, Condition&& condition) {
  while (!changed_.wait_for(lock, kPlayedPollPeriod, [&] { return stop_ || condition(); })) {
    if (hooks_.interrupted && hooks_.interrupted()) return false;
  }
  return !stop_;
}

void PlayedSensor::read() {
  std::exception_ptr error;
  try {
    Measurement measurement;
    while (has_next(played_.info, *played_.sensor, measurement)) {
      std::unique_lock lock(mutex_);
      if (!wait(lock, [this] { return has_room(); })) break;
      take(std::move(measurement));
      lock.unlock();
      changed_.notify_all();
    }
  } catch (...) {
    error = std::current_exception();
  }
  {
    const std::scoped_lock lock(mutex_);
    ended_ = true;
    error_ = error;
  }
  changed_.notify_all();
}

/// With the mutex.
void PlayedSensor::take(Measurement measurement) {
  if (const auto* image = measurement.get_if<ImageSample>()) {
    for (const auto& images : images_) images->waiting_.push_back(*image);
    if (hooks_.on_live_image) hooks_.on_live_image(*image);
  }
  if (is_wanted(measurement.view().type())) ahead_.push_back(std::move(measurement));
}

/// Who waits for a measurement is not kept from it by those that wait for somebody else.
bool PlayedSensor::has_room() const {
  const auto is_empty = [](const auto& images) { return images->waiting_.empty(); };
  const auto is_full = [](const auto& images) { return images->waiting_.size() >= kImagesAhead; };
  if (ahead_.empty() || std::any_of(images_.begin(), images_.end(), is_empty)) return true;
  return ahead_.size() < kMeasurementsAhead &&
         std::none_of(images_.begin(), images_.end(), is_full);
}

bool PlayedSensor::is_wanted(const SampleType& type) const {
  const auto routes = setup_.routes.all();
  return std::any_of(routes.begin(), routes.end(), [&](const Route& route) {
    return route.sensor == played_.name && *route.type == type;
  });
}

Measurement* PlayedSensor::head() {
  if (has_head_) return &head_;
  std::unique_lock lock(mutex_);
  if (!wait(lock, [this] { return ended_ || !ahead_.empty(); })) return nullptr;
  if (ahead_.empty()) {
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
    return nullptr;
  }
  head_ = std::move(ahead_.front());
  ahead_.pop_front();
  has_head_ = true;
  lock.unlock();
  changed_.notify_all();
  return &head_;
}

Status PlayedSensor::Images::next(Measurement& out) {
  std::unique_lock lock(from_.mutex_);
  const auto is_there = [this] { return from_.ended_ || !waiting_.empty(); };
  if (!from_.wait(lock, is_there) || waiting_.empty()) return Status::kEnd;
  out = std::move(waiting_.front());
  waiting_.pop_front();
  lock.unlock();
  from_.changed_.notify_all();
  return Status::kOk;
}

}  // namespace viwo

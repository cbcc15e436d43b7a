// Between the threads that receive and the one that takes: a queue that loses images when it is
// read too slowly, and anything else only when it is hardly read at all; and what brings the images
// of several cameras into order.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "viwo/api/measurement.hpp"
#include "viwo/api/rejections.hpp"
#include "viwo/api/sensor.hpp"

namespace viwo::live {

/// Gives the images of all cameras in the order of their stamps (those of one instant by camera),
/// whichever of their messages came first. An image waits until every camera has given one of its
/// instant or a later one; a camera that gives nothing for kMaxWaiting instants is waited for no
/// longer, until it gives an image again.
class ImageOrder {
 public:
  static constexpr std::size_t kMaxWaiting = 3;

  explicit ImageOrder(std::size_t n_cameras);

  /// Appends to `out` what need not wait any longer. False for an image that comes when later ones
  /// are gone: it is dropped. Stamps of one camera must increase.
  bool add(const ImageSample& image, std::vector<ImageSample>& out);

 private:
  bool is_final(std::int64_t t_ns) const;
  void release_first(std::vector<ImageSample>& out);

  struct Camera {
    std::optional<std::int64_t> newest_ns;
    bool waited_for = true;
  };
  std::vector<Camera> cameras_;
  /// By stamp, then by camera.
  std::map<std::int64_t, std::map<int, ImageSample>> waiting_;
  std::optional<std::int64_t> released_ns_;
};

/// What stands between who receives and who takes.
class MeasurementQueue {
 public:
  enum class Taken : std::uint8_t { kMeasurement, kNothing, kEnded };

  virtual ~MeasurementQueue() = default;
  /// `topic`: the one it came on, of Intake::topics(). After end() nothing is taken in.
  virtual void push(Measurement measurement, std::size_t topic) = 0;
  /// Waits for a measurement. kEnded: nothing will come any more.
  virtual Taken pop(Measurement& out, std::chrono::milliseconds wait) = 0;
  /// What is in the queue can still be taken.
  virtual void end() = 0;
  virtual bool ended() const = 0;
  virtual void rejections(std::vector<RejectionCount>& out) const = 0;
};

/// In the order of arrival.
class LiveQueue final : public MeasurementQueue {
 public:
  /// A minute and a half of an IMU of 200 Hz: who is further behind is not going to catch up.
  static constexpr std::size_t kMaxOthers = 20'000;

  /// Holds `max_images` images at most, and `max_others` measurements that are none.
  explicit LiveQueue(std::size_t max_images, std::size_t max_others = kMaxOthers)
      : max_images_(max_images), max_others_(max_others) {}

  /// Where an image has no room, all images of the oldest instant go: one of a stereo pair alone is
  /// of little use. Of other measurements the oldest goes.
  void push(Measurement measurement, std::size_t topic = 0) override;
  Taken pop(Measurement& out, std::chrono::milliseconds wait) override;
  void end() override;
  bool ended() const override;
  void rejections(std::vector<RejectionCount>& out) const override;

 private:
  void drop_oldest_images();
  void drop_oldest_other();

  std::size_t max_images_, max_others_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Measurement> queue_;
  std::size_t n_images_ = 0;
  bool ended_ = false;
  Rejections rejections_;
};

}  // namespace viwo::live

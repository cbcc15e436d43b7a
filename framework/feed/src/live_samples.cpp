#include "live_samples.hpp"

#include "channels.hpp"

namespace viwo {

void LiveSamples::note(const std::string& sensor, SampleView sample) {
  const auto* const wheels = sample.get_if<EncoderSample>();
  if (wheels != nullptr && checked_.insert(sensor).second) {
    require_channels(setup_, sensor, *wheels);
  }
  setup_.routes.dispatch(sensor, sample.type(), [&](const Route& route) {
    if (route.consumer == Consumer::kImu) has_imu_ = true;
    if (route.consumer != Consumer::kReferencePoses) return;
    if (gate_.accept(sensor, sample)) add_to_reference(stamped_pose(*sample.get_if<PoseSample>()));
  });
}

void LiveSamples::finish(FeedReport& report) const {
  report.reference = reference();
  gate_.append_to(report.rejections);
  if (!has_imu_) report.cause = kNothingCame;
}

void LiveSamples::add_to_reference(const StampedPose& pose) {
  if (newest_) reference_.add({*newest_, pose});
  newest_ = pose;
}

Trajectory LiveSamples::reference() const {
  Trajectory poses;
  for (const auto& pair : reference_.points()) {
    for (const StampedPose& pose : pair) {
      if (poses.empty() || pose.t_ns > poses.back().t_ns) poses.push_back(pose);
    }
  }
  return poses;
}

}  // namespace viwo

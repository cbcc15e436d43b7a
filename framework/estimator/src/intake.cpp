#include "viwo/estimator/intake.hpp"

namespace viwo {

Intake::Intake(const DeclarationTable& declared, const ImuLimits& limits)
    : takers_(declared.taken()), taken_(takers_.size()), imu_(limits) {
  for (const SharedStream& stream : declared.streams()) streams_.emplace_back(stream);
}

std::optional<std::int64_t> Intake::newest_imu_ns() const {
  return imu_.empty() ? std::nullopt : std::optional(imu_.newest_ns());
}

void Intake::add(std::size_t stream, SampleView sample, const StateBlocks& blocks) {
  streams_.at(stream).add(sample, blocks, newest_imu_ns(), rejections_);
}

void Intake::finish() {
  finished_ = true;
  imu_.finish(rejections_);
}

std::optional<ImuPrior> Intake::find_start(StartSearch& search, const StateBlocks& blocks) {
  const auto imu_ns = newest_imu_ns();
  imu_.forget_before_start();
  for (Stream& stream : streams_) stream.forget_before_start(blocks, imu_ns, rejections_);
  if (!search.is_due(imu_.samples(), finished_)) return std::nullopt;
  for (std::size_t i = 0; i < taken_.size(); ++i) taken_[i] = streams_[takers_[i].stream].all();
  return search.attempt({imu_.samples(), taken_});
}

void Intake::start_at(std::int64_t t_ns, const StateBlocks& blocks) {
  for (Stream& stream : streams_) stream.start_at(t_ns, blocks, rejections_);
}

std::optional<std::int64_t> Intake::next_epoch_ns(const ScheduleOptions& options,
                                                  std::int64_t begin_ns,
                                                  const StateBlocks& blocks) const {
  return viwo::next_epoch_ns(options, begin_ns, imu_, streams_, blocks, finished_);
}

EpochData Intake::take(std::int64_t begin_ns, std::int64_t end_ns, const StateBlocks& blocks) {
  for (Stream& stream : streams_) stream.take(end_ns, blocks);
  for (std::size_t i = 0; i < taken_.size(); ++i) {
    taken_[i] = streams_[takers_[i].stream].taken(takers_[i].given);
  }
  EpochData data;
  data.begin_ns = begin_ns;
  data.end_ns = end_ns;
  data.streams = taken_;
  data.imu = imu_.cut(begin_ns, end_ns);
  return data;
}

void Intake::forget(std::int64_t end_ns, std::int64_t oldest_clone_ns, const StateBlocks& blocks) {
  imu_.forget_before(end_ns);
  for (Stream& stream : streams_) stream.forget(oldest_clone_ns, blocks);
}

}  // namespace viwo

// `viwo run --mcap`: what the filter knows after each epoch, in a file for viewers of others.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "viwo/log/estimate_log.hpp"
#include "viwo/run/run.hpp"
#include "viwo/view/tracks.hpp"

namespace viwo::app {

class EstimateOutput final : public EstimatorObserver {
 public:
  /// InputError for a run without a filter, and for a file that cannot be written.
  EstimateOutput(const std::filesystem::path& file, const RunSetup& setup);

  /// Adds itself to those who watch a run, after all others.
  void watch(RunHooks& hooks);
  /// After the run. What could not be written; "" for nothing: a disk that is full does not end the
  /// run.
  std::string finish(const RunResult& result);

  void on_epoch(const Filter& filter, const EpochData& data) override;

 private:
  void write(double t_s, const Filter& filter);
  std::vector<std::string> warnings_at(double t_s);

  std::unique_ptr<log::EstimateLog> out_;
  EstimatorObserver* next_ = nullptr;  ///< who watched before
  std::vector<view::Tracks> tracks_;   ///< by camera
  std::vector<log::SeenImage> seen_;   ///< in this epoch
  int piece_ = 0;
  std::vector<std::pair<double, std::string>> warnings_;  ///< of the last seconds, with their times
  std::vector<std::string> since_written_;                ///< warnings after the last epoch
  std::string failure_;
};

}  // namespace viwo::app

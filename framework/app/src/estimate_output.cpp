#include "estimate_output.hpp"

#include <algorithm>
#include <exception>
#include <limits>
#include <stdexcept>

#include "viwo/feed/estimate_sample.hpp"
#include "viwo/files/files.hpp"
#include "viwo/plugin_host/part.hpp"

namespace viwo::app {
namespace {

/// So long a warning counts after it was said, as in what live sensors are told.
constexpr double kWarning_s = 10.;

log::SeenImage seen_image(const FeatureSample& image, const view::Tracks& tracks) {
  log::SeenImage seen{image.camera, image.t_ns, {}};
  for (const view::Track& track : tracks.tracks()) {
    const double age = (track.images - 1.) / (view::kLongTrack - 1.);
    seen.points.push_back({track.trail.back().u_px, track.trail.back().v_px, std::min(age, 1.)});
  }
  return seen;
}

std::unique_ptr<log::EstimateLog> open_mcap(const std::filesystem::path& file) {
  try {
    void* const make = load_part(
        "libviwo_mcap.so", log::kMcapLibraryEntry, "MCAP cannot be written",
        "it comes with the Debian package viwo-ros; a build of one's own needs libsqlite3-dev, "
        "libfastcdr-dev, liblz4-dev and libzstd-dev");
    if (file.has_parent_path()) files::make_folder(file.parent_path());
    return std::unique_ptr<log::EstimateLog>(reinterpret_cast<log::EstimateLogMaker>(make)(file));
  } catch (const std::runtime_error& error) {
    throw InputError(std::string("--mcap: ") + error.what());
  }
}

}  // namespace

EstimateOutput::EstimateOutput(const std::filesystem::path& file, const RunSetup& setup) {
  if (!setup.filter) {
    throw InputError(
        "--mcap has what the filter does, but this run has none (a section 'updates')");
  }
  tracks_.resize(setup.filter->cameras.size());
  out_ = open_mcap(file);
}

void EstimateOutput::watch(RunHooks& hooks) {
  hooks.on_start = [this, then = hooks.on_start](const Estimator& estimator) {
    if (then) next_ = then(estimator);
    return this;
  };
  hooks.on_epoch = [this, then = hooks.on_epoch](const RunResult& result) {
    if (then) then(result);
    piece_ = static_cast<int>(result.pieces.size()) - 1;
  };
  hooks.on_estimate = [this, then = hooks.on_estimate](double t_s, const Filter& filter) {
    if (then) then(t_s, filter);
    write(t_s, filter);
  };
  hooks.on_warning = [this, then = hooks.on_warning](double t_s, const std::string& text) {
    if (then) then(t_s, text);
    warnings_.emplace_back(t_s, text);
    since_written_.push_back(text);
  };
}

void EstimateOutput::on_epoch(const Filter& filter, const EpochData& data) {
  if (next_ != nullptr) next_->on_epoch(filter, data);  // pictures look at nothing else
  for (const FeatureSample& image : view::images_of(data)) {
    const auto index = static_cast<std::size_t>(image.camera);
    if (index >= tracks_.size()) continue;
    tracks_[index].add(image.points);
    seen_.push_back(seen_image(image, tracks_[index]));
  }
}

std::vector<std::string> EstimateOutput::warnings_at(double t_s) {
  std::erase_if(warnings_, [t_s](const auto& said) { return said.first < t_s - kWarning_s; });
  std::vector<std::string> texts;
  for (const auto& [said_s, text] : warnings_) texts.push_back(text);
  return texts;
}

void EstimateOutput::write(double t_s, const Filter& filter) {
  EstimateSample estimate = estimate_sample(filter, piece_, warnings_at(t_s));
  estimate.latency_s = std::numeric_limits<double>::quiet_NaN();  // of no interest afterwards
  const std::vector<log::SeenImage> seen = std::exchange(seen_, {});
  since_written_.clear();
  if (!failure_.empty()) return;
  try {
    out_->write(estimate, seen);
  } catch (const std::exception& error) {
    failure_ = error.what();
  }
}

std::string EstimateOutput::finish(const RunResult& result) {
  if (!failure_.empty()) return failure_;
  try {
    std::string why = reason(result);
    if (why.empty() && result.status != RunStatus::kOk) why = "the run failed";
    out_->close(why, since_written_);
  } catch (const std::exception& error) {
    failure_ = error.what();
  }
  return failure_;
}

}  // namespace viwo::app

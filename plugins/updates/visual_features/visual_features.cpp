#include "visual_features.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "viwo/camera/camera_model.hpp"
#include "viwo/math/chi2.hpp"

namespace viwo::visual {
namespace {

constexpr std::array kReasonTexts{"camera that the configuration does not have",
                                  "pixel without a direction",
                                  "id twice in one image",
                                  "no room for another track (max_tracks)",
                                  "track lost with too few observations (min_observations)",
                                  "track beyond max_features",
                                  "track with too little parallax (max_condition)",
                                  "point out of the sight of one of its cameras",
                                  "point too near or too far",
                                  "track dropped by the chi-square gate"};

}  // namespace

VisualFeatures::VisualFeatures(const ParamSet& params, const HostServices& /*services*/)
    : sigma_px_(params.number("sigma_px")),
      gate_probability_(params.number("gate_probability")),
      max_features_(static_cast<int>(params.integer("max_features"))),
      min_observations_(static_cast<int>(params.integer("min_observations"))),
      max_tracks_(static_cast<int>(params.integer("max_tracks"))),
      limits_{.min_distance_m = params.number("min_distance_m"),
              .max_distance_m = params.number("max_distance_m"),
              .max_condition = params.number("max_condition")} {
  if (limits_.min_distance_m >= limits_.max_distance_m) {
    throw ParamError("min_distance_m", "min_distance_m must be less than max_distance_m");
  }
}

void VisualFeatures::start(const UpdateSetup& setup) {
  static_assert(kReasonTexts.size() == static_cast<std::size_t>(Reason::kCount));
  const int n_cameras = static_cast<int>(setup.cameras.size());
  if (n_cameras == 0) throw InputError("visual_features needs a camera");
  if (setup.max_clones < 1 || setup.max_clones > kMaxWindowClones) {
    throw InputError("visual_features works with 1 to " + std::to_string(kMaxWindowClones) +
                     " clones, not " + std::to_string(setup.max_clones));
  }
  const int max_sights = setup.max_clones * n_cameras;
  const int max_calibration = kCalibrationSize * n_cameras;
  tracks_.start(max_tracks_, setup.max_clones, n_cameras);
  window_.start(setup.max_clones, n_cameras);
  feature_.start(max_sights, sigma_px_, limits_);
  equations_.start(kPoseSize * setup.max_clones + max_calibration, max_calibration, max_sights);
  candidates_.reserve(static_cast<std::size_t>(max_tracks_));
  seen_epoch_.assign(static_cast<std::size_t>(max_tracks_), -1);
  image_epoch_.assign(static_cast<std::size_t>(n_cameras), -1);
  gates_.clear();
  for (int dof = 0; dof <= 2 * max_sights && gate_probability_ > 0.; ++dof) {
    gates_.push_back(dof == 0 ? 0. : chi2_quantile(1. - gate_probability_, dof));
  }
}

void VisualFeatures::reject(Reason reason, std::int64_t id) {
  Rejections& rejections = rejections_[static_cast<std::size_t>(reason)];
  if (rejections.count++ == 0) {
    rejections.first_id = id;
    rejections.first_t_ns = now_ns_;
  }
}

void VisualFeatures::update(const FilterView& filter, const EpochData& data, FactorSink& sink) {
  ++epoch_;
  factor_ = nullptr;
  now_ns_ = data.end_ns;
  tracks_.keep_clones(filter.clones);
  if (filter.clones.empty()) return;
  window_.set(filter);
  const int newest = filter.clones.back().slot;
  const bool usable = newest >= 0 && newest < kMaxWindowClones;
  for (const FeatureSample& sample : data.features) {
    if (usable) take_image(filter, sample, newest);
  }
  select(filter);
  const std::size_t n_used = std::min(candidates_.size(), static_cast<std::size_t>(max_features_));
  for (std::size_t i = 0; i < n_used; ++i) use(candidates_[i], sink);
  // A track that loses only its oldest observation waits: that goes with the clone.
  for (std::size_t i = n_used; i < candidates_.size(); ++i) {
    reject(Reason::kTooMany, candidates_[i].id);
    if (candidates_[i].lost) tracks_.remove(candidates_[i].track);
  }
  if (factor_ != nullptr) equations_.finish(*factor_);
}

void VisualFeatures::take_image(const FilterView& filter, const FeatureSample& sample, int slot) {
  const std::size_t n_cameras = std::min(image_epoch_.size(), filter.cameras.size());
  if (sample.camera < 0 || static_cast<std::size_t>(sample.camera) >= n_cameras) {
    reject(Reason::kBadCamera, sample.camera);
    return;
  }
  const auto index = static_cast<std::size_t>(sample.camera);
  image_epoch_[index] = epoch_;
  const CameraView& camera = filter.cameras[index];
  for (const FeaturePoint& point : sample.points) {
    Observation seen;
    seen.uv << point.u_px, point.v_px;
    const auto ray = unproject(camera, seen.uv);
    Eigen::Vector2d uv;
    if (!ray || !ray->allFinite() || !project(camera, *ray, uv, seen.J_ray)) {
      reject(Reason::kBadPixel, point.id);
      continue;
    }
    seen.ray = *ray;
    const int track = tracks_.find_or_add(point.id);
    if (track < 0) {
      reject(Reason::kNoRoom, point.id);
      continue;
    }
    if ((tracks_.mask(track, sample.camera) >> slot & 1u) != 0) {
      reject(Reason::kDuplicate, point.id);
      continue;
    }
    tracks_.set(track, slot, sample.camera, seen);
    seen_epoch_[static_cast<std::size_t>(track)] = epoch_;
  }
}

void VisualFeatures::select(const FilterView& filter) {
  candidates_.clear();
  const CloneView& oldest = filter.clones.front();
  const bool leaves = filter.oldest_leaves && oldest.slot >= 0 && oldest.slot < kMaxWindowClones;
  const std::span<const int> active = tracks_.active();
  for (std::size_t i = active.size(); i-- > 0;) {  // backwards: remove() fills from behind
    const int track = active[i];
    bool lost = seen_epoch_[static_cast<std::size_t>(track)] != epoch_;
    bool at_oldest = false;
    for (int camera = 0; camera < tracks_.n_cameras(); ++camera) {
      const std::uint64_t mask = tracks_.mask(track, camera);
      // Without an image of a camera that knows it, nothing says that it is lost.
      if (mask != 0 && image_epoch_[static_cast<std::size_t>(camera)] != epoch_) lost = false;
      at_oldest = at_oldest || (leaves && (mask >> oldest.slot & 1u) != 0);
    }
    if (!lost && !at_oldest) continue;
    const int length = tracks_.length(track);
    const std::int64_t id = tracks_.id(track);
    if (length >= min_observations_) {
      candidates_.push_back({track, length, id, lost});
    } else if (lost) {
      reject(Reason::kShort, id);
      tracks_.remove(track);
    }
  }
  std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
    return a.length != b.length ? a.length > b.length : a.id < b.id;
  });
}

bool VisualFeatures::passes_gate() {
  if (gates_.empty()) return true;
  const double gate = gates_[2 * feature_.linear().size() - 3];
  return equations_.chi2_bound() <= gate || equations_.chi2(feature_, window_) <= gate;
}

void VisualFeatures::use(const Candidate& candidate, FactorSink& sink) {
  // A track that could not be triangulated goes on if it is still seen: it may gain parallax.
  const auto refuse = [&](Reason reason) {
    reject(reason, candidate.id);
    if (candidate.lost) tracks_.remove(candidate.track);
  };
  if (feature_.collect(tracks_, candidate.track, window_) < min_observations_) {
    return refuse(Reason::kShort);
  }
  FeatureStatus status = feature_.triangulate(window_);
  if (status == FeatureStatus::kOk) status = feature_.linearize(window_);
  switch (status) {
    case FeatureStatus::kOk:
      break;
    case FeatureStatus::kParallax:
      return refuse(Reason::kParallax);
    case FeatureStatus::kNotVisible:
      return refuse(Reason::kNotVisible);
    case FeatureStatus::kDistance:
      return refuse(Reason::kDistance);
  }
  if (!equations_.prepare(feature_)) return refuse(Reason::kParallax);
  if (passes_gate()) {
    if (factor_ == nullptr) {
      factor_ = &sink.add_information();
      equations_.begin(window_, *factor_);
    }
    equations_.add(feature_, window_, *factor_);
    sink.count(1, 0);
  } else {
    reject(Reason::kGate, candidate.id);
    sink.count(0, 1);
  }
  tracks_.remove(candidate.track);
}

void VisualFeatures::rejections(std::vector<RejectionCount>& out) const {
  for (std::size_t i = 0; i < rejections_.size(); ++i) {
    const Rejections& r = rejections_[i];
    if (r.count == 0) continue;
    const bool is_camera = i == static_cast<std::size_t>(Reason::kBadCamera);
    out.push_back({kReasonTexts[i], r.count,
                   (is_camera ? "camera " : "id ") + std::to_string(r.first_id) + " at " +
                       std::to_string(r.first_t_ns) + " ns"});
  }
}

}  // namespace viwo::visual

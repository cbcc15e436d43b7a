#include "visual_features.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <span>
#include <string>

#include "relinearisation.hpp"
#include "viwo/camera/camera_model.hpp"
#include "viwo/math/chi2.hpp"

namespace viwo::visual {
namespace {

constexpr const char* kBadCamera = "camera that the configuration does not have";
constexpr const char* kNoClone = "image that belongs to no clone, or is the second of its clone";
constexpr const char* kBadPixel = "pixel without a direction";
constexpr const char* kDuplicate = "id twice in one image";
constexpr const char* kNoRoom = "no room for another track (max_tracks)";
constexpr const char* kShort = "track lost with too few observations (min_observations)";
constexpr const char* kTooMany = "track beyond max_features";
constexpr const char* kBroken = "track with something that is not finite";
constexpr const char* kNotVisible = "point out of the sight of one of its cameras";
constexpr const char* kNear = "point too near (min_distance_m)";
constexpr const char* kGate = "track dropped by the chi-square gate";
constexpr const char* kMoves =
    "track dropped: its point moves (much of the view does, or calibration or clock of the cameras "
    "is off)";
constexpr const char* kStray = "observation left out: the others of its track see another point";
constexpr std::size_t kReasons = 13;
/// In an epoch: their covariance is worked out, which most others do not need.
constexpr int kTracksThatTellNoise = 2;
/// Where rows leave out more than this, in sigmas of a pixel, they are linearised again (VF-30).
constexpr double kRough = 1.;
/// Times as many tracks are tried in an epoch as may be used: what a try costs is bounded, too.
constexpr std::size_t kTries = 3;
constexpr int kMotionDof = 3;  ///< of a velocity

const char* reason_of(FeatureStatus status) {
  switch (status) {
    case FeatureStatus::kNotVisible:
      return kNotVisible;
    case FeatureStatus::kNear:
      return kNear;
    default:
      return kBroken;
  }
}

}  // namespace

VisualFeatures::VisualFeatures(const Params& params, const HostServices& services)
    : params_(params), exact_(services.exact) {
  noise_.set_enabled(!services.exact && params.find_noise);
  dropped_.reserve(kReasons);
}

void VisualFeatures::declare(Declarations& host) {
  const std::span<const CameraPrior> cameras = host.rig().cameras();
  if (cameras.empty()) throw InputError("needs a camera: there is no section 'cameras'");
  cameras_.assign(cameras.begin(), cameras.end());
  StreamSpec images;
  images.type = &sample_type<FeatureSample>();
  images.ends_epochs = true;
  images.per_instant = static_cast<int>(cameras_.size());
  blocks_.clear();
  for (int i = 0; i < images.per_instant; ++i) {
    const CameraBlocks& blocks = blocks_.emplace_back(declare_camera(host, i));
    images.clocks.push_back({blocks.middle_constant_s, blocks.clock});
  }
  images_ = host.stream(images);
  if (params_.max_landmarks > 0) {
    room_ = host.room({.name = "landmarks", .blocks = params_.max_landmarks, .entries = 3});
  }
}

void VisualFeatures::start(const UpdateSetup& setup) {
  if (setup.max_clones < 1 || setup.max_clones > kMaxWindowClones) {
    throw InputError("visual_features works with 1 to " + std::to_string(kMaxWindowClones) +
                     " clones, not " + std::to_string(setup.max_clones));
  }
  const int n_cameras = static_cast<int>(cameras_.size());
  const int max_sights = setup.max_clones * n_cameras;
  tracks_.start(params_.max_tracks, setup.max_clones, n_cameras);
  window_.start(setup.max_clones, cameras_, blocks_);
  feature_.start(max_sights, params_.sigma_px, params_.min_distance_m, exact_);
  equations_.start(setup.max_clones, n_cameras);
  gate_.start(setup.max_clones, n_cameras);
  candidates_.reserve(static_cast<std::size_t>(params_.max_tracks));
  const auto most_used =
      static_cast<std::size_t>(std::min(params_.max_features, params_.max_tracks));
  used_.reserve(most_used);
  used_sights_.reserve(most_used * static_cast<std::size_t>(max_sights));
  seconds_.reserve(static_cast<std::size_t>(params_.max_tracks));
  seen_epoch_.assign(static_cast<std::size_t>(params_.max_tracks), -1);
  const auto thresholds = [&](double probability) {
    std::vector<double> of_dof;
    for (int dof = 0; dof <= 2 * max_sights && probability > 0.; ++dof) {
      of_dof.push_back(dof == 0 ? 0. : chi2_quantile(1. - probability, dof));
    }
    return of_dof;
  };
  thresholds_ = thresholds(params_.gate_probability / 2.);
  landmarks_.start({.most = params_.max_landmarks,
                    .sigma_px = params_.sigma_px,
                    .min_distance_m = params_.min_distance_m},
                   room_, params_.max_tracks, setup.max_clones, blocks_,
                   thresholds(params_.gate_probability));
}

void VisualFeatures::reject(const char* reason, std::int64_t id, std::int64_t count) {
  auto known = std::find_if(dropped_.begin(), dropped_.end(),
                            [&](const Dropped& dropped) { return dropped.reason == reason; });
  if (known == dropped_.end()) known = dropped_.insert(known, {reason, 0, id, now_ns_});
  known->count += count;
}

void VisualFeatures::rejections(std::vector<RejectionCount>& out) const {
  for (const Dropped& dropped : dropped_) {
    const bool of_camera = dropped.reason == kBadCamera || dropped.reason == kNoClone;
    out.push_back({dropped.reason, dropped.count,
                   (of_camera ? "camera " : "id ") + std::to_string(dropped.first_id) + " at " +
                       std::to_string(dropped.first_ns) + " ns",
                   dropped.reason == kMoves ? tried_ : 0});
  }
}

void VisualFeatures::noises(std::vector<NoiseFound>& out) const {
  noise_.append_to("sigma_px", "px", params_.sigma_px, out);
}

void VisualFeatures::update(const FilterView& filter, const EpochData& data, FactorSink& sink) {
  ++epoch_;
  factor_ = nullptr;
  now_ns_ = data.end_ns;
  tracks_.keep_clones(filter.clones);
  if (filter.clones.empty()) return;
  window_.set(filter);
  gate_.begin();
  used_.clear();
  used_sights_.clear();
  second_order_ = 0.;
  weighed_ = 0;
  feature_.set_sigma(noise_.scale() * params_.sigma_px);
  landmarks_.set_sigma(noise_.scale() * params_.sigma_px);
  landmarks_.begin(window_, tracks_);
  images_now_ = 0;
  for (const FeatureSample& sample : data.samples<FeatureSample>(images_)) take_image(sample);
  window_.set_poses();
  select(filter);
  // Tracks that have no point yet come again and again: they must not take the place of others.
  const auto most = static_cast<std::size_t>(params_.max_features);
  std::size_t n_tried = 0;
  for (std::size_t used = 0; used < most && n_tried < std::min(candidates_.size(), kTries * most);
       ++n_tried) {
    if (use(candidates_[n_tried], sink)) ++used;
  }
  // A track that loses only its oldest observation waits: that goes with the clone.
  for (std::size_t i = n_tried; i < candidates_.size(); ++i) {
    reject(kTooMany, candidates_[i].id);
    if (candidates_[i].lost) tracks_.remove(candidates_[i].track);
  }
  const bool sees_landmarks = landmarks_.look(tracks_, images_now_);
  if (sees_landmarks) landmarks_.use_sights(window_, tracks_, factor(sink), sink);
  if (factor_ != nullptr) equations_.finish(window_, *factor_);
  const bool may_be_again = params_.linearise_twice && !sees_landmarks && sink.added().empty();
  if (may_be_again && second_order_ > kRough) linearise_again(filter);
  for (const Used& used : used_) tracks_.remove(used.track);
}

/// A track that has no point there is left out.
void VisualFeatures::linearise_again(const FilterView& prior) {
  const InformationFactor first = *factor_;
  const Relinearisation there(prior, window_, first);
  window_.set(there.view());
  window_.set_poses();
  equations_.begin(window_, *factor_);
  bool is_any = false;
  std::span<const Sight> sights = used_sights_;
  for (const Used& used : used_) {
    feature_.take(sights.first(used.n_sights));
    sights = sights.subspan(used.n_sights);
    if (feature_.triangulate(window_) != FeatureStatus::kOk ||
        feature_.linearize(window_) != FeatureStatus::kOk || !equations_.prepare(feature_)) {
      continue;
    }
    equations_.add(feature_, window_, *factor_);
    is_any = true;
  }
  if (!is_any) {
    *factor_ = first;
    return;
  }
  equations_.finish(window_, *factor_);
  there.move_back(*factor_);
}

void VisualFeatures::add(const Candidate& candidate, FactorSink& sink) {
  equations_.add(feature_, window_, factor(sink));
  sink.count(1, 0);
  const std::vector<Sight>& sights = feature_.sights();
  used_.push_back({candidate.track, sights.size()});
  used_sights_.insert(used_sights_.end(), sights.begin(), sights.end());
  second_order_ = std::max(second_order_, feature_.second_order());
}

void VisualFeatures::settle(const FilterView& filter, BlockEdits& edits) {
  landmarks_.settle(filter, tracks_, edits);
}

InformationFactor& VisualFeatures::factor(FactorSink& sink) {
  if (factor_ == nullptr) {
    factor_ = &sink.add_information();
    equations_.begin(window_, *factor_);
  }
  return *factor_;
}

void VisualFeatures::take_image(const FeatureSample& sample) {
  if (sample.camera < 0 || sample.camera >= window_.n_cameras()) {
    return reject(kBadCamera, sample.camera);
  }
  const std::optional<int> slot = window_.take_image(sample.camera, sample.t_ns);
  if (!slot) return reject(kNoClone, sample.camera);
  images_now_ |= bit_of_camera(sample.camera);
  const CameraView& camera = window_.camera(sample.camera).view;
  for (const FeaturePoint& point : sample.points) {
    Observation seen;
    seen.uv << point.u_px, point.v_px;
    const auto ray = unproject(camera, seen.uv, &seen.J_ray);
    if (!ray || !ray->allFinite()) {
      reject(kBadPixel, point.id);
      continue;
    }
    seen.ray = *ray;
    const int track = tracks_.find_or_add(point.id);
    if (track < 0) {
      reject(kNoRoom, point.id);
      continue;
    }
    if ((tracks_.mask(track, sample.camera) >> *slot & 1u) != 0) {
      reject(kDuplicate, point.id);
      continue;
    }
    tracks_.set(track, *slot, sample.camera, seen);
    seen_epoch_[static_cast<std::size_t>(track)] = epoch_;
  }
}

void VisualFeatures::select(const FilterView& filter) {
  candidates_.clear();
  const CloneState& oldest = filter.clones.front();
  const bool leaves = filter.oldest_leaves && oldest.slot >= 0 && oldest.slot < kMaxWindowClones;
  const std::span<const int> active = tracks_.active();
  for (std::size_t i = active.size(); i-- > 0;) {  // backwards: remove() fills from behind
    const int track = active[i];
    if (landmarks_.is_landmark(track)) continue;
    bool lost = seen_epoch_[static_cast<std::size_t>(track)] != epoch_;
    bool at_oldest = false;
    for (int camera = 0; camera < tracks_.n_cameras(); ++camera) {
      const std::uint64_t mask = tracks_.mask(track, camera);
      // Without an image of a camera that knows it, nothing says that it is lost.
      if (mask != 0 && (images_now_ & bit_of_camera(camera)) == 0) lost = false;
      at_oldest = at_oldest || (leaves && (mask >> oldest.slot & 1u) != 0);
    }
    if (!lost && !at_oldest) continue;
    const int length = tracks_.length(track);
    const std::int64_t id = tracks_.id(track);
    if (length >= params_.min_observations) {
      candidates_.push_back({track, length, id, lost, 0.});
    } else if (lost) {
      reject(kShort, id);
      tracks_.remove(track);
    }
  }
  std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
    return a.length != b.length ? a.length > b.length : a.id < b.id;
  });
  choose_landmarks();
}

void VisualFeatures::choose_landmarks() {
  const int room = landmarks_.room();
  if (room == 0) return;
  seconds_.clear();
  for (Candidate& candidate : candidates_) {
    if (candidate.lost) continue;
    candidate.seconds_in_sight = landmarks_.seconds_in_sight(candidate.track, window_, tracks_);
    if (candidate.seconds_in_sight > 0.) seconds_.push_back(candidate.seconds_in_sight);
  }
  const auto n = static_cast<std::size_t>(room);
  if (seconds_.size() <= n) return;
  const auto least = seconds_.begin() + (room - 1);
  std::nth_element(seconds_.begin(), least, seconds_.end(), std::greater<>());
  for (Candidate& candidate : candidates_) {
    if (candidate.seconds_in_sight < *least) candidate.seconds_in_sight = 0.;
  }
}

bool VisualFeatures::passes_gate() {
  moves_ = false;
  if (thresholds_.empty() && !noise_.enabled()) return true;
  const int dof = 2 * static_cast<int>(feature_.linear().size()) - 3;
  const int dof_of_noise = dof - kMotionDof;
  // The longest tracks of an epoch tell the noise.
  const bool tells_noise = noise_.enabled() && weighed_ < kTracksThatTellNoise &&
                           dof_of_noise > 0 && feature_.has_plain_noise();
  const bool may_move = equations_.motion_bound() > threshold(kMotionDof);
  if (!tells_noise && !may_move && equations_.chi2_bound() <= threshold(dof)) return true;
  const double chi2 = gate_.chi2(feature_, window_);
  if (!std::isfinite(chi2)) return false;
  moves_ = may_move && gate_.chi2_of_motion() > threshold(kMotionDof);
  if (tells_noise) {
    const double most = threshold(dof_of_noise);
    const bool is_beyond = chi2 - gate_.chi2_of_motion() > most;
    told_ = Told{is_beyond ? most / dof_of_noise : 0.};
  }
  return !moves_ && chi2 <= threshold(dof);
}

void VisualFeatures::tell_noise() {
  if (!told_) return;
  ++weighed_;
  if (told_->beyond > 0.) {
    noise_.add_beyond(told_->beyond);
  } else {
    gate_.tell(noise_);
  }
}

/// Triangulates and linearises the sights of the feature, and asks the gate.
FeatureStatus VisualFeatures::try_feature(bool& passes) {
  passes = false;
  told_.reset();
  FeatureStatus status = feature_.triangulate(window_);
  if (status == FeatureStatus::kOk) status = feature_.linearize(window_);
  if (status != FeatureStatus::kOk) return status;
  if (!equations_.prepare(feature_)) return FeatureStatus::kBroken;
  passes = passes_gate();
  return status;
}

bool VisualFeatures::use(const Candidate& candidate, FactorSink& sink) {
  // A track that could not be triangulated goes on if it is still seen: poses may get better.
  const auto refuse = [&](const char* reason) {
    reject(reason, candidate.id);
    if (candidate.lost) tracks_.remove(candidate.track);
    return false;
  };
  if (feature_.collect(tracks_, candidate.track, window_) < params_.min_observations) {
    return refuse(kShort);
  }
  bool passes = false;
  int strays = 0;
  FeatureStatus status = try_feature(passes);
  if (!passes) {
    // A few strays, false matches, must not cost the track.
    strays = feature_.leave_out_strays();
    if (strays > 0 && static_cast<int>(feature_.sights().size()) >= params_.min_observations) {
      status = try_feature(passes);
      if (passes) reject(kStray, candidate.id, strays);
    }
  }
  tell_noise();  // of what is left: what is left out is no noise of it
  if (status != FeatureStatus::kOk) return refuse(reason_of(status));
  ++tried_;
  if (passes) {
    feature_.remember_distance();
    // A landmark takes the track as it is, strays and all.
    if (strays == 0 && candidate.seconds_in_sight > 0. &&
        landmarks_.add(candidate.track, feature_, window_, tracks_, sink)) {
      return true;
    }
    add(candidate, sink);
    return true;
  }
  reject(moves_ ? kMoves : kGate, candidate.id);
  sink.count(0, 1);
  tracks_.remove(candidate.track);
  return true;
}

}  // namespace viwo::visual

#include "landmarks.hpp"

#include <algorithm>
#include <bit>
#include <limits>

#include "viwo/math/stamp.hpp"

namespace viwo::visual {
namespace {

/// Gate refusals in a row that end a landmark: it has moved, or its track has.
constexpr int kMaxMisses = 2;

/// Clones over which the motion in the image is taken.
constexpr std::size_t kClonesOfMotion = 4;

/// Until a point leaves an image that is `size_px` wide. Where that is not known it stays.
double seconds_to_edge(double at_px, double px_per_s, int size_px) {
  if (size_px <= 0 || px_per_s == 0.) return std::numeric_limits<double>::infinity();
  return std::max(0., (px_per_s > 0. ? size_px - at_px : -at_px) / px_per_s);
}

}  // namespace

void Landmarks::start(const LandmarkOptions& options, RoomId room, int max_tracks, int max_clones,
                      std::span<const CameraBlocks> cameras, std::span<const double> thresholds) {
  options_ = options;
  room_ = room;
  max_clones_ = max_clones;
  cameras_.assign(cameras.begin(), cameras.end());
  thresholds_.assign(thresholds.begin(), thresholds.end());
  landmarks_.clear();
  landmarks_.reserve(static_cast<std::size_t>(options.most));
  of_track_.assign(static_cast<std::size_t>(max_tracks), -1);
  if (options.most == 0) return;
  const int n_cameras = static_cast<int>(cameras.size());
  sights_.reserve(static_cast<std::size_t>(max_clones * n_cameras));
  rows_.start(max_clones, n_cameras,
              kPoseSize * max_clones + kCalibrationSize * n_cameras + 3 * options.most,
              options.sigma_px);
}

void Landmarks::forget(std::size_t index, TrackStore& tracks) {
  const int track = landmarks_[index].track;
  of_track_[static_cast<std::size_t>(track)] = -1;
  tracks.remove(track);
  if (index + 1 < landmarks_.size()) {
    landmarks_[index] = landmarks_.back();
    of_track_[static_cast<std::size_t>(landmarks_[index].track)] = static_cast<int>(index);
  }
  landmarks_.pop_back();
}

void Landmarks::begin(const Window& window, TrackStore& tracks) {
  for (std::size_t i = landmarks_.size(); i-- > 0;) {
    Landmark& landmark = landmarks_[i];
    const int clone = window.clone_in_slot(landmark.slot);
    const bool anchored = clone >= 0 && window.clone(clone).t_ns == landmark.clone_ns;
    if (landmark.is_new) {
      forget(i, tracks);
    } else if (!anchored) {
      landmark.drop = true;
    }
  }
}

double Landmarks::seconds_in_sight(int track, const Window& window,
                                   const TrackStore& tracks) const {
  const auto clones = window.filter().clones;
  const CloneState& now = clones.back();
  const CloneState& before = clones[clones.size() - std::min(clones.size(), kClonesOfMotion)];
  const double dt_s = seconds_between(before.t_ns, now.t_ns);
  double longest_s = 0.;
  for (int camera = 0; camera < window.n_cameras(); ++camera) {
    if (std::popcount(tracks.mask(track, camera)) != max_clones_) continue;
    const CameraView& view = window.camera(camera).view;
    const Eigen::Vector2d uv = tracks.observation(track, now.slot, camera).uv;
    const Eigen::Vector2d moved_px = uv - tracks.observation(track, before.slot, camera).uv;
    longest_s =
        std::max(longest_s, std::min(seconds_to_edge(uv.x(), moved_px.x() / dt_s, view.width_px),
                                     seconds_to_edge(uv.y(), moved_px.y() / dt_s, view.height_px)));
  }
  return longest_s;
}

bool Landmarks::add(int track, const Feature& feature, const Window& window, TrackStore& tracks,
                    FactorSink& sink) {
  // One whose distance is not told yet may be told to be behind the camera later.
  if (room() == 0 || !feature.met().has_distance) return false;
  // The anchor that stays longest: the newest clone, in the first camera that sees it there and has
  // seen it all the time.
  const CloneState& newest = window.filter().clones.back();
  for (int camera = 0; camera < window.n_cameras(); ++camera) {
    if (std::popcount(tracks.mask(track, camera)) != max_clones_) continue;
    const int clone = window.clone_in_slot(newest.slot);
    const WindowClone& at = window.clone(clone);
    const CameraView& view = window.camera(camera).view;
    const Anchor anchor{at.R_GtoI, view.R_ItoC, at.p_IinG, view.p_IinC};
    const Eigen::Vector3d p_C = anchor.to_camera(feature.met().point.p_FinG());
    if (!can_be_anchored(p_C)) continue;
    Landmark landmark;
    landmark.value = inverse_depth_of_point(p_C);
    const auto block = sink.add_block(room_, {landmark.value.data(), 3});
    if (!block) return false;
    landmark.block = *block;
    landmark.id = tracks.id(track);
    landmark.track = track;
    landmark.slot = newest.slot;
    landmark.clone_ns = newest.t_ns;
    landmark.camera = camera;
    landmark.is_new = true;
    of_track_[static_cast<std::size_t>(track)] = size();
    landmarks_.push_back(landmark);
    tracks.keep(track);
    return true;
  }
  return false;
}

bool Landmarks::look(const TrackStore& tracks, std::uint64_t images) {
  bool any = false;
  for (Landmark& landmark : landmarks_) {
    std::uint64_t seen_by = 0;
    for (int camera = 0; camera < tracks.n_cameras(); ++camera) {
      if (tracks.mask(landmark.track, camera) != 0) seen_by |= bit_of_camera(camera);
    }
    landmark.sighted = seen_by != 0;
    // Without an image of a camera that has seen it, nothing says that it is lost.
    if (!landmark.sighted && (landmark.seen_by & ~images) == 0) landmark.drop = true;
    if (landmark.sighted) landmark.seen_by = seen_by;
    any = any || (landmark.sighted && !landmark.drop);
  }
  return any;
}

ColumnRange Landmarks::columns(const FilterView& filter) const {
  int first = std::numeric_limits<int>::max(), end = 0;
  for (const Landmark& landmark : landmarks_) {
    const int column = filter.block(landmark.block).column();
    first = std::min(first, column);
    end = std::max(end, column + 3);
  }
  return {first, end - first};
}

void Landmarks::use_sights(const Window& window, TrackStore& tracks, InformationFactor& factor,
                           FactorSink& sink) {
  const FilterView& filter = window.filter();
  const ColumnRange range = columns(filter);
  const int first = factor.columns.add(range.first, range.count);
  const int size = first + range.count;
  factor.Lambda.block(first, 0, range.count, size).setZero();
  factor.eta.segment(first, range.count).setZero();
  for (Landmark& landmark : landmarks_) {
    if (!landmark.sighted || landmark.drop) continue;
    const BlockView& block = filter.block(landmark.block);
    LandmarkState state;
    state.value = landmark.is_new ? landmark.value : Eigen::Vector3d(block.numbers());
    state.state_column = block.column();
    state.factor_column = first + block.column() - range.first;
    state.clone = window.clone_in_slot(landmark.slot);
    state.camera = landmark.camera;
    collect_sights(tracks, landmark.track, window, sights_);
    const bool ok = rows_.linearize(sights_, window, state) &&
                    (landmark.is_new || thresholds_.empty() ||
                     rows_.passes(window, thresholds_[static_cast<std::size_t>(rows_.rows())]));
    tracks.forget(landmark.track);
    if (ok) rows_.add(factor);
    landmark.misses = ok ? 0 : landmark.misses + 1;
    landmark.drop = landmark.misses >= kMaxMisses;
    sink.count(ok ? 1 : 0, ok ? 0 : 1);
  }
}

bool Landmarks::is_sound(const Landmark& landmark, const FilterView& filter) const {
  const BlockView& block = filter.block(landmark.block);
  const Eigen::Vector3d value = block.numbers();
  if (!value.allFinite() || !(value.z() > 0.)) return false;
  return point_of_inverse_depth(value).norm() >= options_.min_distance_m;
}

void Landmarks::settle(const FilterView& filter, TrackStore& tracks, BlockEdits& edits) {
  const bool leaves = filter.oldest_leaves && filter.clones.size() > 1;
  for (std::size_t i = landmarks_.size(); i-- > 0;) {
    Landmark& landmark = landmarks_[i];
    const int column = filter.block(landmark.block).column();
    if (landmark.is_new && !(filter.P()(column, column) > 0.)) {  // the host has refused it
      forget(i, tracks);
      continue;
    }
    landmark.is_new = false;
    bool keep = !landmark.drop && is_sound(landmark, filter);
    if (keep && leaves && landmark.slot == filter.clones.front().slot) {
      keep = move_anchor(landmark, filter, edits);
    }
    if (keep) continue;
    edits.drop(landmark.block);
    forget(i, tracks);
  }
}

bool Landmarks::move_anchor(Landmark& landmark, const FilterView& filter, BlockEdits& edits) {
  const CloneState& from = filter.clones.front();
  const CloneState& to = filter.clones.back();
  const BlockView& extrinsics =
      filter.block(cameras_[static_cast<std::size_t>(landmark.camera)].extrinsics);
  const BlockView& block = filter.block(landmark.block);
  const Eigen::Matrix3d R_ItoC = extrinsics.rotation();
  const Eigen::Vector3d p_IinC = extrinsics.numbers();
  MovedLandmark moved({from.R_GtoI, R_ItoC, from.p_IinG, p_IinC},
                      {to.R_GtoI, R_ItoC, to.p_IinG, p_IinC}, block.numbers());
  if (!can_be_anchored(moved.p_C)) return false;
  // (VF-25)
  const WorldTurn turn_from = world_turn_of(from), turn_to = world_turn_of(to);
  const Eigen::Vector3d seen = moved.by_old_clone * turn_from + moved.by_new_clone * turn_to;
  make_blind(moved.by_old_clone, 0.5 * seen, turn_from);
  make_blind(moved.by_new_clone, 0.5 * seen, turn_to);
  rewrite_.id = landmark.block;
  rewrite_.columns.clear();
  const auto add = [&](int column, int count) { rewrite_.columns.add(column, count); };
  add(block.column(), 3);
  add(from.column, kPoseSize);
  add(to.column, kPoseSize);
  if (extrinsics.column() >= 0) add(extrinsics.column(), kPoseSize);
  rewrite_.J.resize(3, rewrite_.columns.size());
  rewrite_.J.leftCols<3>() = moved.by_landmark;
  rewrite_.J.middleCols<kPoseSize>(3) = moved.by_old_clone;
  rewrite_.J.middleCols<kPoseSize>(3 + kPoseSize) = moved.by_new_clone;
  if (extrinsics.column() >= 0) rewrite_.J.rightCols<kPoseSize>() = moved.by_extrinsics;
  std::copy(moved.landmark.begin(), moved.landmark.end(), rewrite_.value.begin());
  rewrite_.first_estimate = rewrite_.value;
  edits.rewrite(rewrite_);
  landmark.slot = to.slot;
  landmark.clone_ns = to.t_ns;
  return true;
}

}  // namespace viwo::visual

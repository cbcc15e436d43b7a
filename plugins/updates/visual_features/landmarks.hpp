// Landmarks that stay in the state while they are seen: from tracks that outlive the window.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "feature.hpp"
#include "landmark_rows.hpp"
#include "track_store.hpp"
#include "viwo/api/update.hpp"
#include "window.hpp"

namespace viwo::visual {

struct LandmarkOptions {
  int most = 0;  ///< at a time; 0: none
  double sigma_px = 1.;
  double min_distance_m = 0.1;
};

struct Landmark {
  BlockId block;
  std::int64_t id = 0;  ///< of its feature
  int track = 0;
  int slot = 0;  ///< of the anchor's clone, and its time
  std::int64_t clone_ns = 0;
  int camera = 0;             ///< of the anchor
  std::uint64_t seen_by = 0;  ///< cameras, when it was seen last
  int misses = 0;             ///< refused by the gate, in a row
  bool is_new = false;        ///< added in this call: `value` is not in the filter yet
  bool sighted = false;       ///< in this epoch
  bool drop = false;
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
};

class Landmarks {
 public:
  /// Allocates. `thresholds`: of the gate, per degree of freedom; empty: no gate.
  void start(const LandmarkOptions& options, RoomId room, int max_tracks, int max_clones,
             std::span<const CameraBlocks> cameras, std::span<const double> thresholds);

  void set_sigma(double sigma_px) { rows_.set_sigma(sigma_px); }

  bool is_landmark(int track) const { return of_track_[static_cast<std::size_t>(track)] >= 0; }
  int size() const { return static_cast<int>(landmarks_.size()); }
  int room() const { return options_.most - size(); }
  std::span<const Landmark> all() const { return landmarks_; }

  /// A new epoch: forgets what the host has not taken, or has lost its anchor.
  void begin(const Window& window, TrackStore& tracks);

  /// For how long a track will go on if its point moves on in the image as it has moved last; 0
  /// when no camera has seen it in all clones, infinity for one that stands.
  double seconds_in_sight(int track, const Window& window, const TrackStore& tracks) const;

  /// Makes a linearised feature a landmark if all clones have seen it and there is room.
  bool add(int track, const Feature& feature, const Window& window, TrackStore& tracks,
           FactorSink& sink);

  /// Whether use_sights() has something to say; `images`: bit j, camera j has an image.
  bool look(const TrackStore& tracks, std::uint64_t images);
  /// Adds the sights of this epoch, and all of those of new landmarks, to the factor, which has the
  /// columns of the window so far. Those that the gate refuses are counted.
  void use_sights(const Window& window, TrackStore& tracks, InformationFactor& factor,
                  FactorSink& sink);

  /// Drops what is lost, and gives those a new anchor whose clone leaves.
  void settle(const FilterView& filter, TrackStore& tracks, BlockEdits& edits);

 private:
  /// Where the columns of landmarks begin in the state, and how many from there on are in use.
  ColumnRange columns(const FilterView& filter) const;
  /// False when it is to be dropped.
  bool is_sound(const Landmark& landmark, const FilterView& filter) const;
  bool move_anchor(Landmark& landmark, const FilterView& filter, BlockEdits& edits);
  void forget(std::size_t index, TrackStore& tracks);

  LandmarkOptions options_;
  RoomId room_;
  int max_clones_ = 0;
  std::vector<CameraBlocks> cameras_;
  std::vector<double> thresholds_;
  std::vector<Landmark> landmarks_;
  std::vector<int> of_track_;  ///< index in landmarks_, -1: none
  std::vector<Sight> sights_;
  LandmarkRows rows_;
  BlockRewrite rewrite_;
};

}  // namespace viwo::visual

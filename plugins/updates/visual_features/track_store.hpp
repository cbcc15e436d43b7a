// Feature tracks: which landmark was seen where, by which camera, in the images of which clones.
// All storage is made once; nothing allocates afterwards.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/filter_view.hpp"

namespace viwo::visual {

/// One sight of a landmark.
struct Observation {
  Eigen::Vector2d uv;                 ///< as measured, px
  Eigen::Vector3d ray;                ///< unit vector in C towards it
  Eigen::Matrix<double, 2, 3> J_ray;  ///< d uv / d p_C at `ray`, px
};

/// Bit of a camera in a set of cameras; those beyond 64 share bits.
inline std::uint64_t bit_of_camera(int camera) { return std::uint64_t{1} << (camera & 63); }

class TrackStore {
 public:
  /// `max_clones` at most 64. Allocates.
  void start(int max_tracks, int max_clones, int n_cameras);

  /// Forgets the observations of clones that are gone (a clone is its slot and its time), then
  /// tracks without any but those to keep().
  void keep_clones(std::span<const CloneState> clones);

  /// Track of a landmark: -1 when it has none.
  int find(std::int64_t id) const;
  /// The same, making one when there is none: -1 when there is no room.
  int find_or_add(std::int64_t id);
  /// The track and all of its observations.
  void remove(int track);
  /// Stays until it is removed, also without observations.
  void keep(int track) { kept_[index(track)] = true; }

  std::int64_t id(int track) const { return ids_[index(track)]; }
  /// Bit s: camera has an observation at the clone in slot s.
  std::uint64_t mask(int track, int camera) const { return masks_[mask_index(track, camera)]; }
  /// Over all cameras.
  int length(int track) const;
  const Observation& observation(int track, int slot, int camera) const {
    return observations_[observation_index(track, slot, camera)];
  }
  void set(int track, int slot, int camera, const Observation& observation);
  /// All of its observations.
  void forget(int track) {
    for (int camera = 0; camera < n_cameras_; ++camera) masks_[mask_index(track, camera)] = 0;
  }

  /// Tracks in use, in no particular order.
  std::span<const int> active() const { return active_; }
  int n_cameras() const { return n_cameras_; }

 private:
  static std::size_t index(int i) { return static_cast<std::size_t>(i); }
  std::size_t mask_index(int track, int camera) const {
    return index(track) * index(n_cameras_) + index(camera);
  }
  std::size_t observation_index(int track, int slot, int camera) const {
    return (index(track) * index(max_clones_) + index(slot)) * index(n_cameras_) + index(camera);
  }
  std::size_t home(std::int64_t id) const;
  /// Where `id` stands in the table, or the free place where it would.
  std::size_t place(std::int64_t id) const;

  int max_clones_ = 0;
  int n_cameras_ = 0;
  std::vector<Observation> observations_;
  std::vector<std::uint64_t> masks_;
  std::vector<std::int64_t> ids_;
  std::vector<bool> kept_;
  std::vector<int> place_in_active_;
  std::vector<int> active_;
  std::vector<int> free_;
  std::vector<int> table_;  ///< open addressing, linear probing: track or -1
  std::vector<std::int64_t> slot_time_ns_;
  std::uint64_t slots_ = 0;  ///< that had a clone at the last keep_clones()
};

}  // namespace viwo::visual

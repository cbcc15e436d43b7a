#include "track_store.hpp"

#include <bit>

namespace viwo::visual {

void TrackStore::start(int max_tracks, int max_clones, int n_cameras) {
  max_clones_ = max_clones;
  n_cameras_ = n_cameras;
  const std::size_t tracks = index(max_tracks);
  observations_.assign(tracks * index(max_clones) * index(n_cameras), {});
  masks_.assign(tracks * index(n_cameras), 0);
  ids_.assign(tracks, 0);
  kept_.assign(tracks, false);
  place_in_active_.assign(tracks, -1);
  active_.clear();
  active_.reserve(tracks);
  free_.resize(tracks);
  for (std::size_t i = 0; i < tracks; ++i) free_[i] = static_cast<int>(tracks - 1 - i);
  table_.assign(std::bit_ceil(4 * tracks), -1);
  slot_time_ns_.assign(index(max_clones), 0);
  slots_ = 0;
}

void TrackStore::keep_clones(std::span<const CloneState> clones) {
  std::uint64_t same = 0, now = 0;
  for (const CloneState& clone : clones) {
    if (clone.slot < 0 || clone.slot >= max_clones_) continue;
    const std::uint64_t bit = std::uint64_t{1} << clone.slot;
    std::int64_t& time_ns = slot_time_ns_[index(clone.slot)];
    if ((slots_ & bit) != 0 && time_ns == clone.t_ns) same |= bit;
    now |= bit;
    time_ns = clone.t_ns;
  }
  slots_ = now;
  for (std::size_t i = active_.size(); i-- > 0;) {
    const int track = active_[i];
    std::uint64_t left = 0;
    for (int camera = 0; camera < n_cameras_; ++camera) {
      left |= masks_[mask_index(track, camera)] &= same;
    }
    if (left == 0 && !kept_[index(track)])
      remove(track);  // moves a track from behind, already visited
  }
}

std::size_t TrackStore::home(std::int64_t id) const {
  std::uint64_t h = static_cast<std::uint64_t>(id) * 0x9E3779B97F4A7C15ull;
  h ^= h >> 32;
  return h & (table_.size() - 1);
}

std::size_t TrackStore::place(std::int64_t id) const {
  std::size_t at = home(id);
  while (table_[at] >= 0 && ids_[index(table_[at])] != id) at = (at + 1) & (table_.size() - 1);
  return at;
}

int TrackStore::find(std::int64_t id) const { return table_[place(id)]; }

int TrackStore::find_or_add(std::int64_t id) {
  const std::size_t at = place(id);
  if (table_[at] >= 0) return table_[at];
  if (free_.empty()) return -1;
  const int track = free_.back();
  free_.pop_back();
  table_[at] = track;
  ids_[index(track)] = id;
  place_in_active_[index(track)] = static_cast<int>(active_.size());
  active_.push_back(track);
  forget(track);
  kept_[index(track)] = false;
  return track;
}

void TrackStore::remove(int track) {
  // Close the gap: whatever probed over this place has to be found without it.
  const std::size_t last = table_.size() - 1;
  std::size_t hole = place(ids_[index(track)]);
  for (std::size_t at = (hole + 1) & last; table_[at] >= 0; at = (at + 1) & last) {
    const std::size_t wanted = home(ids_[index(table_[at])]);
    if (((at - wanted) & last) >= ((at - hole) & last)) {
      table_[hole] = table_[at];
      hole = at;
    }
  }
  table_[hole] = -1;
  const int at_active = place_in_active_[index(track)];
  active_[index(at_active)] = active_.back();
  place_in_active_[index(active_.back())] = at_active;
  active_.pop_back();
  free_.push_back(track);
}

int TrackStore::length(int track) const {
  int n = 0;
  for (int camera = 0; camera < n_cameras_; ++camera) {
    n += std::popcount(masks_[mask_index(track, camera)]);
  }
  return n;
}

void TrackStore::set(int track, int slot, int camera, const Observation& observation) {
  observations_[observation_index(track, slot, camera)] = observation;
  masks_[mask_index(track, camera)] |= std::uint64_t{1} << slot;
}

}  // namespace viwo::visual

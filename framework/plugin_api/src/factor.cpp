#include <algorithm>
#include <stdexcept>
#include <string>

#include "viwo/api/status.hpp"
#include "viwo/api/update.hpp"

namespace viwo {

int FactorColumns::add(int first, int count) {
  if (n_blocks_ == kMaxFactorBlocks) throw std::out_of_range("a factor has too many blocks");
  if (first < 0 || count < 0) throw std::out_of_range("a factor's block is held or negative");
  const int start = size_;
  blocks_[static_cast<std::size_t>(n_blocks_++)] = {first, count};
  size_ += count;
  return start;
}

void ResidualFactor::set_rows(int rows) {
  if (rows < 1 || rows > kMaxFactorRows || columns.size() > kMaxFactorColumns) {
    throw std::out_of_range("a residual factor has too many rows or columns");
  }
  H.setZero(rows, columns.size());
  residual.setZero(rows);
  R.setZero(rows, rows);
}

FactorSink::FactorSink(int max_residual_factors, int max_state_size)
    : residuals_(static_cast<std::size_t>(max_residual_factors)) {
  information_.Lambda.setZero(max_state_size, max_state_size);
  information_.eta.setZero(max_state_size);
  added_.reserve(static_cast<std::size_t>(max_state_size));  // a block has an entry at least
}

ResidualFactor& FactorSink::add_residual() {
  if (n_residuals_ == residuals_.size()) throw std::out_of_range("too many residual factors");
  ResidualFactor& factor = residuals_[n_residuals_++];
  factor.columns.clear();
  factor.gate_probability = 0.;
  factor.heavy_tailed = false;
  factor.noise = nullptr;
  return factor;
}

InformationFactor& FactorSink::add_information() {
  information_.columns.clear();
  has_information_ = true;
  return information_;
}

std::optional<BlockId> FactorSink::add_block(RoomId room, std::span<const double> value) {
  const auto index = static_cast<std::size_t>(room.index);
  if (room.index < 0 || index >= rooms_.size() || rooms_[index].free == nullptr) {
    throw ContractError("adds a block to a room that it has not declared");
  }
  FreeBlocks& blocks = rooms_[index];
  if (static_cast<int>(value.size()) != blocks.entries) {
    throw ContractError("adds a block of " + std::to_string(value.size()) +
                        " numbers to a room for blocks of " + std::to_string(blocks.entries));
  }
  if (blocks.taken == blocks.free->size()) return std::nullopt;
  AddedBlock added;
  // From behind, where the host takes them away.
  added.id = (*blocks.free)[blocks.free->size() - ++blocks.taken];
  std::copy(value.begin(), value.end(), added.value.begin());
  added_.push_back(added);
  return added.id;
}

void FactorSink::clear() {
  n_residuals_ = 0;
  has_information_ = false;
  added_.clear();
  for (FreeBlocks& room : rooms_) room.taken = 0;
  applied_ = rejected_ = 0;
}

}  // namespace viwo

#include <stdexcept>

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
}

ResidualFactor& FactorSink::add_residual() {
  if (n_residuals_ == residuals_.size()) throw std::out_of_range("too many residual factors");
  ResidualFactor& factor = residuals_[n_residuals_++];
  factor.columns.clear();
  factor.gate_probability = 0.;
  return factor;
}

InformationFactor& FactorSink::add_information() {
  information_.columns.clear();
  has_information_ = true;
  return information_;
}

void FactorSink::clear() {
  n_residuals_ = 0;
  has_information_ = false;
  applied_ = rejected_ = 0;
}

}  // namespace viwo

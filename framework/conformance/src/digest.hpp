// Numbers to the bit, as one.
#pragma once

#include <bit>
#include <cstdint>

#include <Eigen/Core>

#include "viwo/api/measurement.hpp"
#include "viwo/api/update.hpp"

namespace viwo::conformance {

/// FNV-1a over whatever is added.
class Digest {
 public:
  void add(std::uint64_t bits) {
    for (int i = 0; i < 8; ++i, bits >>= 8) hash_ = (hash_ ^ (bits & 0xff)) * 1099511628211u;
  }
  void add(std::int64_t value) { add(static_cast<std::uint64_t>(value)); }
  void add(int value) { add(static_cast<std::int64_t>(value)); }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  template <class Derived>
  void add(const Eigen::DenseBase<Derived>& values) {
    add(static_cast<std::int64_t>(values.rows()));
    for (Eigen::Index j = 0; j < values.cols(); ++j) {
      for (Eigen::Index i = 0; i < values.rows(); ++i) add(static_cast<double>(values(i, j)));
    }
  }
  void add(const FactorColumns& columns) {
    for (const ColumnRange& block : columns.blocks()) {
      add(block.first);
      add(block.count);
    }
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 14695981039346656037u;
};

/// All values of viwo's own kinds; of others what every kind has: name, time, channel.
std::uint64_t digest_of(const Measurement& measurement);
std::uint64_t digest_of(const FactorSink& sink);

}  // namespace viwo::conformance

#include "png_rows.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

namespace viwo {
namespace {

using Bytes = std::span<const std::uint8_t>;

/// What was subtracted from a pixel: of 1 the one on its left, of 2 the one above, of 3 their mean,
/// of 4 one of them and the one above the left one.
enum Filter : std::uint8_t { kNone, kLeft, kUp, kMean, kPaeth, kFilters };

// A pixel may need the one on its left and those above: of one row, one after the other. Of several
// rows, each a pixel behind the one above it, a pixel of each can be restored at the same time.
constexpr std::size_t kRows = 16;
using Lanes = std::uint8_t __attribute__((vector_size(kRows)));  // a byte of each row
using Tile = std::array<Lanes, kRows>;

/// The bytes at these places of both, one behind the other.
template <std::uint8_t... kPlaces>
Lanes shuffled(Lanes a, Lanes b) {
#ifdef __clang__
  return __builtin_shufflevector(a, b, kPlaces...);
#else
  return __builtin_shuffle(a, b, Lanes{kPlaces...});
#endif
}

/// Rows to columns.
void transpose(Tile& tile) {
  Tile other;
  const auto interleave = [](const Tile& from, Tile& to) {
    constexpr std::size_t kHalf = kRows / 2;
    for (std::size_t i = 0; i < kHalf; ++i) {
      const Lanes a = from[i], b = from[i + kHalf];
      to[2 * i] = shuffled<0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23>(a, b);
      to[2 * i + 1] = shuffled<8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31>(a, b);
    }
  };
  for (int i = 0; i < 2; ++i) {
    interleave(tile, other);
    interleave(other, tile);
  }
}

Lanes distance(Lanes a, Lanes b) { return a > b ? a - b : b - a; }

/// Of three neighbours, the one that is the nearest to left + up - corner.
Lanes paeth(Lanes left, Lanes up, Lanes corner) {
  const Lanes to_left = distance(up, corner), to_up = distance(left, corner);
  // |(up - corner) + (left - corner)|: their sum where both have one sign, at most 255, which is
  // enough to be compared with them.
  const Lanes sum = to_left + to_up;
  const Lanes sum_or_most = sum < to_left ? Lanes{} - 1 : sum;
  const auto one_sign = (up > corner) == (left > corner);
  const Lanes to_corner = one_sign ? sum_or_most : distance(to_left, to_up);
  const Lanes nearer = to_up <= to_corner ? up : corner;
  return ((to_left <= to_up) & (to_left <= to_corner)) ? left : nearer;
}

/// Restores up to kRows rows at a time.
class Block {
 public:
  explicit Block(std::size_t width)
      : width_(width), stride_(width + 4 * kRows), up_(stride_), rows_(kRows + kRows * stride_) {}

  void restore(const std::uint8_t* filtered, std::size_t rows, const std::uint8_t* up,
               std::uint8_t* out) {
    std::memcpy(up_.data(), up, width_);
    std::array<Lanes, kFilters> is{};
    for (std::size_t k = 0; k < rows; ++k, filtered += width_ + 1) {
      for (std::size_t f = 0; f < kFilters; ++f) is[f][k] = filtered[0] == f ? 0xff : 0;
      std::memcpy(row(k), filtered + 1, width_);
    }
    Lanes left{}, above{};
    for (std::size_t i = 0; i < width_ + kRows - 1; i += kRows) {
      Tile tile;
      for (std::size_t k = 0; k < kRows; ++k) std::memcpy(&tile[k], row(k) + i - k, kRows);
      transpose(tile);
      for (std::size_t k = 0; k < kRows; ++k) {
        const Lanes corner = above;
        above = shuffled<0, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30>(
            Lanes{up_[i + k]}, left);
        const Lanes mean = (left & above) + ((left ^ above) >> 1);
        tile[k] += (is[kLeft] & left) | (is[kUp] & above) | (is[kMean] & mean) |
                   (is[kPaeth] & paeth(left, above, corner));
        left = tile[k];
      }
      transpose(tile);
      for (std::size_t k = 0; k < kRows; ++k) std::memcpy(row(k) + i - k, &tile[k], kRows);
    }
    for (std::size_t k = 0; k < rows; ++k) std::memcpy(out + k * width_, row(k), width_);
  }

 private:
  /// A tile begins up to kRows before a row, where all is 0, and ends up to twice that behind it.
  std::uint8_t* row(std::size_t k) { return rows_.data() + kRows + k * stride_; }

  std::size_t width_, stride_;
  std::vector<std::uint8_t> up_, rows_;
};

}  // namespace

bool restore_png_rows(Bytes filtered, std::size_t width, std::span<std::uint8_t> pixels) {
  const std::size_t height = pixels.size() / width;
  const auto row = [&](std::size_t y) { return filtered.subspan(y * (width + 1), width + 1); };
  for (std::size_t y = 0; y < height; ++y) {
    if (row(y)[0] >= kFilters) return false;
  }
  const std::vector<std::uint8_t> blank(width, 0);
  Block block(width);
  const std::uint8_t* up = blank.data();
  for (std::size_t y = 0; y < height;) {
    const Bytes first = row(y);
    std::uint8_t* out = pixels.data() + y * width;
    std::size_t rows = 1;
    if (first[0] == kNone) {
      std::memcpy(out, first.data() + 1, width);
    } else if (first[0] == kUp) {
      std::transform(first.begin() + 1, first.end(), up, out,
                     [](int a, int b) { return static_cast<std::uint8_t>(a + b); });
    } else {
      rows = std::min(kRows, height - y);
      block.restore(first.data(), rows, up, out);
    }
    y += rows;
    up = out + (rows - 1) * width;
  }
  return true;
}

}  // namespace viwo

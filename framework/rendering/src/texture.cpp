#include "viwo/rendering/texture.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <stdexcept>

#include "viwo/sim/random.hpp"

namespace viwo::rendering {
namespace {

using Grid = std::vector<float>;

constexpr float kScale = 256.F;
constexpr int kLeastSize = 8;
constexpr int kLastLevel = 4;  ///< so that there are two levels at least
/// Every level is smoothed by one of its texels; the next one by two of them.
constexpr double kNextBlur = 1.7320508075688772;

/// Gaussian smoothing of a grid that goes on periodically, along rows or along columns.
Grid smooth(const Grid& in, int size, double sigma, bool along_rows) {
  const int radius = static_cast<int>(std::ceil(4. * sigma));
  std::vector<float> kernel;
  double sum = 0.;
  for (int i = -radius; i <= radius; ++i) sum += std::exp(-0.5 * i * i / (sigma * sigma));
  for (int i = -radius; i <= radius; ++i) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma)) / sum));
  }
  const int mask = size - 1;
  const auto n = static_cast<std::size_t>(size);
  Grid out(in.size(), 0.F);
  for (int row = 0; row < size; ++row) {
    for (int k = -radius; k <= radius; ++k) {
      const float weight = kernel[static_cast<std::size_t>(k + radius)];
      float* const to = &out[static_cast<std::size_t>(row) * n];
      if (along_rows) {
        const float* const from = &in[static_cast<std::size_t>(row) * n];
        for (int i = 0; i < size; ++i) to[i] += weight * from[(i + k) & mask];
      } else {
        const float* const from = &in[static_cast<std::size_t>((row + k) & mask) * n];
        for (int i = 0; i < size; ++i) to[i] += weight * from[i];
      }
    }
  }
  return out;
}

Grid smooth(const Grid& in, int size, double sigma) {
  return smooth(smooth(in, size, sigma, true), size, sigma, false);
}

/// Every second texel of every second row.
Grid halve(const Grid& in, int size) {
  Grid out;
  out.reserve(in.size() / 4);
  for (int row = 0; row < size; row += 2) {
    for (int column = 0; column < size; column += 2) {
      out.push_back(in[static_cast<std::size_t>(row * size + column)]);
    }
  }
  return out;
}

/// One leaf: what is inside of it is painted over what is there.
struct Leaf {
  enum Shape { kRectangle, kTriangle, kDisc, kChecks, kShapes };
  Shape shape = kRectangle;
  float x = 0.F, y = 0.F;          ///< centre, texels
  float radius = 0.F;              ///< texels
  float slenderness = 1.F;         ///< height over width, of rectangles and checks
  float cosine = 1.F, sine = 0.F;  ///< of its turn
  float grey = 0.F, other_grey = 0.F;

  Leaf(sim::RandomStream& random, int size) {
    const auto draw = [&](double from, double to) {
      return static_cast<float>(from + random.uniform() * (to - from));
    };
    shape = static_cast<Shape>(std::min(kShapes - 1, static_cast<int>(draw(0., kShapes))));
    x = draw(0., size);
    y = draw(0., size);
    // Frequencies ~ radius^-3: then every octave of sizes covers the same area.
    const double least = 3., most = 0.15 * size;
    const double u = random.uniform();
    radius = static_cast<float>(1. / std::sqrt((1. - u) / (least * least) + u / (most * most)));
    slenderness = draw(0.4, 1.);
    const float turn = draw(0., 2. * M_PI);
    cosine = std::cos(turn);
    sine = std::sin(turn);
    grey = draw(35., 220.);
    // The fields of checks differ clearly.
    other_grey = grey + (grey > 127.F ? -1.F : 1.F) * draw(60., 110.);
  }

  /// Whether it covers the point (dx, dy) from its centre; then `out` is its colour.
  bool paint(float dx, float dy, float& out) const {
    const float a = cosine * dx + sine * dy;
    const float b = cosine * dy - sine * dx;
    const float half = slenderness * radius;
    out = grey;
    switch (shape) {
      case kDisc:
        return a * a + b * b < radius * radius;
      case kTriangle:
        return b > -0.5F * radius && b + 1.7320508F * std::abs(a) < radius;
      case kChecks:
        if ((a > 0.F) != (b > 0.F)) out = other_grey;
        [[fallthrough]];
      default:
        return std::abs(a) < 0.7F * radius && std::abs(b) < 0.7F * half;
    }
  }

  void paint(Grid& grid, int size) const {
    const int reach = static_cast<int>(std::ceil(radius));
    const int mask = size - 1;
    const int column = static_cast<int>(x), row = static_cast<int>(y);
    float colour = 0.F;
    for (int j = -reach; j <= reach; ++j) {
      for (int i = -reach; i <= reach; ++i) {
        const float dx = static_cast<float>(column + i) - x, dy = static_cast<float>(row + j) - y;
        if (!paint(dx, dy, colour)) continue;
        grid[static_cast<std::size_t>(((row + j) & mask) * size + ((column + i) & mask))] = colour;
      }
    }
  }
};

/// floor(log2(x)) of x >= 1: std::ilogb without its special cases.
int octave_of(float x) {
  constexpr int kBitsOfMantissa = 23, kBias = 127;
  return static_cast<int>(std::bit_cast<std::uint32_t>(x) >> kBitsOfMantissa) - kBias;
}

/// White noise of unit variance, smoothed to a wavelength of about `texels`.
void add_noise(sim::RandomStream& random, int size, int texels, float sigma, Grid& grid) {
  const int n = size / texels;
  Grid nodes(static_cast<std::size_t>(n * n));
  for (float& node : nodes) node = sigma * static_cast<float>(random.gaussian());
  const auto node = [&](int i, int j) {
    return nodes[static_cast<std::size_t>(((j + n) % n) * n + (i + n) % n)];
  };
  for (int row = 0; row < size; ++row) {
    for (int column = 0; column < size; ++column) {
      const int i = column / texels, j = row / texels;
      const auto fade = [&](int at) {
        const float u = static_cast<float>(at % texels) / static_cast<float>(texels);
        return u * u * (3.F - 2.F * u);
      };
      const float u = fade(column), v = fade(row);
      grid[static_cast<std::size_t>(row * size + column)] +=
          (1.F - v) * ((1.F - u) * node(i, j) + u * node(i + 1, j)) +
          v * ((1.F - u) * node(i, j + 1) + u * node(i + 1, j + 1));
    }
  }
}

}  // namespace

Texture::Texture(int size, const std::vector<float>& grey) {
  if (size < kLeastSize || !std::has_single_bit(static_cast<unsigned>(size)) ||
      grey.size() != static_cast<std::size_t>(size) * static_cast<std::size_t>(size)) {
    throw std::invalid_argument("a texture is square, its size a power of two, at least 8");
  }
  Grid grid = smooth(grey, size, 1.);  // (IMG-3)
  for (;;) {
    Level& level = levels_.emplace_back();
    level.size = size;
    for (int row = 0; row <= size; ++row) {
      for (int column = 0; column <= size; ++column) {
        const int i = (row % size) * size + column % size;
        const float value = std::clamp(grid[static_cast<std::size_t>(i)], 0.F, 255.F);
        level.texels.push_back(static_cast<std::uint16_t>(std::lround(value * kScale)));
      }
    }
    if (size == kLastLevel) return;
    grid = halve(smooth(grid, size, kNextBlur), size);
    size /= 2;
  }
}

float Texture::Level::at(float x, float y) const {
  const float left = std::floor(x), top = std::floor(y);
  const float u = x - left, v = y - top;
  const int mask = size - 1, stride = size + 1;
  const int i = static_cast<int>(left) & mask, j = static_cast<int>(top) & mask;
  const std::uint16_t* const upper = texels.data() + j * stride + i;
  const std::uint16_t* const lower = upper + stride;
  const float a = static_cast<float>(upper[0]) + u * static_cast<float>(upper[1] - upper[0]);
  const float b = static_cast<float>(lower[0]) + u * static_cast<float>(lower[1] - lower[0]);
  return a + v * (b - a);
}

float Texture::grey(float x, float y, float across, float along, float dx, float dy) const {
  const float wanted_along = kBlur * along;
  const float sigma = std::max({kBlur * across, wanted_along / kMostStretch, 1.F});
  // Variances add: the level's share and, below the next level, some of that one.
  const int octave = std::min(octave_of(sigma), static_cast<int>(levels_.size()) - 2);
  const float scale = 1.F / static_cast<float>(1U << octave);
  const float of_level = sigma * scale;
  const float coarse = std::min((of_level * of_level - 1.F) / 3.F, 1.F);  // (IMG-4)
  const Level& fine_level = levels_[static_cast<std::size_t>(octave)];
  const Level& coarse_level = levels_[static_cast<std::size_t>(octave) + 1];
  // (IMG-5): equal samples with the variance that is missing along the footprint.
  const float stretch = std::max(wanted_along / sigma, 1.F);
  const int taps = static_cast<int>(std::ceil(std::sqrt(3.F * stretch * stretch - 2.F)));
  const auto n = static_cast<float>(taps);
  const float spacing =
      taps > 1 ? sigma * std::sqrt(12.F * (stretch * stretch - 1.F) / (n * n - 1.F)) : 0.F;
  const float step_x = scale * spacing * dx, step_y = scale * spacing * dy;
  float at_x = scale * x - 0.5F * (n - 1.F) * step_x, at_y = scale * y - 0.5F * (n - 1.F) * step_y;
  float fine_sum = 0.F, coarse_sum = 0.F;
  for (int k = 0; k < taps; ++k, at_x += step_x, at_y += step_y) {
    fine_sum += fine_level.at(at_x, at_y);
    if (coarse > 0.F) coarse_sum += coarse_level.at(0.5F * at_x, 0.5F * at_y);
  }
  return (fine_sum + coarse * (coarse_sum - fine_sum)) / (n * kScale);
}

Texture leaves_texture(int size, std::uint64_t seed, std::uint64_t index) {
  sim::RandomStream random(seed, sim::Stream::kLandmarks, index);
  Grid grid(static_cast<std::size_t>(size) * static_cast<std::size_t>(size), 127.F);
  // Enough that the smallest leaves, which are most of them, cover a good part.
  const int leaves = size * size / 60;
  for (int i = 0; i < leaves; ++i) Leaf(random, size).paint(grid, size);
  for (int texels = 4; texels <= size / 8; texels *= 4) add_noise(random, size, texels, 7.F, grid);
  for (float& value : grid) value = std::clamp(value, 12.F, 243.F);
  return {size, grid};
}

}  // namespace viwo::rendering

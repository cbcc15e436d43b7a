// A grey pattern that tiles the plane, smoothed in advance for every distance it is looked at from.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace viwo::rendering {

/// Levels of the pattern, each smoothed and half as fine as the one before, so that what a pixel
/// averages is a few look-ups, without aliasing. Texel [row * size + column] of the pattern is at
/// (column, row) texels. Immutable, so calls may be concurrent.
class Texture {
 public:
  /// `size` x `size` grey levels from 0 to 255; the size is a power of two, at least 8, or
  /// std::invalid_argument is thrown.
  Texture(int size, const std::vector<float>& grey);

  /// The pattern at (x, y), in texels of the finest level, as a pixel sees it whose footprint is
  /// `across` texels wide and `along` >= across texels long, in the direction of the unit vector
  /// (dx, dy). Smoothing is Gaussian with kBlur of the footprint; it is never below one texel, and
  /// longer than kMostStretch times its width it is made wider.
  float grey(float x, float y, float across, float along, float dx, float dy) const;

  static constexpr float kBlur = 0.65F;       ///< standard deviation over the size of a pixel
  static constexpr float kMostStretch = 4.F;  ///< length over width of a footprint

 private:
  struct Level {
    /// Interpolated, in texels of this level.
    float at(float x, float y) const;

    int size = 0;
    /// Grey levels times a constant; at the end of each row its first one once more, and at the end
    /// the first row.
    std::vector<std::uint16_t> texels;
  };

  std::vector<Level> levels_;
};

/// A pattern with edges and corners of every size: leaves (rectangles, triangles, discs, checks) of
/// random place, grey level and turn that cover each other, their sizes distributed so that every
/// scale is as frequent as in pictures of the real world, under noise of every wavelength.
Texture leaves_texture(int size, std::uint64_t seed, std::uint64_t index);

}  // namespace viwo::rendering

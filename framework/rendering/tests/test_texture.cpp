// Textures: what is smoothed by how much, and what leaves look like.
#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "viwo/rendering/texture.hpp"

namespace viwo::rendering {
namespace {

/// 127 + 100 cos(2 pi (nx x + ny y) / size)
Texture wave(int size, int nx, int ny) {
  std::vector<float> grey;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      grey.push_back(127.F + 100.F * static_cast<float>(std::cos(2. * M_PI * (nx * x + ny * y) /
                                                                 static_cast<double>(size))));
    }
  }
  return {size, grey};
}

/// What a footprint leaves of the amplitude of 100, fitted at random places.
double amplitude(const Texture& texture, int size, int nx, int ny, float across, float along,
                 float dx, float dy) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<float> place(-3.F * static_cast<float>(size),
                                              3.F * static_cast<float>(size));
  double sum = 0., norm = 0.;
  for (int i = 0; i < 4000; ++i) {
    const float x = place(random), y = place(random);
    const double c =
        std::cos(2. * M_PI * (nx * static_cast<double>(x) + ny * static_cast<double>(y)) / size);
    sum += c * (static_cast<double>(texture.grey(x, y, across, along, dx, dy)) - 127.);
    norm += c * c;
  }
  return sum / norm;
}

TEST(Texture, RoundFootprintsSmoothByTheirShareOfAGaussian) {
  constexpr int kSize = 512, kWaves = 4;
  const Texture texture = wave(kSize, kWaves, 0);
  const double k = 2. * M_PI * kWaves / kSize;
  for (const float pixel : {0.1F, 1.F, 3.F, 6.F, 11.F, 20.F, 30.F}) {
    const double sigma = std::max(1., static_cast<double>(Texture::kBlur * pixel));
    // Interpolation smooths, too, by up to a sixth of the variance.
    const double expected = 100. * std::exp(-0.5 * k * k * sigma * sigma * 13. / 12.);
    EXPECT_NEAR(amplitude(texture, kSize, kWaves, 0, pixel, pixel, 1.F, 0.F), expected,
                0.03 * expected)
        << pixel;
  }
}

TEST(Texture, LongFootprintsSmoothAlongTheirDirectionOnly) {
  constexpr int kSize = 512, kWaves = 4;  // long waves: the window along is no Gaussian
  const double k = 2. * M_PI * kWaves / kSize;
  const Texture across = wave(kSize, 0, kWaves), along = wave(kSize, kWaves, 0);
  for (const float stretch : {1.3F, 2.F, 3.F, 4.F}) {
    const float pixel = 5.F;
    const double width = static_cast<double>(Texture::kBlur * pixel);
    const double length = width * static_cast<double>(stretch);
    const auto left = [&](double sigma) { return 100. * std::exp(-0.5 * k * k * sigma * sigma); };
    EXPECT_NEAR(amplitude(across, kSize, 0, kWaves, pixel, stretch * pixel, 1.F, 0.F),
                left(width * std::sqrt(13. / 12.)), 2.)
        << stretch;
    EXPECT_NEAR(amplitude(along, kSize, kWaves, 0, pixel, stretch * pixel, 1.F, 0.F),
                left(std::sqrt(length * length + width * width / 12.)), 3.)
        << stretch;
  }
}

TEST(Texture, NothingFinerThanAPixelIsLeft) {
  constexpr int kSize = 512;
  const Texture texture = wave(kSize, 128, 64);  // 4 texels by 8
  EXPECT_LT(std::abs(amplitude(texture, kSize, 128, 64, 8.F, 8.F, 1.F, 0.F)), 0.1);
  // Beyond the longest stretch a footprint is made wider.
  EXPECT_LT(std::abs(amplitude(texture, kSize, 128, 64, 1.F, 40.F, 0.F, 1.F)), 0.1);
  EXPECT_NEAR(texture.grey(17.3F, 5.1F, 1e6F, 1e9F, 1.F, 0.F), 127.F, 0.1F);
}

TEST(Texture, RefusesSizesThatAreNoPowerOfTwo) {
  EXPECT_THROW(Texture(12, std::vector<float>(144, 1.F)), std::invalid_argument);
  EXPECT_THROW(Texture(4, std::vector<float>(16, 1.F)), std::invalid_argument);
  EXPECT_THROW(Texture(16, std::vector<float>(255, 1.F)), std::invalid_argument);
}

TEST(LeavesTexture, HasContrastAtEveryScaleAndFollowsFromItsSeed) {
  constexpr int kSize = 512;
  const Texture texture = leaves_texture(kSize, 1, 1);
  const Texture again = leaves_texture(kSize, 1, 1), other = leaves_texture(kSize, 1, 2),
                seeded = leaves_texture(kSize, 2, 1);
  int same = 0, same_other = 0, same_seeded = 0, n = 0;
  for (const float pixel : {1.F, 4.F, 16.F}) {
    double sum = 0., square = 0., step = 0.;
    int m = 0;
    for (float y = 0.5F; y < kSize; y += 4.F) {
      for (float x = 0.5F; x < kSize; x += 4.F) {
        const float value = texture.grey(x, y, pixel, pixel, 1.F, 0.F);
        sum += static_cast<double>(value);
        square += static_cast<double>(value * value);
        step += static_cast<double>(
            std::abs(texture.grey(x + 2.F * pixel, y, pixel, pixel, 1.F, 0.F) - value));
        same += again.grey(x, y, pixel, pixel, 1.F, 0.F) == value ? 1 : 0;
        same_other += other.grey(x, y, pixel, pixel, 1.F, 0.F) == value ? 1 : 0;
        same_seeded += seeded.grey(x, y, pixel, pixel, 1.F, 0.F) == value ? 1 : 0;
        ++m;
      }
    }
    EXPECT_NEAR(sum / m, 127., 25.);
    EXPECT_GT(std::sqrt(square / m - sum / m * sum / m), 18.) << pixel;
    EXPECT_GT(step / m, 7.) << pixel;  // between neighbours of two pixels
    n += m;
  }
  EXPECT_EQ(same, n);
  EXPECT_LT(same_other, n / 100);
  EXPECT_LT(same_seeded, n / 100);
}

}  // namespace
}  // namespace viwo::rendering

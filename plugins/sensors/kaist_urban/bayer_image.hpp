// Images as the dataset stores them: PNG files of what the colour sensor saw, one colour a pixel.
#pragma once

#include <filesystem>
#include <utility>

#include "viwo/api/measurement.hpp"

namespace viwo::kaist {

/// An 8 bit image file with a Bayer pattern, red at its first pixel and blue diagonally below
/// (RGGB), read as grey.
class BayerImage final : public ImageSource {
 public:
  explicit BayerImage(std::filesystem::path file) : file_(std::move(file)) {}
  void read(Image& out) const override;
  void read_of_size(int width_px, int height_px, Image& out) const override;

 private:
  void to_grey(Image& out) const;

  std::filesystem::path file_;
};

}  // namespace viwo::kaist

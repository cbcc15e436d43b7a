#include "viwo/view/picture.hpp"

#include <stdexcept>

#include "viwo/image/image_file.hpp"

namespace viwo::view {

std::string encode_png(const Picture& picture) {
  if (picture.bgr.empty()) throw std::invalid_argument("view: a picture without pixels");
  const auto bytes =
      viwo::encode_png(picture.bgr, picture.width_px, picture.height_px, PngColours::kBgr);
  return {bytes.begin(), bytes.end()};
}

}  // namespace viwo::view

#include "viwo/view/picture.hpp"

#include <stdexcept>

#include <opencv2/imgcodecs.hpp>

#include "canvas.hpp"

namespace viwo::view {

std::string encode_png(const Picture& picture) {
  if (picture.bgr.empty()) throw std::invalid_argument("view: a picture without pixels");
  std::vector<unsigned char> bytes;
  cv::imencode(".png", as_mat(picture), bytes);
  return {bytes.begin(), bytes.end()};
}

}  // namespace viwo::view

#include "bayer_image.hpp"

#include <opencv2/imgproc.hpp>

#include "viwo/api/status.hpp"
#include "viwo/image/image_file.hpp"

namespace viwo::kaist {

void BayerImage::read(Image& out) const {
  read_image(file_, out);
  to_grey(out);
}

void BayerImage::read_of_size(int width_px, int height_px, Image& out) const {
  read_image_of_size(file_, width_px, height_px, out);
  if (!out.pixels.empty()) to_grey(out);
}

void BayerImage::to_grey(Image& out) const {
  if (out.width_px < 3 || out.height_px < 3) {
    throw InputError(file_.string() + ": the image is too small for a Bayer pattern");
  }
  const cv::Mat raw(out.height_px, out.width_px, CV_8UC1, out.pixels.data());
  cv::Mat grey;
  // OpenCV calls a pattern by the second and third pixel of the second row: here blue, green.
  cv::cvtColor(raw, grey, cv::COLOR_BayerBG2GRAY);  // (KU-3)
  out.pixels.assign(grey.datastart, grey.dataend);
}

}  // namespace viwo::kaist

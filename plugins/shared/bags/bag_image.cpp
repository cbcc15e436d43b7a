#include "bag_image.hpp"

#include <span>
#include <utility>

#include "messages.hpp"
#include "viwo/api/status.hpp"
#include "viwo/image/image_file.hpp"

namespace viwo::bag {
namespace {

/// The bytes of the file in a message.
std::span<const std::uint8_t> file_in(FieldReader& in) {
  in.header();
  in.text();  // the format, which the bytes tell, too
  return in.bytes();
}

}  // namespace

void read_image(FieldReader& in, bool is_compressed, const std::string& where, Image& out) {
  if (is_compressed) {
    decode_image(file_in(in), where, out);
  } else {
    const ImageHead head = read_image_head(in);
    to_grey(head, in.bytes(), out);
  }
}

void read_image_of_size(FieldReader& in, bool is_compressed, const std::string& where, int width_px,
                        int height_px, Image& out) {
  if (is_compressed) {
    decode_image_of_size(file_in(in), where, width_px, height_px, out);
  } else {
    read_image(in, false, where, out);  // a message has all its pixels
    if (out.width_px != width_px || out.height_px != height_px) out.pixels.clear();
  }
}

BagImage::BagImage(std::shared_ptr<const Bag> bag, std::function<void(Bytes&)> load,
                   bool is_compressed, std::string where)
    : bag_(std::move(bag)),
      load_(std::move(load)),
      is_compressed_(is_compressed),
      where_(std::move(where)) {}

template <class Decode>
void BagImage::load_and(const Decode& decode) const {
  Bytes message;
  load_(message);
  try {
    decode(*bag_->fields(message));
  } catch (const BrokenMessage& broken) {
    throw InputError(where_ + ": " + broken.what());
  }
}

void BagImage::read(Image& out) const {
  load_and([&](FieldReader& in) { read_image(in, is_compressed_, where_, out); });
}

void BagImage::read_of_size(int width_px, int height_px, Image& out) const {
  load_and([&](FieldReader& in) {
    read_image_of_size(in, is_compressed_, where_, width_px, height_px, out);
  });
}

}  // namespace viwo::bag

#include "bag_image.hpp"

#include <utility>

#include "messages.hpp"
#include "viwo/api/status.hpp"
#include "viwo/image/image_file.hpp"

namespace viwo::bag {

void read_image(FieldReader& in, bool is_compressed, const std::string& where, Image& out) {
  if (is_compressed) {
    in.header();
    in.text();  // the format, which the bytes tell, too
    decode_image(in.bytes(), where, out);
  } else {
    const ImageHead head = read_image_head(in);
    to_grey(head, in.bytes(), out);
  }
}

BagImage::BagImage(std::shared_ptr<const Bag> bag, std::function<void(Bytes&)> load,
                   bool is_compressed, std::string where)
    : bag_(std::move(bag)),
      load_(std::move(load)),
      is_compressed_(is_compressed),
      where_(std::move(where)) {}

void BagImage::read(Image& out) const {
  Bytes message;
  load_(message);
  try {
    read_image(*bag_->fields(message), is_compressed_, where_, out);
  } catch (const BrokenMessage& broken) {
    throw InputError(where_ + ": " + broken.what());
  }
}

}  // namespace viwo::bag

#include "bag_image.hpp"

#include <utility>

#include "messages.hpp"
#include "viwo/api/status.hpp"
#include "viwo/image/image_file.hpp"

namespace viwo::bag {

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
    const auto in = bag_->fields(message);
    if (is_compressed_) {
      in->header();
      in->text();  // the format, which the bytes tell, too
      decode_image(in->bytes(), where_, out);
    } else {
      const ImageHead head = read_image_head(*in);
      to_grey(head, in->bytes(), out);
    }
  } catch (const BrokenMessage& broken) {
    throw InputError(where_ + ": " + broken.what());
  }
}

}  // namespace viwo::bag

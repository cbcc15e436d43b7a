// An image of a message; of a bag it is read when it is needed.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "bag.hpp"
#include "field_reader.hpp"
#include "viwo/api/measurement.hpp"

namespace viwo::bag {

/// Decodes a sensor_msgs/Image or CompressedImage. BrokenMessage, or InputError with
/// `where`, when it cannot be.
void read_image(FieldReader& in, bool is_compressed, const std::string& where, Image& out);
/// The same as ImageSource::read_of_size().
void read_image_of_size(FieldReader& in, bool is_compressed, const std::string& where, int width_px,
                        int height_px, Image& out);

class BagImage final : public ImageSource {
 public:
  /// `load` reads the message; `where` is it for error messages.
  BagImage(std::shared_ptr<const Bag> bag, std::function<void(Bytes&)> load, bool is_compressed,
           std::string where);
  void read(Image& out) const override;
  void read_of_size(int width_px, int height_px, Image& out) const override;

 private:
  /// Calls `decode` with the fields of the message.
  template <class Decode>
  void load_and(const Decode& decode) const;

  std::shared_ptr<const Bag> bag_;
  std::function<void(Bytes&)> load_;
  bool is_compressed_;
  std::string where_;
};

}  // namespace viwo::bag

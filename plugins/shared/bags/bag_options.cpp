#include "bag_options.hpp"

namespace viwo::bag {

BagOptions options_from(const ParamSet& params) {
  BagOptions options{topic_options_from(params, "path", "read")};
  options.stride = log::encoder_options_from(params, "position").stride;
  options.gnss_stride = static_cast<int>(params.integer("gnss_stride"));
  options.max_rejected_fraction = params.number("max_rejected_fraction");
  options.by_reception = params.text("clock") == "reception";
  options.start_s = params.number("start_s");
  options.duration_s = params.number("duration_s");
  return options;
}

}  // namespace viwo::bag

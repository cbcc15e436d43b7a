// Registration of the update visual_features.
#include "viwo/api/plugin.hpp"

#include "visual_features.hpp"

namespace viwo {
namespace {

VIWO_REGISTER(Update, visual::VisualFeatures, "visual_features", "1.0.0",
              "feature tracks of any number of cameras (MSCKF)", "Apache-2.0", visual::Params);

}  // namespace
}  // namespace viwo

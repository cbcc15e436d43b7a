// Plugin klt_tracker (model.md).
#include "viwo/api/plugin.hpp"

#include "klt_tracker.hpp"
#include "params.hpp"

namespace viwo {
namespace {

VIWO_REGISTER(Sensor, klt::KltTracker, "klt_tracker", "1.0.0",
              "feature tracks from images (Lucas-Kanade), mono and stereo", "Apache-2.0",
              klt::Params);

}  // namespace
}  // namespace viwo

#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <vector>

#include "viwo/checks/checks.hpp"
#include "viwo/math/heading_jumps.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/time_text.hpp"

namespace viwo::inspect {

void check_headings(const series::Recording& recording, Findings& out) {
  for (const series::Headings& headings : recording.headings) {
    const auto& samples = headings.samples;
    const std::vector<std::size_t> jumps = heading_jumps(samples);
    if (jumps.empty()) continue;
    const std::size_t i = jumps.front();
    const double jump_rad =
        std::remainder(samples[i].yaw_rad - samples[i - 1].yaw_rad, 2. * std::numbers::pi);
    const std::string others =
        jumps.size() > 1 ? ", and " + std::to_string(jumps.size() - 1) + " times more" : "";
    out.push_back(
        {recording.label<HeadingSample>(headings.sensor),
         Severity::kNote,
         "jumps",
         "it jumps by " + significant(jump_rad * 180. / std::numbers::pi, 3) + " deg at " +
             time_text(samples[i].t_ns - samples.front().t_ns) + " of its time" + others +
             ": the gyro was set to zero; a calibration leaves out what is around it",
         {{"jumps", static_cast<double>(jumps.size()), ""}, {"first jump", jump_rad, "rad"}}});
  }
}

}  // namespace viwo::inspect

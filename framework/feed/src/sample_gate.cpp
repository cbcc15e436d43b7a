#include "sample_gate.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "viwo/api/measurement.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/extent.hpp"

namespace viwo {
namespace {

bool is_unit(const std::array<double, 4>& xyzw) {
  constexpr double kMostOff = 1e-3;  // as the readers of recordings have it
  return std::abs(to_quaternion(xyzw).norm() - 1.) <= kMostOff;
}

const char* fault_of_numbers(SampleView sample) {
  if (const char* fault = sample.type().fault(sample.data())) return fault;
  const auto* const pose = sample.get_if<PoseSample>();
  const auto* const state = sample.get_if<StateSample>();
  const bool has_orientation = (pose == nullptr || is_unit(pose->q_BtoW_xyzw)) &&
                               (state == nullptr || is_unit(state->q_ItoG_xyzw));
  return has_orientation ? nullptr : "quaternion that is not of unit norm";
}

}  // namespace

auto SampleGate::kind_of(const std::string& sensor, SampleView sample) -> Kind& {
  const SampleType& type = sample.type();
  const int channel = type.channel(sample.data());
  const auto known = std::find_if(kinds_.begin(), kinds_.end(), [&](const Kind& kind) {
    return kind.channel == channel && kind.sensor == sensor && *kind.type == type;
  });
  return known != kinds_.end() ? *known : kinds_.emplace_back(Kind{sensor, &type, channel, {}, {}});
}

bool SampleGate::accept(const std::string& sensor, SampleView sample) {
  Kind& kind = kind_of(sensor, sample);
  const SampleExtent extent = sample.extent();
  const char* why = fault_of_numbers(sample);
  if (why == nullptr) why = fault_of(extent);
  if (why == nullptr && kind.last) why = fault_of(extent, *kind.last);
  if (why != nullptr) {
    kind.rejections.add(std::string(sample.type().name) + ": " + why, extent.t_ns);
    return false;
  }
  kind.last = extent;
  return true;
}

void SampleGate::append_to(std::vector<std::pair<std::string, RejectionCount>>& out) const {
  for (const Kind& kind : kinds_) {
    for (const RejectionCount& count : kind.rejections.counts())
      out.emplace_back(kind.sensor, count);
  }
}

}  // namespace viwo

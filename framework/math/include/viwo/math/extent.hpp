// Which times a sample can stand for.
#pragma once

#include "viwo/api/sample.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo {

/// Why no sample can have these times; nullptr: one can.
inline const char* fault_of(const SampleExtent& extent) {
  if (!is_stamp(extent.t_ns) || !is_stamp(extent.begin_ns) || !is_stamp(extent.end_ns)) {
    return "stamp that is none";
  }
  const bool is_within = extent.begin_ns <= extent.t_ns && extent.t_ns <= extent.end_ns;
  return is_within ? nullptr : "stamp outside of the time that it stands for";
}

/// The same of one that comes after another one of its kind.
inline const char* fault_of(const SampleExtent& extent, const SampleExtent& before) {
  if (extent.begin_ns >= before.end_ns && extent.t_ns > before.t_ns) return nullptr;
  return extent.begin_ns < extent.end_ns ? "begins before the end of the last"
                                         : "stamp not after the last";
}

}  // namespace viwo

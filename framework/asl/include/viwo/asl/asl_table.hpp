// Sensors that play one table of a log folder back; a plugin names its samples and its reader.
#pragma once

#include <filesystem>

#include "viwo/api/host_services.hpp"
#include "viwo/api/params.hpp"
#include "viwo/log/recording.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo::log {

/// Which table, and in `Limits` how much of it may be wrong.
template <class Limits>
struct TableParamsWith : Limits {
  std::filesystem::path path;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(path), {.required = true, .help = "the table, or the folder of its data.csv"});
    Limits::bind(b);
  }
};

struct TableParams : TableParamsWith<LimitParams> {
  LogLimits allowed() const { return limits(); }
};
/// Of a table whose gaps are not counted.
struct GaplessTableParams : TableParamsWith<MaxRejectedParams> {
  double allowed() const { return max_rejected_fraction; }
};

/// `read`: a reader of viwo/asl/asl.hpp.
template <class Sample, auto read, class Params = TableParams>
class AslTable final : public RecordingSensor<Sample> {
 public:
  AslTable(const Params& params, const HostServices& /*services*/)
      : RecordingSensor<Sample>(read(params.path, params.allowed())) {}
};

}  // namespace viwo::log

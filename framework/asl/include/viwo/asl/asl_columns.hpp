// Columns that the tables of an ASL folder have in common.
#pragma once

#include <cstddef>

#include "viwo/log/table_reader.hpp"

namespace viwo::log {

/// The column of the stamps, whichever of its names it has; `usual` is the one that is missed.
inline std::size_t stamp_column(const TableReader& table, const char* usual = "timestamp_ns") {
  for (const char* name : {"timestamp_ns", "timestamp [ns]", "timestamp"}) {
    if (table.has_column(name)) return table.column(name);
  }
  return table.column(usual);
}

}  // namespace viwo::log

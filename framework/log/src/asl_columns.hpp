// Columns that the tables of an ASL folder have in common.
#pragma once

#include <cstddef>

#include "viwo/log/table_reader.hpp"

namespace viwo::log {

/// The column of the stamps: EuRoC's name, or what others call it.
inline std::size_t stamp_column(const TableReader& table) {
  for (const char* name : {"timestamp [ns]", "timestamp"}) {
    if (table.has_column(name)) return table.column(name);
  }
  return table.column("timestamp_ns");
}

}  // namespace viwo::log

#pragma once

#include <string>

#include "support.hpp"

namespace viwo {

class CsvTable : public SensorsInFolder {
 protected:
  /// The section of a sensor on a table of this text.
  std::string table(const std::string& text, const std::string& rest,
                    const std::string& name = "t.csv") const {
    return "{type: csv_table, path: " + write(name, text) + ", " + rest + "}";
  }
};

}  // namespace viwo

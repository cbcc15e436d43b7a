#pragma once

namespace viwo::app {

/// From now on the program ends with exit code 1 and a message where there is not enough memory and
/// nobody can be told, instead of by a signal: functions that must not throw allocate, too, such as
/// those of std::filesystem that list a folder.
void end_well_without_memory();

}  // namespace viwo::app

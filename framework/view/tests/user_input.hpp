// What a user does to a window of an X server, without a window manager.
#pragma once

#include <string>

namespace viwo::view {

/// Types a key ("q", "Escape") into every window whose title is `title`; how many there are.
int type_key(const std::string& title, const char* key);

/// Closes them by their button.
int close_window(const std::string& title);

}  // namespace viwo::view

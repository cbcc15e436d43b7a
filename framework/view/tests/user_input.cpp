#include "user_input.hpp"

#include <functional>

#include <X11/Xlib.h>
#include <X11/Xutil.h>

namespace viwo::view {
namespace {

int for_each_window(const std::string& title,
                    const std::function<void(Display*, Window)>& send_to) {
  Display* display = XOpenDisplay(nullptr);
  if (display == nullptr) return 0;
  Window root = 0, parent = 0, *children = nullptr;
  unsigned n = 0;
  int count = 0;
  XQueryTree(display, XDefaultRootWindow(display), &root, &parent, &children, &n);
  for (unsigned i = 0; i < n; ++i) {
    char* name = nullptr;
    if (XFetchName(display, children[i], &name) == 0 || name == nullptr) continue;
    if (title == name) {
      send_to(display, children[i]);
      ++count;
    }
    XFree(name);
  }
  if (children != nullptr) XFree(children);
  XCloseDisplay(display);  // sends what waits
  return count;
}

}  // namespace

int type_key(const std::string& title, const char* key) {
  return for_each_window(title, [key](Display* display, Window window) {
    XEvent event{};
    event.xkey.type = KeyPress;
    event.xkey.display = display;
    event.xkey.window = window;
    event.xkey.root = XDefaultRootWindow(display);
    event.xkey.same_screen = True;
    event.xkey.keycode = XKeysymToKeycode(display, XStringToKeysym(key));
    XSendEvent(display, window, True, KeyPressMask, &event);
  });
}

int close_window(const std::string& title) {
  return for_each_window(title, [](Display* display, Window window) {
    XEvent event{};
    event.xclient.type = ClientMessage;
    event.xclient.window = window;
    event.xclient.message_type = XInternAtom(display, "WM_PROTOCOLS", False);
    event.xclient.format = 32;
    event.xclient.data.l[0] = static_cast<long>(XInternAtom(display, "WM_DELETE_WINDOW", False));
    XSendEvent(display, window, False, NoEventMask, &event);
  });
}

}  // namespace viwo::view

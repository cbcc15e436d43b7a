// Any shared library: nothing of viwo in it, but a symbol of that name.
extern "C" __attribute__((visibility("default"))) const int viwo_plugin;
extern "C" const int viwo_plugin = 1;

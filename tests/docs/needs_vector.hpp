// Does not compile alone: a counter-example for the check of the public headers.
#pragma once

inline std::vector<int> numbers();

// Symbol visibility of libviwo_api.so: everything is hidden but what carries VIWO_API.
#pragma once

#define VIWO_API __attribute__((visibility("default")))

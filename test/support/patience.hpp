#pragma once

#include <chrono>

namespace km {

/// Upper bound on anything a test waits for, also with a sanitizer on a host with twenty times its
/// usual load. Only a failing test takes that long.
inline constexpr std::chrono::seconds kPatience{300};

}  // namespace km

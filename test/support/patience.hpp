#pragma once

#include <chrono>

namespace km {

/// Upper bound on anything a test waits for, under a sanitizer and load too: only a failing test
/// takes that long.
inline constexpr std::chrono::seconds kPatience{60};

}  // namespace km

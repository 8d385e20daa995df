#pragma once

#include <string>

#include "modules/core/text_table.hpp"

namespace km {

/// "5.3 %" for 0.053, "12 %" for 0.12.
[[nodiscard]] inline std::string percent(double share) {
  return fixed(100.0 * share, share < 0.1 ? 1 : 0) + " %";
}

/// "1.5 ms" for 0.0015.
[[nodiscard]] inline std::string milliseconds(double seconds) {
  return fixed(1e3 * seconds, 1) + " ms";
}

}  // namespace km

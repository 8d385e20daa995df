#pragma once

#include <cstdint>

namespace km {

/// Solver of a session. The values are those in messages.
enum class PgoMethod : std::uint8_t {
  kRbcd = 0,    ///< Riemannian block-coordinate descent, see MemberRbcd.
  kNewton = 1,  ///< Newton's method, robust, see TreeNewton.
};

/// The name in configuration files.
[[nodiscard]] constexpr const char* to_string(PgoMethod method) {
  return method == PgoMethod::kNewton ? "newton" : "rbcd";
}

}  // namespace km
